"""The shipped policies still show what they are shipped to show: played through campaigns/merge-demo.toml."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from harness.campaign.preflight import open_campaign
from harness.drivers.policy_file import read_policy
from harness.evaluation.tables import read_csv
from tests.support.tiny import finished

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

EPISODES = 30
FAILED: dict[str, tuple[float, float]] = {  # arm -> least and greatest share of EPISODES games that the ego fails
    "naive_alone": (0.0, 0.0),
    "naive_vs_sumo": (0.0, 0.05),
    "naive_vs_speedy": (0.15, 0.45),
    "retrained_vs_speedy": (0.0, 0.05),
    "retrained_alone_speedy": (0.0, 0.0),
    "naive_vs_distracted": (0.05, 0.35),
    "retrained_vs_distracted": (0.0, 0.1),
    "retrained_alone_distracted": (0.0, 0.0),
}


@pytest.fixture(scope="module")
def demo(repository: Path) -> Path:
    """The run folder of the demonstration with fewer episodes; the rest of its document is as it is shipped."""
    campaigns = repository / "campaigns"
    document: dict[str, Any] = tomllib.loads((campaigns / "merge-demo.toml").read_text(encoding="utf-8"))
    for key in ("scene", "policies"):
        document[key] = os.path.normpath(campaigns / document[key])
    document["personas"] = [os.path.normpath(campaigns / each) for each in document["personas"]]
    document["assessment"] = {"episodes": EPISODES, "reference_drivers": False}
    del document["acceptance"]
    return finished(**{"training": None, **document})


@pytest.fixture(scope="module")
def failed(demo: Path) -> pd.Series:
    """Share of failures of each arm with an ego."""
    episodes = read_csv(demo / "episodes.csv")
    assert (episodes["error"] == "").all()
    assert set(episodes.groupby("arm").size()) == {EPISODES}
    return episodes.dropna(subset="ego_failed").groupby("arm")["ego_failed"].mean()


@pytest.mark.slow
def test_shipped_policies__fail_in_every_arm_about_as_often_as_they_did(failed: pd.Series) -> None:
    assert set(failed.index) == set(FAILED)
    beyond = {arm: share for arm, share in failed.items() if not FAILED[str(arm)][0] <= share <= FAILED[str(arm)][1]}
    assert beyond == {}


@pytest.mark.slow
@pytest.mark.parametrize("persona", ["speedy", "distracted"])
def test_shipped_policies__each_person_hurts_the_naive_ego_and_retraining_helps(
    persona: str, failed: pd.Series
) -> None:
    assert failed["naive_alone"] < failed[f"naive_vs_{persona}"]
    assert failed[f"retrained_vs_{persona}"] <= failed[f"naive_vs_{persona}"]


def test_demo__is_the_papers_campaign_but_for_its_trainings(repository: Path) -> None:
    demo, full = (open_campaign(repository / "campaigns" / f"{name}.toml") for name in ("merge-demo", "merge"))
    told = ("scene", "personas", "seeds", "ego", "assessment")
    assert [getattr(demo.document, each) for each in told] == [getattr(full.document, each) for each in told]
    assert demo.policies == repository / "policies" / "merge"


def test_five_seeds__are_the_papers_campaign_five_times(repository: Path) -> None:
    five, one = (open_campaign(repository / "campaigns" / f"{name}.toml").document for name in ("merge-seeds", "merge"))
    assert five.model_copy(update={"name": one.name, "seeds": one.seeds, "best_response": None}) == one
    assert five.seeds == [1, 2, 3, 4, 5]


def test_shipped_policies__each_has_its_model_card_and_was_trained_on_the_scene(repository: Path) -> None:
    for folder in sorted((repository / "policies" / "merge").iterdir()):
        assert {each.name for each in folder.iterdir()} == {"policy.json", "policy.safetensors", "README.md"}
        policy = read_policy(folder)
        assert (policy.card["stage"], policy.card["scene"]) == (folder.name, "merge")
        card = (folder / "README.md").read_text(encoding="utf-8")
        assert card.startswith(f"# {folder.name}\n")
        assert f"`{policy.card['persona']}`" in card
