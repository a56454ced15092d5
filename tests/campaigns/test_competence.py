"""A campaign whose trainings are far too short: it says so everywhere, and draws no conclusion."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from harness.evaluation.competence import DID_NOT_LEARN, WITHHELD
from harness.evaluation.tables import read_csv
from tests.support.shared import built_once
from tests.support.tiny import carried_out, learned_run, write_campaign

pytestmark = pytest.mark.slow

LABEL = "not answered: the person can't drive this scene"


@pytest.fixture(scope="session")
def run() -> Path:
    """A finished campaign judged by the default bounds: they are no input of a training or an arm, and nothing is
    played again but the person's games alone, which are removed."""

    def build(folder: Path) -> None:
        campaign = write_campaign(folder, name="learned", competence=None)  # the table is left out: its defaults hold
        run = shutil.copytree(learned_run(), folder / "learned")
        shutil.rmtree(run / ".stages" / "speedy_alone-seed1")
        (folder / "printed").write_text(carried_out(campaign, run), encoding="utf-8")

    return built_once("unlearned", build) / "learned"


def test_terminal__names_each_training_that_did_not_learn_and_answers_no_question(run: Path) -> None:
    printed = (run.parent / "printed").read_text(encoding="utf-8")
    started = [line.split()[1] for line in printed.splitlines() if line.startswith("started")]
    assert started == ["speedy_alone-seed1"]
    text = " ".join(printed.split())
    assert "did not learn: speedy-seed1: alone it reaches its goal in" in text  # as soon as its arm was played
    assert "Did not learn: speedy-seed1: alone it reaches its goal in" in text  # and at the end
    assert "To try: Double the budget of the trainings" in text
    for question in ("RQ1", "RQ2"):
        assert f"speedy, {question}: {LABEL}" in text
    assert [word for word in ("converged", "significant", "p = ") if word in text] == []


def test_comparisons__have_a_reason_and_no_test(run: Path) -> None:
    table = read_csv(run / "comparisons.csv")
    assert table["question"].tolist() == ["RQ1"] * 2 + ["RQ2"] * 5
    assert set(table["verdict"]) <= {verdict.value for verdict in WITHHELD}
    assert table[["p_value", "p_holm"]].isna().all(axis=None)
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


def test_command__again_says_the_same_and_lower_bounds_play_nothing_and_answer(run: Path, tmp_path: Path) -> None:
    again = shutil.copytree(run, tmp_path / "learned")
    before = (again / "manifest.json").read_bytes()
    text = " ".join(carried_out(run.with_suffix(".toml"), again).split())
    assert text.startswith("Nothing to do")
    assert "Did not learn: speedy-seed1: alone it reaches its goal in" in text
    assert f"speedy, RQ1: {LABEL}" in text
    assert (again / "manifest.json").read_bytes() == before

    text = carried_out(learned_run().with_suffix(".toml"), again)
    assert [word for word in ("started", "not answered", "not learn") if word in text] == []
    stages = json.loads((again / "manifest.json").read_text(encoding="utf-8"))["stages"]
    assert stages["speedy-seed1"]["stopped"] == "budget"
