"""Near misses by criterion, in words."""

from __future__ import annotations

from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from harness.evaluation.comparisons.arm_clauses import ANY_CRITERION, by_criterion, near_misses
from harness.evaluation.comparisons.summary import summarise
from harness.evaluation.tables import table_of

NAMES = ("ttc", "pet", "headway")
met = st.lists(st.tuples(*[st.integers(0, 1)] * len(NAMES)), min_size=1, max_size=12)


def row_of(games: list[tuple[int, ...]]) -> dict[str, Any]:
    """The row of summary.csv of games that meet these criteria."""
    arm = {"arm": "naive_vs_speedy", "seed": 1, "ego_outcome": "goal", "ego_failed": 0}
    cells = [
        {**arm, "episode": k, "near_miss": max(each)} | {f"near_miss_{n}": m for n, m in zip(NAMES, each, strict=True)}
        for k, each in enumerate(games)
    ]
    (row,) = summarise(table_of("episodes", cells)).to_dict("records")
    return {str(name): value for name, value in row.items()}


def test_by_criterion__counts_the_games_that_meet_each() -> None:
    row = row_of([(1, 0, 0)] * 9 + [(0, 0, 1)] * 3 + [(0, 0, 0)] * 88)
    assert near_misses(row) == 12
    assert by_criterion([row]) == "9 by time to collision of at most 1.5 s, 3 by time headway of at most 0.5 s"
    both = row_of([(1, 1, 0), (0, 0, 0)])
    assert by_criterion([row, both]) == (
        "10 by time to collision of at most 1.5 s, 1 by post-encroachment time of at most 1 s, 3 by time headway of at "
        "most 0.5 s (a game can meet several)"
    )
    assert by_criterion([row_of([(0, 0, 0)])]) == f"none by {ANY_CRITERION}"


@given(met)
def test_by_criterion__counts_lie_between_the_near_misses_and_their_multiple(games: list[tuple[int, ...]]) -> None:
    row = row_of(games)
    counts = [row[f"near_misses_by_{name}"] for name in NAMES]
    assert near_misses(row) == sum(map(max, games))
    assert max(counts) <= near_misses(row) <= sum(counts) <= len(NAMES) * near_misses(row)
    assert ("several" in by_criterion([row])) == any(sum(each) > 1 for each in games)
