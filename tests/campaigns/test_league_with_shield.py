"""A tiny league whose ego plays with and without a shield, by the command."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from harness.cli.app import app
from harness.errors import UsageError
from harness.evaluation.tables import read_csv

PEOPLE = {"nobody", "sumo", "paper_distracted", "paper_speedy"}


@pytest.fixture(scope="module")
def league(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("leagues") / "adas"
    options = ("--scenes", "paper_merge", "--episodes", "3", "--jobs", "1", "--out", str(folder))
    done = CliRunner().invoke(app, ["league", "--ego", "adas", "--shield", "rss", *options])
    assert done.exit_code == 0, done.output
    return folder


def test_rows__of_both_egos_meet_the_same_people(league: Path) -> None:
    table = read_csv(league / "league.csv")
    assert set(table["ego"]) == {"adas"}
    assert {shield: set(rows["person"]) for shield, rows in table.groupby("shield")} == {"": PEOPLE, "rss": PEOPLE}
    assert set(table["arm"][table["shield"] == "rss"]) == {
        f"shielded_{arm}" for arm in table["arm"][table["shield"] == ""]
    }
    page = (league / "league.html").read_text(encoding="utf-8")
    assert page.count('<th scope="row">paper_merge with shield rss</th>') == 1
    junit = (league / "junit.xml").read_text(encoding="utf-8")
    assert 'name="nobody, seed 11 with shield rss"' in junit
    assert "adas with shield rss fails in" in junit


def test_table__has_the_ego_with_and_without_its_shield(league: Path) -> None:
    """One league is enough for a table where it has a shield."""
    done = CliRunner().invoke(app, ["league-table", str(league.parent)])
    assert done.exit_code == 0, done.output
    ranks = read_csv(league.parent / "league_ranks.csv")
    assert ranks["ego"].tolist() == ["adas", "adas"]
    assert set(ranks["shield"]) == {"", "rss"}
    assert set(ranks["games"]) == {3 * len(PEOPLE)}


def test_shield__around_an_ego_that_sumo_drives_is_refused(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["league", "--ego", "sumo", "--shield", "rss", "--out", str(tmp_path)])
    assert isinstance(done.exception, UsageError)
    assert str(done.exception).startswith("--shield: SUMO drives this ego")
