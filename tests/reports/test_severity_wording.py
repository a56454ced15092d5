"""The severity of an ego's collisions in words."""

from __future__ import annotations

import math
from typing import Any

import pytest

from harness.evaluation.comparisons.summary import summarise
from harness.evaluation.tables import table_of
from harness.reports.numbers import NO_SPACE
from harness.reports.severity_wording import severity_clause


def row_of(delta_vs_mps: list[float], risk: tuple[float, float] = (0.0, 0.1)) -> dict[str, Any]:
    """The row of summary.csv of an arm with so many collisions, and a game without one."""
    game = {"arm": "naive_vs_speedy", "seed": 1, "error": ""}
    hit = {"ego_outcome": "collision", "ego_failed": 1, "mais3_risk_low": risk[0], "mais3_risk_high": risk[1]}
    games = [
        game | hit | {"episode": k, "ego_delta_v_mps": 0.5 * delta_v, "other_delta_v_mps": delta_v}
        for k, delta_v in enumerate(delta_vs_mps)
    ]
    games.append(game | {"episode": len(games), "ego_outcome": "goal", "ego_failed": 0})
    (row,) = summarise(table_of("episodes", games)).to_dict("records")
    return {str(name): value for name, value in row.items()}


RISK = "; the probability of a serious injury (MAIS3+) is"


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ([row_of([])], ""),
        ([row_of([2.9] * 12)], f"all 12 collisions of the naive ego have a delta-v below 3 m/s{RISK} at most 10 %"),
        ([row_of([1.0], (math.nan, math.nan))], "the only collision of the naive ego has a delta-v below 3 m/s"),
        (
            # seeds of 1 and 3 collisions: (1 + 3 * 5) / 4 m/s; bounds (0 + 3 * 0.1) / 4 and (0.1 + 3) / 4
            [row_of([1.0]), row_of([4.0, 5.0, 6.0], (0.1, 1.0))],
            "all 4 collisions of the naive ego: delta-v 4.0 m/s on average, at most 6.0 m/s"
            f"{RISK} 7.5 % to 77.5 % (bounds of the mean)",
        ),
    ],
)
def test_severity__of_the_collisions_of_an_arm(rows: list[dict[str, Any]], words: str) -> None:
    assert severity_clause("naive ego", rows).replace(NO_SPACE, " ") == words


def test_summary__has_the_severity_of_its_collisions() -> None:
    row = row_of([4.0, 6.0], (0.1, 1.0))
    columns = ("delta_v_mps", "max_delta_v_mps", "mais3_risk_low", "mais3_risk_high")
    assert [row[name] for name in columns] == [5.0, 6.0, 0.1, 1.0]
    assert all(math.isnan(row_of([])[name]) for name in columns)
