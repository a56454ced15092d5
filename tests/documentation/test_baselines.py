"""The script behind docs/baselines.md: its tables, of leagues that are small enough to count."""

from __future__ import annotations

import json
import shutil
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


def test_play__of_some_scenes_replaces_their_rows_and_keeps_all_others(tmp_path: Path) -> None:
    """First the published league of a scene by itself, then one in which the ego fails every game of it."""
    published, league, part = REPOSITORY / "reports" / "league" / "adas", tmp_path / "adas", tmp_path / "part"
    shutil.copytree(published, league)
    part.mkdir()
    record = json.loads((published / "result.json").read_bytes())
    for name in ("league", "league_games"):
        rows = read_csv(published / f"{name}.csv")
        write_csv(rows[rows["scene"] == "cut_in"], part / f"{name}.csv")
    (part / "result.json").write_text(json.dumps(record | {"rows": []}))
    table.replace_scenes(league, part)
    for name in ("league.csv", "league_games.csv", "result.json"):
        assert (league / name).read_bytes() == (published / name).read_bytes()

    worse = read_csv(part / "league.csv")
    worse["failure_rate"] = 1.0
    write_csv(worse, part / "league.csv")
    table.replace_scenes(league, part)
    rows = read_csv(league / "league.csv")
    assert set(rows["failure_rate"][rows["scene"] == "cut_in"]) == {1.0}
    assert rows["failure_rate"].is_monotonic_decreasing
    assert len(rows) == len(record["rows"])
    assert [each["scene"] for each in json.loads((league / "result.json").read_bytes())["rows"]] == list(rows["scene"])


def test_play__a_league_with_games_that_could_not_be_played_replaces_nothing(tmp_path: Path) -> None:
    (tmp_path / "result.json").write_text(json.dumps({"failed": ["cut_in: 3 games could not be played"]}))
    with pytest.raises(SystemExit, match="3 games could not be played"):
        table.replace_scenes(tmp_path, tmp_path)
