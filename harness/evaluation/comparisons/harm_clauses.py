"""Harm to others than the ego in an arm and in another, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import pandas as pd

Rows = Sequence[Mapping[Any, Any]]
"""Rows of summary.csv: an arm's, one for each training seed."""


class Beside(NamedTuple):
    """What happens to others beside an ego."""

    ego: str
    """The ego in sentences, such as "the naive ego"."""
    rows: Rows


_WHO = {"person_failure": ("a person", "person_failures"), "bystander_failure": ("a bystander", "bystander_failures")}


def harm_clauses(*egos: Beside) -> dict[str, str]:
    """What happens beside each of the egos, a clause by the `metric` of comparisons.csv, such as "a person fails in 22
    of 100 games beside the retrained ego, and in 2 of 100 beside the naive ego"; those that could be measured beside
    all of them."""
    clauses = {metric: _failures(*who, egos) for metric, who in _WHO.items()}
    return {metric: clause for metric, clause in {**clauses, "follower_braking": _braking(egos)}.items() if clause}


def _failures(who: str, column: str, egos: Sequence[Beside]) -> str:
    counts: list[str] = []
    for ego, rows in egos:
        measured = [row for row in rows if not pd.isna(row[column])]
        if not measured:
            return ""
        games = sum(row["episodes"] - row["errors"] for row in measured)
        word = "" if counts else " games"
        counts.append(f"in {sum(int(row[column]) for row in measured):,} of {games:,}{word} beside {ego}")
    return f"{who} fails {', and '.join(counts)}"


def _braking(egos: Sequence[Beside]) -> str:
    means = []
    for ego, rows in egos:
        braking_mps2 = pd.Series([row["follower_max_deceleration_mps2"] for row in rows], dtype=float).mean()
        if pd.isna(braking_mps2):
            return ""
        means.append(f"by {braking_mps2:.1f} m/s² beside {ego}")
    return f"at its strongest the follower brakes {', and '.join(means)} (mean over the games)"
