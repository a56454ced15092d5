"""Columns of the tables on reference drivers, in order, each with its pandas dtype (Int64: whole numbers or empty)."""

from __future__ import annotations

REFERENCE_COLUMNS = {
    "arm": "object",
    "persona": "object",
    "seed": "int64",
    "episode": "int64",
    "driver": "object",
    "ego_outcome": "object",
    "failed_s": "float64",
    "conflict_s": "float64",
    "prevented_from_conflict": "Int64",
    "prevented_from_start": "Int64",
    "outcome_from_start": "object",
    "preventable_from_s": "float64",
    "preventable_until_s": "float64",
    "error": "object",
}
"""Columns of `reference_drivers.csv`: a row for each failure of the ego and each reference driver.

`conflict_s`: the first moment at which the driver's rule says danger. `outcome_from_start`: how the same game ends with
this driver in the ego's seat; `on_red` or `wrong_way` for a goal that it reaches by breaking this rule.
`preventable_from_s` and `preventable_until_s`: the first and the last moment from which braking as hard as friction
allows prevents the collision (of the game, so the same for all drivers)."""


def _of_verdict(verdict: str) -> dict[str, str]:
    counts = {f"{verdict}_judged": "int64", f"{verdict}_prevented": "int64"}
    return counts | {f"{verdict}_{name}{end}": "float64" for name in ("share", "rate") for end in ("", "_low", "_high")}


PREVENTABILITY_COLUMNS = {
    "arm": "object",
    "persona": "object",
    "seed": "int64",
    "driver": "object",
    "episodes": "int64",
    "failures": "int64",
    **_of_verdict("from_conflict"),
    **_of_verdict("from_start"),
}
"""Columns of `preventability.csv`: a row for each arm, training seed and reference driver, and for `any` of them but
the upper bound. A share is of the failures with a verdict, a rate of all games played."""

REFERENCE_TABLES = {"reference_drivers": REFERENCE_COLUMNS, "preventability": PREVENTABILITY_COLUMNS}
"""The tables by the name of their file."""
