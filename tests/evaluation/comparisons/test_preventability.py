"""Counts of prevented failures, by hand."""

from __future__ import annotations

from typing import Any

import pandas as pd
import pytest
from scipy import stats

from harness.evaluation.columns import TABLES
from harness.evaluation.comparisons.preventability import (
    REGULATION,
    by_regulation,
    count_prevented,
    prevented_examples,
)
from harness.evaluation.tables import table_of, typed

ARM = {"arm": "naive_vs_speedy", "persona": "speedy", "seed": 1}


def episodes(failed: list[int]) -> pd.DataFrame:
    rows = [
        {**ARM, "episode": place, "ego_outcome": "collision" if bad else "goal", "ego_failed": bad, "error": ""}
        for place, bad in enumerate(failed)
    ]
    return table_of("episodes", rows)


def judged(episode: int, driver: str, conflict: int | None, start: int | None, **cells: Any) -> dict[str, Any]:
    """Nobody prevents anything if the other moves over."""
    verdicts = {"prevented_from_conflict": conflict, "prevented_from_start": start, "error": ""}
    verdicts["prevented_moving_over"] = None if conflict is None else 0
    return {**ARM, "episode": episode, "driver": driver, "ego_outcome": "collision", **verdicts, **cells}


GAMES = typed(
    pd.DataFrame(
        [
            judged(0, REGULATION, 1, 1),
            judged(0, "fuzzy", 0, 1, failed_s=4.0, preventable_until_s=3.5),
            judged(0, "rss", 1, 0),
            judged(0, "upper_bound", 1, 1),
            judged(1, REGULATION, 0, 0),
            judged(1, "fuzzy", 0, 0, failed_s=5.0, preventable_until_s=4.0),
            judged(1, "rss", 0, 0),
            judged(1, "upper_bound", 1, 0),
            judged(2, REGULATION, None, 1),
            judged(2, "fuzzy", None, 1),
            judged(2, "rss", None, 1),
            judged(2, "upper_bound", None, None, error="it broke"),
        ],
        columns=list(TABLES["reference_drivers"]),
    )
)


@pytest.fixture
def counts() -> dict[str, dict[str, Any]]:
    table = count_prevented(GAMES, episodes([1, 1, 1, 0, 0, 0, 0, 0, 0, 0]))
    assert list(typed(table).columns) == list(TABLES["preventability"])
    return {row["driver"]: row for row in table.to_dict("records")}


def test_count__each_driver_in_each_verdict(counts: dict[str, dict[str, Any]]) -> None:
    names = ("from_conflict_judged", "from_conflict_prevented", "from_start_judged", "from_start_prevented")
    assert {driver: [row[name] for name in names] for driver, row in counts.items()} == {
        REGULATION: [2, 1, 3, 2],
        "fuzzy": [2, 0, 3, 2],
        "rss": [2, 1, 3, 1],
        "upper_bound": [2, 2, 2, 1],
    }


def test_count__shares_are_of_failures_and_rates_of_games(counts: dict[str, dict[str, Any]]) -> None:
    both = counts["fuzzy"]
    assert (both["episodes"], both["failures"]) == (10, 3)
    assert both["from_start_share"] == pytest.approx(2 / 3)
    assert both["from_start_rate"] == pytest.approx(0.2)
    interval = stats.binomtest(2, 10).proportion_ci(0.95, method="exact")
    assert (both["from_start_rate_low"], both["from_start_rate_high"]) == pytest.approx((interval.low, interval.high))


def test_by_regulation__has_the_rows_of_its_driver_alone(counts: dict[str, dict[str, Any]]) -> None:
    table = pd.DataFrame(list(counts.values()))
    (row,) = by_regulation(table, "naive_vs_speedy")
    assert row["from_start_rate"] == pytest.approx(0.2)
    assert by_regulation(table, "retrained_vs_speedy") == []


def test_examples__are_of_the_driver_of_the_regulation_where_it_prevents_any() -> None:
    games = [(1, 4, "rss"), (1, 7, REGULATION), (1, 9, REGULATION), (2, 5, "fuzzy"), (2, 6, "rss")]
    cells = {"arm": "naive_vs_speedy", "player": "ego", "x_m": 0.0, "y_m": 0.0, "heading_rad": 0.0}
    rows = [
        {**cells, "seed": seed, "episode": episode, "driver": driver, "step": step}
        for seed, episode, driver in games
        for step in (8, 9)
    ]
    assert prevented_examples(table_of("takeovers", rows)) == {
        ("naive_vs_speedy", 1): (7, REGULATION),
        ("naive_vs_speedy", 2): (5, "fuzzy"),
    }
    assert prevented_examples(table_of("takeovers")) == {}
