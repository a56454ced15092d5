"""The games of a league in its table, from which egos are ranked."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from harness.campaign.results.league_egos import rank_leagues
from harness.campaign.results.league_games import LEAGUE_GAMES, games_in, outcome_cells
from harness.errors import UsageError
from harness.evaluation.tables import table_of, write_csv
from harness.files import make_folder

ROW = {"shield": "", "scene": "merge", "person": "speedy", "seed": 51, "episodes": 4, "games_sha256": "a1"}


def write_league(folder: Path, ego: str, failed: str, unplayed: str = "") -> None:
    row = {**ROW, "ego": ego, "failed_episodes": failed, "unplayed_episodes": unplayed}
    make_folder(folder / ego)
    write_csv(table_of("league_games", [row]), folder / ego / LEAGUE_GAMES)


def test_games__are_those_that_were_played() -> None:
    games = pd.DataFrame({"episode": [0, 1, 2, 3], "error": ["", "", "SUMO ended", ""], "ego_failed": [1, 0, None, 1]})
    cells = outcome_cells(games)
    assert cells == {"failed_episodes": "0 3", "unplayed_episodes": "2"}
    found = games_in(table_of("league_games", [{**ROW, "ego": "a", **cells}]))
    assert found[["episode", "ego_failed"]].to_numpy().tolist() == [[0, 1], [1, 0], [3, 1]]
    assert set(found["games_sha256"]) == {"a1"}


def test_rank_leagues__needs_their_tables_alone(tmp_path: Path) -> None:
    write_league(tmp_path, "a", "0 1 3")
    write_league(tmp_path, "b", "0", unplayed="3")
    ranks, file = rank_leagues(tmp_path)
    assert file == tmp_path / "league_ranks.csv"
    assert ranks["ego"].tolist() == ["b", "a"]
    assert ranks["games"].tolist() == [3, 3]
    assert ranks["failure_rate"].tolist() == [1 / 3, 2 / 3]


def test_rank_leagues__another_table_is_refused(tmp_path: Path) -> None:
    write_league(tmp_path, "a", "0")
    write_league(tmp_path, "b", "0")
    ranks, _ = rank_leagues(tmp_path)
    write_csv(ranks, tmp_path / "b" / LEAGUE_GAMES)
    with pytest.raises(UsageError, match="is not the table of a league"):
        rank_leagues(tmp_path)


def test_rank_leagues__the_same_games_of_one_ego_in_two_folders_are_refused(tmp_path: Path) -> None:
    write_league(tmp_path, "a", "0 1 3")
    write_league(tmp_path, "b", "0")
    (tmp_path / "b").rename(tmp_path / "c")
    write_league(tmp_path, "b", "0")
    with pytest.raises(UsageError, match="b and c have the same games of an ego 'b'"):
        rank_leagues(tmp_path)


def test_rank_leagues__numbers_of_games_that_are_none_are_refused(tmp_path: Path) -> None:
    write_league(tmp_path, "a", "0")
    write_league(tmp_path, "b", "first")
    with pytest.raises(UsageError, match="is not the table of a league"):
        rank_leagues(tmp_path)
