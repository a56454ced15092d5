"""Near misses of an arm by criterion, and harm to others in some arms, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import pandas as pd

from harness.evaluation.severity.closeness import CRITERIA

_BOUNDS = [each.bound for each in CRITERIA]
ANY_CRITERION = " or ".join((", ".join(_BOUNDS[:-1]), _BOUNDS[-1]))
"""All criteria, after "by"."""


def near_misses(row: Mapping[Any, Any]) -> int:
    """How many games of an arm are near misses, from its row of summary.csv."""
    return round(row["near_miss_rate"] * (row["episodes"] - row["errors"]))


def by_criterion(rows: Sequence[Mapping[Any, Any]]) -> str:
    """How many near misses there are by each criterion, such as "9 by time to collision of at most 1.5 s", from rows of
    summary.csv with a near_miss_rate."""
    counts = {each: sum(int(row[f"near_misses_by_{each.name}"]) for row in rows) for each in CRITERIA}
    if not any(counts.values()):
        return f"none by {ANY_CRITERION}"
    words = ", ".join(f"{count} by {each.bound}" for each, count in counts.items() if count)
    return f"{words} (a game can meet several)" if sum(counts.values()) > sum(map(near_misses, rows)) else words


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
