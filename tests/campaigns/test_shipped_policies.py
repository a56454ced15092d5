"""The shipped policies still show what they are shipped to show: played through campaigns/demo.toml."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from harness.campaign.preflight import open_campaign
from harness.config.toml_reading import tomllib
from harness.drivers.policy_file import read_policy
from harness.evaluation.tables import read_csv
from tests.support import shipped
from tests.support.shipped import CAMPAIGN, CAMPAIGNS, DEMO, DISTRACTED, PERSONAS, POLICIES, SPEEDY
from tests.support.tiny import finished

EPISODES = 30
FAILED: dict[str, tuple[float, float]] = {  # arm -> least and greatest share of EPISODES games that the ego fails
    "naive_alone": (0.0, 0.0),
    "naive_vs_sumo": (0.0, 0.05),
    f"naive_vs_{SPEEDY}": (0.03, 0.3),
    f"retrained_vs_{SPEEDY}": (0.0, 0.05),
    f"retrained_alone_{SPEEDY}": (0.0, 0.0),
    f"naive_vs_{DISTRACTED}": (0.03, 0.3),
    f"retrained_vs_{DISTRACTED}": (0.0, 0.15),
    f"retrained_alone_{DISTRACTED}": (0.0, 0.0),
}


@pytest.fixture(scope="module")
def demo() -> Path:
    """The run folder of the demonstration with fewer episodes; the rest of its document is as it is shipped."""
    document: dict[str, Any] = tomllib.loads(DEMO.read_text(encoding="utf-8"))
    for key in ("scene", "policies"):
        document[key] = os.path.normpath(CAMPAIGNS / document[key])
    document["personas"] = [os.path.normpath(CAMPAIGNS / each) for each in document["personas"]]
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
@pytest.mark.parametrize("persona", PERSONAS)
def test_shipped_policies__each_person_hurts_the_naive_ego_and_retraining_helps(
    persona: str, failed: pd.Series
) -> None:
    assert failed["naive_alone"] < failed[f"naive_vs_{persona}"]
    assert failed[f"retrained_vs_{persona}"] <= failed[f"naive_vs_{persona}"]


def test_demo__is_the_papers_campaign_but_for_its_trainings() -> None:
    demo, full = map(open_campaign, (DEMO, CAMPAIGN))
    told = ("scene", "personas", "seeds", "ego", "assessment")
    assert [getattr(demo.document, each) for each in told] == [getattr(full.document, each) for each in told]
    assert demo.policies == POLICIES


def test_ten_seeds__are_the_papers_campaign_ten_times(repository: Path) -> None:
    reproduction = repository / "docs" / "reproduction"
    ten, one = (open_campaign(each) for each in (reproduction / "ten-seeds.toml", CAMPAIGN))
    as_one = {"name": one.document.name, "seeds": one.document.seeds, "acceptance": one.document.acceptance}
    as_one |= {key: getattr(one.document, key) for key in ("scene", "personas")}  # other paths of the same documents
    assert ten.document.model_copy(update=as_one) == one.document
    assert (ten.scene.folder, ten.personas) == (one.scene.folder, one.personas)


def test_merge_seeds__are_the_merge_ten_times() -> None:
    ten, one = (open_campaign(CAMPAIGNS / f"{name}.toml").document for name in ("merge-seeds", "merge"))
    assert ten.model_copy(update={"name": one.name, "seeds": one.seeds, "best_response": None}) == one
    assert len(set(ten.seeds)) == 10
    assert {*one.seeds} < {*ten.seeds}


def test_shipped_policies__each_has_its_model_card_and_was_trained_on_the_scene() -> None:
    folders = sorted(POLICIES.iterdir())
    assert {each.name for each in folders} == shipped.ALL
    for folder in folders:
        assert {each.name for each in folder.iterdir()} == {"policy.json", "policy.safetensors", "README.md"}
        policy = read_policy(folder)
        assert (policy.card["stage"], policy.card["scene"]) == (folder.name, shipped.FOLDER)
        card = (folder / "README.md").read_text(encoding="utf-8")
        assert card.startswith(f"# {folder.name}\n")
        assert f"`{policy.card['persona']}`" in card
