"""The second computation of what is published: it agrees, and it finds a cell that is not what the games say."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pandas as pd
import pytest

from harness.evaluation.tables import read_csv
from tests.support.repository import REPOSITORY
from tests.support.scripts import script

recompute = script("publish/recompute.py")
REPORTS = REPOSITORY / "reports"
JUNCTION = REPORTS / "priority_crossing"  # its first question has a clear answer in each training


@pytest.mark.parametrize("run", sorted(each.parent.name for each in REPORTS.glob("*/summary.csv")))
def test_published_tables__are_those_of_their_games(run: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert recompute.main([REPORTS / run]) == 0, capsys.readouterr().out


@pytest.mark.parametrize(
    ("table", "column", "where"),
    [
        ("summary", "failure_rate_high", "summary, naive_alone, seed {seed}, failure_rate_high"),
        ("comparisons", "p_holm", "comparisons, RQ1 impatient, seed {seed}, failure, p_holm"),
        ("attribution", "without_difference", "attribution, impatient all, seed {seed}, without_difference"),
    ],
)
def test_cell__that_the_games_do_not_give_is_found(
    table: str, column: str, where: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = shutil.copytree(
        JUNCTION, tmp_path / "junction", ignore=shutil.ignore_patterns("traces", "replays", "policies")
    )
    cells = pd.read_csv(run / f"{table}.csv")
    cells.loc[0, column] += 0.001
    cells.to_csv(run / f"{table}.csv", index=False)
    assert recompute.main([run]) == 1
    assert f"  {where.format(seed=cells['seed'][0])}: published " in capsys.readouterr().out


def test_runs__default_to_all_published_ones_and_must_have_games(capsys: pytest.CaptureFixture[str]) -> None:
    assert JUNCTION in recompute.runs_named([])
    with pytest.raises(SystemExit) as ended:
        recompute.runs_named([str(REPORTS / "nothing")])
    assert ended.value.code == 2
    assert "has no summary.csv, or no episodes.csv" in capsys.readouterr().err


def test_reports__the_list_of_published_runs_has_their_games() -> None:
    listed = re.findall(r"^\| \[[\w-]+\]\(([\w-]+)\) \| ([\d,]+) \|", (REPORTS / "README.md").read_text("utf-8"), re.M)
    games = {run: int(count.replace(",", "")) for run, count in listed}
    played = {
        run: len(read_csv(REPORTS / run / "episodes.csv")) for run in games if (REPORTS / run / "summary.csv").exists()
    }
    played["league"] = sum(read_csv(file)["episodes"].sum() for file in REPORTS.glob("league/*/league.csv"))
    assert len(played) > 20
    assert {run: games[run] for run in played} == played
