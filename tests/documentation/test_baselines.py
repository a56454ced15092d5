"""The script behind docs/baselines.md: its tables, of leagues that are small enough to count."""

from __future__ import annotations

from pathlib import Path

import pytest

from harness.evaluation.tables import read_csv, table_of, write_csv
from tests.support.repository import REPOSITORY
from tests.support.scripts import script

table = script("league/baselines.py")

ROW = read_csv(REPOSITORY / "reports" / "roads" / "merge-learned-on-one-road" / "league.csv").to_dict("records")[0]
"""A row of a league: what the tables do not show stays as it is."""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Each ego plays 20 games in each of two scenes, SUMO's driver without a shield."""
    for place, ego in enumerate(table.RULES):
        rows = [
            {**ROW, "ego": ego, "shield": shield, "scene": scene, "episodes": 20, "failure_rate": rate}
            for scene, rate in (("brake", 0.05 * place), ("zebra", 0.1))
            for shield in (("",) if ego == "sumo" else ("", "rss"))
        ]
        (tmp_path / ego).mkdir()
        write_csv(table_of("league", rows), tmp_path / ego / "league.csv")
    cells = {"rank": 1, "games": 40, "games_left_out": 0, "failure_rate": 0.05, "told_apart": "rss + fuzzy"}
    cells |= {"failure_rate_low": 0.006, "failure_rate_high": 0.169}
    ranks = [{"ego": "adas", "shield": shield, **cells} for shield in ("", "rss")]
    write_csv(table_of("league_ranks", ranks), tmp_path / "league_ranks.csv")
    return tmp_path


def test_table__a_row_for_each_ego_with_and_without_its_shield(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table.table(folder)
    *_, without, shielded = capsys.readouterr().out.splitlines()
    assert without == "| 1 | adas | 40 | 5.0% | 0.6% to 16.9% | rss, fuzzy |"
    assert shielded.startswith("| 1 | adas with shield rss |")


def test_scenes__count_the_failures_of_each_ego(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table.scenes(folder)
    header, _, brake, zebra = capsys.readouterr().out.splitlines()
    assert header.startswith("| scene | sumo | adas | adas with shield rss |")
    assert brake.startswith("| `brake` | 0 of 20 | 1 of 20 | 1 of 20 | 2 of 20 |")
    assert zebra.count("2 of 20") == 2 * len(table.RULES) - 1
