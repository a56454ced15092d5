"""The near misses of an arm, by criterion, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

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
