"""The script behind docs/baselines.md: its tables, of leagues that are small enough to count."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from tests.support.scripts import script

table = script("league/baselines.py")


@pytest.fixture
def leagues(tmp_path: Path) -> Path:
    """One ego, with and without a shield, on one road with two people; a third can't drive it."""
    pairings = [
        ("nobody", 10, 0.0, None, ""),
        ("anna", 10, 0.2, 0.1, ""),
        ("sumo", 30, 0.1, None, ""),
        ("bert", 10, 1.0, 0.5, "can't"),
    ]
    rows = [
        {
            **{"ego": "fast", "shield": shield, "scene": "bend", "person": person, "episodes": games, "reason": reason},
            **{"failure_rate": fails / (2 if shield else 1), "preventable_rate": preventable},
            **{
                "harm_to_others_rate": 0.0,
                "hard_brake_rate": 0.5,
                "mean_speed_mps": 10.0 if person == "nobody" else 8.0,
            },
        }
        for shield in ("", "rss")
        for person, games, fails, preventable, reason in pairings
    ]
    (tmp_path / "fast").mkdir()
    pd.DataFrame(rows).to_csv(tmp_path / "fast/league.csv", index=False)
    ranked = {"rank": [1, 1], "ego": ["fast"] * 2, "shield": ["rss", ""], "games": [1050] * 2}
    rates = {"failure_rate": [0.01, 0.02], "failure_rate_low": [0.0, 0.01], "failure_rate_high": [0.02, 0.03]}
    pd.DataFrame(ranked | rates).to_csv(tmp_path / "league_ranks.csv", index=False)
    return tmp_path


def test_ranks__are_those_of_the_table_with_means_over_games(leagues: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table.ranks(leagues)
    *_, shielded, plain = capsys.readouterr().out.splitlines()
    # of 50 games 10 are alone: (10 * 10 + 40 * 8) / 50 = 8.4 m/s; only the games with anna can be preventable
    assert shielded == "| 1 | fast + shield | 1,050 | 1.0% (0.0% to 2.0%) | 10.0% | 0.0% | 50.0% | 8.4 m/s |"
    assert plain == "| 1 | fast | 1,050 | 2.0% (1.0% to 3.0%) | 10.0% | 0.0% | 50.0% | 8.4 m/s |"


def test_scenes__failures_beside_others_and_alone(leagues: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table.scenes(leagues)
    heading, _, row = capsys.readouterr().out.splitlines()
    assert heading == "| scene | fast | fast + shield |"
    # (10 * 0.2 + 30 * 0.1) / 40 = 12.5 %; bert can't drive the scene, so its games say nothing
    assert row == "| `bend` | 12.5% (0.0%) | 6.2% (0.0%) |"
