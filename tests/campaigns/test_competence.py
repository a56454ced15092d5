"""A campaign whose trainings are far too short: it says so everywhere, and draws no conclusion."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from harness.evaluation.competence import DID_NOT_LEARN
from harness.evaluation.research_questions import INCOMPETENT
from harness.evaluation.tables import read_csv
from tests.support.pages import Page
from tests.support.tiny import finished, harness

pytestmark = pytest.mark.slow

LABEL = "not answered: the person can't drive this scene"


@pytest.fixture(scope="session")
def run() -> Path:
    return finished(name="unlearned", competence=None)  # the table is left out: its defaults hold


def printed(run: Path) -> str:
    """What the command printed, without its line breaks."""
    return " ".join((run.parent / "printed").read_text(encoding="utf-8").split())


def test_terminal__names_each_training_that_did_not_learn(run: Path) -> None:
    text = printed(run)
    assert "did not learn: speedy-seed1: alone it reaches its goal in" in text  # as soon as its arm was played
    assert "Did not learn: speedy-seed1: alone it reaches its goal in" in text  # and at the end
    assert "converged" not in text


def test_terminal__no_question_is_answered(run: Path) -> None:
    text = printed(run)
    for question in ("RQ1", "RQ2"):
        assert f"speedy, {question}: {LABEL}" in text
    assert "significant" not in text
    assert "p = " not in text


def test_comparisons__have_a_reason_and_no_test(run: Path) -> None:
    table = read_csv(run / "comparisons.csv")
    assert len(table) == 4
    assert set(table["verdict"]) <= {verdict.value for verdict in INCOMPETENT}
    assert table["p_value"].isna().all()
    assert table["p_holm"].isna().all()
    assert not table["rejects_h0"].any()
    assert table["reason"].str.contains("below 80 %", regex=False).all()


def test_manifest__and_curves_end_with_the_judgement(run: Path) -> None:
    stages = json.loads((run / "manifest.json").read_text(encoding="utf-8"))["stages"]
    curves = read_csv(run / "training.csv").groupby("stage")["stopped"].last()
    trainings = {name: entry for name, entry in stages.items() if entry["kind"] == "training"}
    for name, entry in trainings.items():
        learned = entry["goals"] / entry["played"] >= entry["goal_share_asked"]
        assert (entry["stopped"] == DID_NOT_LEARN) == (not learned)
        assert curves[entry["name"]] == entry["stopped"]
        card = (run / "policies" / name / "README.md").read_text(encoding="utf-8")
        assert ("**It did not learn" in card) == (not learned)
    assert trainings["speedy-seed1"]["goal_share_asked"] == 0.8
    assert trainings["naive-seed1"]["goal_share_asked"] == 0.97


def test_report__says_it_on_its_first_lines_and_on_each_card(run: Path) -> None:
    page = Page((run / "report.html").read_text(encoding="utf-8"))
    assert "did not learn to drive this scene." in page.text.partition("Watch")[0]  # before the links to the sections
    assert f"RQ1: {LABEL}" in page.text
    assert f"RQ2: {LABEL}" in page.text
    assert "early: converged" not in page.text


def test_command__again_has_nothing_to_do_and_says_the_same(run: Path, tmp_path: Path) -> None:
    again = shutil.copytree(run, tmp_path / "again")
    before = (again / "manifest.json").read_bytes()
    command = harness("campaign", run.with_suffix(".toml"), "--out", again, "--jobs", 1)
    assert command.returncode == 0, command.stdout + command.stderr
    text = " ".join(command.stdout.split())
    assert text.startswith("Nothing to do")
    assert "Did not learn: speedy-seed1: alone it reaches its goal in" in text
    assert f"speedy, RQ1: {LABEL}" in text
    assert (again / "manifest.json").read_bytes() == before


def test_command__lower_bounds_play_nothing_again_and_answer(run: Path, tmp_path: Path) -> None:
    """The bounds judge what was played: they are no input of a training or an arm."""
    shutil.copytree(run.parent, tmp_path / "again")
    again = tmp_path / "again" / run.name
    document = again.with_suffix(".toml")
    bounds = "[competence]\nego_goal_share = 0.0\nnon_ego_goal_share = 0.0\n"
    document.write_text(document.read_text(encoding="utf-8") + bounds, encoding="utf-8")
    command = harness("campaign", document, "--out", again, "--jobs", 1)
    assert command.returncode == 0, command.stdout + command.stderr
    assert "started" not in command.stdout
    assert "not answered" not in command.stdout
    assert "learn" not in command.stdout.replace("unlearned", "")
    stages = json.loads((again / "manifest.json").read_text(encoding="utf-8"))["stages"]
    assert stages["speedy-seed1"]["stopped"] == "budget"
