"""The script behind the tables of egos that learn on all scenes, in docs/one-ego-for-all-scenes.md."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from harness.campaign.results.league_games import LEAGUE_GAMES
from harness.evaluation.tables import table_of, write_csv
from harness.files import make_folder
from tests.support.scripts import script

tables = script("robust/all_scenes.py")


PEOPLE_SEEDS = (51, 52, 53)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Ten games of each pairing. The naive ego fails six of them against each of three trainings of a person, the
    robust one only against the training that it has not met."""
    monkeypatch.setattr(tables, "SHIPPED", {("merge", each) for each in PEOPLE_SEEDS})
    for number, seed in enumerate(tables.SEEDS):
        for ego in ("naive", "robust"):
            rows = []
            for scene, person, of_person in (
                *(("merge", "speedy", each) for each in PEOPLE_SEEDS),
                *((scene, person, 21) for scene in ("merge", "zebra") for person in ("nobody", "sumo")),
            ):
                unmet = of_person == PEOPLE_SEEDS[number]
                failed = "0 1 2 3 4 5" if person == "speedy" and (ego == "naive" or unmet) else ""
                row = {"ego": f"{ego}-seed{seed}", "shield": "", "scene": scene, "person": person, "seed": of_person}
                row |= {"episodes": 10, "failed_episodes": failed, "unplayed_episodes": ""}
                rows.append(row | {"games_sha256": f"{scene} {person} {of_person}"})
            make_folder(tmp_path / f"{ego}-seed{seed}")
            write_csv(table_of("league_games", rows), tmp_path / f"{ego}-seed{seed}" / LEAGUE_GAMES)
    return tmp_path


def test_seeds__tell_people_that_were_met_from_others(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """12 games differ, all in one direction: p = 2 / 2**12."""
    tables.seeds(folder)
    lines = capsys.readouterr().out.splitlines()
    assert "| alone | robust | 0 of 10 | 0 of 10 | 0 of 10 |" in lines
    assert "| people that the robust ego has met | naive | 12 of 20 | 12 of 20 | 12 of 20 |" in lines
    assert "| people that the robust ego has met | robust | 0 of 20 | 0 of 20 | 0 of 20 |" in lines
    assert "| other people of these scenes | robust | 6 of 10 | 6 of 10 | 6 of 10 |" in lines
    assert "| all games of the other scenes | naive | 0 of 20 | 0 of 20 | 0 of 20 |" in lines
    assert lines[-1] == "| people of these scenes, both egos | p (McNemar) | 0.00049 | 0.00049 | 0.00049 |"


def test_seeds__kinds_of_games_that_no_ego_played_have_no_row(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """People who learned after the egos are all other people."""
    monkeypatch.setattr(tables, "SHIPPED", {("merge", 1)})
    tables.seeds(folder)
    output = capsys.readouterr().out
    assert "has met" not in output
    assert "| other people of these scenes | naive | 18 of 30 | 18 of 30 | 18 of 30 |" in output


def test_met__a_person_of_one_training_is_always_met(folder: Path) -> None:
    games = pd.DataFrame({"scene": "merge", "person": "speedy", "seed": [51, 51]})
    assert tables.met(games, 0).all()


def test_scenes__count_the_failures_of_all_trainings(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tables.scenes(folder)
    assert capsys.readouterr().out.splitlines()[2:] == [
        "| `merge` | yes | 54 of 150 | 18 of 150 |",
        "| `zebra` | no | 0 of 60 | 0 of 60 |",
    ]
