"""Games until the first failure: learned people against searchers.

A search that finds nothing in its games is censored: its number of games is greater, by how much is unknown. Two groups
of searches are compared by the log-rank test (Mantel 1966), and shown by their restricted means: the games played until
the first find, at most all of the search.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np
import pandas as pd
import scipy

from harness.evaluation.comparisons.comparison import holm
from harness.evaluation.tables import table_of

FAILURE = "failure"
"""The criterion that any failure of the ego meets; the others are names of reference drivers that prevent it."""


class SoonerVerdict(str, Enum):
    """Every value the column `verdict` of the table `falsification` can have."""

    PERSON = "the person is sooner"
    SEARCHER = "the searcher is sooner"
    NEITHER = "not distinguishable"
    NOTHING_FOUND = "neither finds one"


@dataclass(frozen=True, kw_only=True)
class SearchResult:
    arm: str
    seed: int
    searcher: str
    learned: bool
    """Whether learned people play, from random starts: this is no search, but what it is compared with."""
    repeat: int
    games: int
    found: Mapping[str, Sequence[int]]
    """By criterion: the numbers of the games that meet it, from 1, ascending."""

    def first(self, criterion: str) -> int | None:
        """The first game that meets a criterion; None: no game does."""
        return next(iter(self.found[criterion]), None)


def searches_table(results: Iterable[SearchResult]) -> pd.DataFrame:
    """A row for each search and criterion, the table `searches`."""
    rows = [
        vars(each) | {"criterion": criterion, "found": len(found), "first_game": each.first(criterion)}
        for each in results
        for criterion, found in each.found.items()
    ]
    return table_of("searches", rows)


def falsification_table(results: Sequence[SearchResult], significance: float) -> pd.DataFrame:
    """A row for each criterion, arm of learned people and searcher, the table `falsification`.

    The log-rank test is two-sided; Holm's correction is over all rows. There is no test where neither finds anything.
    """
    groups: dict[tuple[str, str, int, bool], list[SearchResult]] = {}
    for each in results:
        groups.setdefault((each.arm, each.searcher, each.seed, each.learned), []).append(each)
    people = [(key, found) for key, found in groups.items() if key[-1]]
    searchers = [(key, found) for key, found in groups.items() if not key[-1]]
    rows = [
        {"criterion": criterion, "arm": arm, "seed": seed, "searched_arm": searched, "searcher": searcher}
        | {"repeats": len(by_person), "games": by_person[0].games}
        | _compared(by_person, by_searcher, criterion)
        for criterion in (results[0].found if results else ())
        for (arm, _, seed, _), by_person in people
        for (searched, searcher, _, _), by_searcher in searchers
    ]
    table = table_of("falsification", rows)
    table["p_holm"] = holm(table["p_value"].to_numpy(dtype=np.float64))
    table["verdict"] = [_verdict(row, significance).value for row in table.to_dict("records")]
    return table


def _compared(
    by_person: Sequence[SearchResult], by_searcher: Sequence[SearchResult], criterion: str
) -> dict[str, float | None]:
    cells: dict[str, float | None] = {}
    times = []
    for side, results in (("person", by_person), ("searcher", by_searcher)):
        firsts = [each.first(criterion) for each in results]
        found = [first for first in firsts if first is not None]
        censored = [each.games for each, first in zip(results, firsts, strict=True) if first is None]
        cells |= {f"found_by_{side}": len(found), f"mean_games_{side}": float(np.mean([*found, *censored]))}
        times.append(scipy.stats.CensoredData(uncensored=found, right=censored))
    anything = cells["found_by_person"] or cells["found_by_searcher"]
    return cells | {"p_value": float(scipy.stats.logrank(*times).pvalue) if anything else None}


def _verdict(row: dict[str, Any], significance: float) -> SoonerVerdict:
    if not row["found_by_person"] and not row["found_by_searcher"]:
        return SoonerVerdict.NOTHING_FOUND
    if not row["p_holm"] < significance:
        return SoonerVerdict.NEITHER
    sooner = row["mean_games_person"] < row["mean_games_searcher"]
    return SoonerVerdict.PERSON if sooner else SoonerVerdict.SEARCHER
