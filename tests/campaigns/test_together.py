"""A campaign whose personas learn together, by the real command."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import pandas as pd
import pytest

from harness.drivers.policy_file import read_policy
from tests.support.tiny import CAREFUL, SPEEDY, TEXTING, finished, harness, numbers, write_campaign

PERSONAS = ("speedy", "texting")


def _run() -> Path:
    return finished(
        name="together",
        personas=[str(SPEEDY), str(TEXTING)],
        non_ego_training={"together": True},
        retraining={"against": list(PERSONAS)},
        rounds={"count": 1},
    )


@pytest.mark.slow
def test_campaign__each_persona_has_a_policy_and_a_card_of_its_own() -> None:
    run = _run()
    manifest = json.loads((run / "manifest.json").read_text())
    for name in PERSONAS:
        folder = run / "policies" / f"{name}-seed1"
        policy = read_policy(folder)
        assert policy.card["persona"] == name
        assert policy.card["learned_with"] == list(PERSONAS)
        assert f"| persona | `{name}` |" in (folder / "README.md").read_text()
        assert manifest["stages"][f"{name}-seed1"]["steps"] == manifest["stages"]["people-seed1"]["steps"]
    assert (read_policy(run / "policies" / "speedy-seed1").layers("actor")[0][1] != policy.layers("actor")[0][1]).any()
    card = (run / "policies" / "people-seed1" / "README.md").read_text()
    assert [line.split("|")[1].strip() for line in card.splitlines() if line.startswith("| `")] == [
        f"`{name}`" for name in PERSONAS
    ]
    assert set(pd.read_csv(run / "training.csv")["stage"]) == {"naive", "people", "robust"}


@pytest.mark.slow
def test_campaign__its_page_asks_whether_the_robust_ego_is_better() -> None:
    run = _run()
    comparisons = pd.read_csv(run / "comparisons.csv")
    asked = comparisons[comparisons["question"] == "RQ2"]
    assert dict.fromkeys(asked["persona"]) == dict.fromkeys(PERSONAS)
    page = (run / "report.html").read_text()
    assert "robust ego" in page
    assert "the robust ego fails in" in page
    assert "the retrained ego" not in page


@pytest.mark.slow
def test_campaign__with_the_policy_of_all_plays_the_same_games(tmp_path: Path) -> None:
    run = _run()
    policies = tmp_path / "policies"
    shutil.copytree(run / "policies" / "people-seed1", policies / "people-seed1")
    shutil.copytree(run / "policies" / "naive-seed1", policies / "naive-seed1")
    again = _read(tmp_path, policies, [str(SPEEDY), str(TEXTING)])
    assert again.returncode == 0, again.stdout
    tables = [pd.read_csv(each / "episodes.csv") for each in (run, tmp_path / "run")]
    own, read = (each[each["arm"].isin(["naive_vs_speedy", "texting_alone"])] for each in tables)
    assert len(own) == 8
    pd.testing.assert_frame_equal(own.reset_index(drop=True), read.reset_index(drop=True))


@pytest.mark.slow
def test_campaign__a_person_who_is_not_in_the_policy_of_all_or_has_changed_is_refused(tmp_path: Path) -> None:
    run, changed = _run(), tmp_path / "speedy.toml"
    changed.write_text(SPEEDY.read_text().replace("time_pressure = 0.8", "time_pressure = 0.9"))
    printed = _read(tmp_path, run / "policies", [str(changed), str(CAREFUL)], "check").stderr
    assert "is no policy of 'careful'" in printed
    assert "was learned by 'speedy' with another payoff or limits" in printed


def _read(folder: Path, policies: Path, personas: list[str], command: str = "campaign") -> CompletedProcess[str]:
    """A campaign that reads the policy of all personas."""
    read: dict[str, Any] = {"policies": str(policies), "training": None}
    together = {"non_ego_training": {"together": True}, "retraining": None, "rounds": {"count": 1}}
    campaign = write_campaign(folder, name="read", personas=personas, **read, **together)
    return harness(command, campaign, *(["--out", folder / "run"] if command == "campaign" else []))


@pytest.mark.slow
def test_campaign__again_changes_nothing() -> None:
    run = _run()
    before = numbers(run)
    again = harness("campaign", run.with_suffix(".toml"), "--out", run)
    assert again.returncode == 0, again.stdout
    assert numbers(run) == before
