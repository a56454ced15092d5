"""The severity of an ego's collisions in words."""

from __future__ import annotations

import math
from typing import Any

import pytest

from harness.evaluation.comparisons.summary import summarise
from harness.evaluation.tables import table_of
from harness.reports.numbers import NO_SPACE
from harness.reports.run_tables import RunTables
from harness.reports.severity_wording import severity_clause

Risk = tuple[float, float]
UNKNOWN: Risk = (math.nan, math.nan)


def games_of(delta_vs_mps: list[float], *risks: Risk, seed: int = 1) -> list[dict[str, Any]]:
    """The games of an arm: so many collisions, with these bounds of the risk or all with the least, and one without."""
    game = {"arm": "naive_vs_speedy", "seed": seed, "error": ""}
    hit = {"ego_outcome": "collision", "ego_failed": 1}
    known = risks or ((0.0, 0.1),) * len(delta_vs_mps)
    games = [
        game
        | hit
        | {"episode": k, "ego_delta_v_mps": 0.5 * delta_v, "other_delta_v_mps": delta_v}
        | {"mais3_risk_low": low, "mais3_risk_high": high}
        for k, (delta_v, (low, high)) in enumerate(zip(delta_vs_mps, known, strict=True))
    ]
    return [*games, game | {"episode": len(games), "ego_outcome": "goal", "ego_failed": 0}]


def tables_of(games: list[dict[str, Any]]) -> RunTables:
    episodes = table_of("episodes", games)
    return RunTables(manifest={}, episodes=episodes, summary=summarise(episodes))


RISK = "; the probability of a serious injury (MAIS3+) is"


@pytest.mark.parametrize(
    ("games", "words"),
    [
        (games_of([]), ""),
        (games_of([2.9] * 12), f"all 12 collisions of the naive ego have a delta-v below 3 m/s{RISK} at most 10 %"),
        (games_of([1.0], UNKNOWN), "the only collision of the naive ego has a delta-v below 3 m/s"),
        (
            # seeds of 1 and 3 collisions: (1 + 3 * 5) / 4 m/s; bounds (0 + 3 * 0.1) / 4 and (0.1 + 3) / 4
            games_of([1.0]) + games_of([4.0, 5.0, 6.0], *[(0.1, 1.0)] * 3, seed=2),
            "all 4 collisions of the naive ego: delta-v 4.0 m/s on average, at most 6.0 m/s"
            f"{RISK} 7.5 % to 77.5 % (bounds of the mean)",
        ),
        (
            # the risk is known in one collision of each seed: (1 + 0.1) / 2
            games_of([1.0] * 10, (0.0, 1.0), *[UNKNOWN] * 9) + games_of([1.0], seed=2),
            f"all 11 collisions of the naive ego have a delta-v below 3 m/s{RISK} at most 55 %",
        ),
    ],
)
def test_severity__of_the_collisions_of_an_arm(games: list[dict[str, Any]], words: str) -> None:
    assert severity_clause("naive ego", "naive_vs_speedy", tables_of(games)).replace(NO_SPACE, " ") == words


def test_summary__has_the_severity_of_its_collisions() -> None:
    (row,) = tables_of(games_of([4.0, 6.0], (0.1, 1.0), (0.1, 1.0))).summary.to_dict("records")
    columns = ("delta_v_mps", "max_delta_v_mps", "mais3_risk_low", "mais3_risk_high")
    assert [row[name] for name in columns] == [5.0, 6.0, 0.1, 1.0]
    assert tables_of(games_of([])).summary[[*columns]].isna().all(axis=None)
