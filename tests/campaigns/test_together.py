"""A campaign whose personas learn together, by the real command."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd
import pytest

from harness.drivers.policy_file import read_policy
from tests.support.tiny import SPEEDY, TEXTING, finished, harness, numbers

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
    assert not (run / "policies" / "people-seed1" / "README.md").exists()
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
def test_campaign__again_changes_nothing() -> None:
    run = _run()
    before = numbers(run)
    again = harness("campaign", run.with_suffix(".toml"), "--out", run)
    assert again.returncode == 0, again.stdout
    assert numbers(run) == before
