"""Games until the first failure: means of censored searches, the log-rank test, and verdicts."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pytest

from harness.evaluation.comparisons.games_to_failure import (
    FAILURE,
    SearchResult,
    SoonerVerdict,
    falsification_table,
    searches_table,
)

GAMES, SIGNIFICANCE = 10, 0.01


def results(learned: bool, firsts: Sequence[int | None]) -> list[SearchResult]:
    """Searches that find their first failure in these games; None: they find none."""
    return [
        SearchResult(
            arm="naive_vs_speedy" if learned else "naive_vs_sumo",
            seed=1,
            searcher="random" if learned else "cma-es",
            learned=learned,
            repeat=repeat,
            games=GAMES,
            found={FAILURE: [] if first is None else [first, GAMES]},
        )
        for repeat, first in enumerate(firsts)
    ]


def compared(person: Sequence[int | None], searcher: Sequence[int | None]) -> dict[str, object]:
    (row,) = falsification_table([*results(True, person), *results(False, searcher)], SIGNIFICANCE).to_dict("records")
    return {str(key): value for key, value in row.items()}


def test_table__a_search_without_a_find_counts_with_all_its_games() -> None:
    row = compared([1, 3], [None, 4])
    assert (row["found_by_person"], row["found_by_searcher"]) == (2, 1)
    assert (row["mean_games_person"], row["mean_games_searcher"]) == (2.0, 7.0)


def test_table__its_p_value_is_that_of_the_log_rank_test() -> None:
    # At game 1 one of 4 finds, at 2 one of 3, at 3 one of 2: expected of the person 2/4, 1/3, 0; variances 1/4, 2/9, 0.
    observed, expected, variance = 2, 2 / 4 + 1 / 3, 1 / 4 + 2 / 9
    z = (observed - expected) / math.sqrt(variance)
    assert compared([1, 2], [3, None])["p_value"] == pytest.approx(math.erfc(abs(z) / math.sqrt(2)))


def test_verdict__says_who_is_sooner_where_the_difference_is_significant() -> None:
    soon, late = [1] * 12, [None] * 12
    assert compared(soon, late)["verdict"] == SoonerVerdict.PERSON.value
    assert compared(late, soon)["verdict"] == SoonerVerdict.SEARCHER.value
    assert compared([1, 2], [3, None])["verdict"] == SoonerVerdict.NEITHER.value


def test_verdict__without_a_find_on_either_side_there_is_no_test() -> None:
    row = compared([None] * 3, [None] * 3)
    assert row["verdict"] == SoonerVerdict.NOTHING_FOUND.value
    assert math.isnan(float(str(row["p_value"])))


def test_searches__a_row_for_each_search_with_its_first_game() -> None:
    table = searches_table(results(False, [4, None]))
    assert table["first_game"].fillna(0).tolist() == [4, 0]
    assert table["found"].tolist() == [2, 0]
