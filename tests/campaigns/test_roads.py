"""A campaign whose ego learns on other roads too, by the real command."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.drivers.mixture import mixture_of
from harness.drivers.sumo import SumoDriver
from harness.game.roles import EGO, NON_EGO
from harness.road.scene.open_scene import open_scene
from harness.training.training_games import LearningPlace, open_games
from tests.support.rollouts import Steady
from tests.support.tiny import CAREFUL, PAPER_MERGE, TRAINING, finished
from tests.support.trainings import naive_ego

NAMES = ("naive", "speedy", "retrained_speedy")
MERGE = PAPER_MERGE.parent / "merge"


@pytest.mark.slow
def test_campaign__its_egos_learn_on_other_roads_and_its_people_do_not() -> None:
    run = finished(name="roads", roads=[str(MERGE)], assessment={"episodes": 2})
    cards = {name: json.loads((run / "policies" / f"{name}-seed1" / "policy.json").read_text()) for name in NAMES}
    assert {name: card.get("roads") for name, card in cards.items()} == {
        "naive": ["merge"],
        "speedy": None,
        "retrained_speedy": ["merge"],
    }
    assert (
        "| and in equal parts on the roads | `merge` |" in (run / "policies" / "naive-seed1" / "README.md").read_text()
    )
    hashes = json.loads((run / "manifest.json").read_text())["hashes"]
    assert "merge.net.xml" in {Path(each).name for each in hashes}


@pytest.mark.slow
def test_campaign__its_robust_ego_meets_the_shipped_people_of_each_road(tmp_path: Path) -> None:
    """A road without shipped people, as a copy of a scene, has SUMO's driver alone."""
    against = {"retraining": {"against": ["sumo", "shipped"]}, "personas": []}
    shutil.copytree(MERGE.parent / "brake", copy := tmp_path / "copy")
    run = finished(name="shipped", roads=[str(MERGE), str(copy)], assessment={"episodes": 2}, **against)
    card = json.loads((run / "policies" / "robust-seed1" / "policy.json").read_text())
    assert card["roads"] == ["merge", "brake"]
    assert card["against"] == "one in each game of sumo, the shipped people of the scene"
    assert card["training"]["steps"] == 2 * TRAINING["steps"]
    text = (run / "policies" / "robust-seed1" / "README.md").read_text()
    assert "The ego, retrained against several drivers, one of them in each game." in text
    hashes = json.loads((run / "manifest.json").read_text())["hashes"]
    assert any(each.endswith("policies/paper_merge/paper_speedy-seed11/policy.safetensors") for each in hashes)


def test_games__beside_sumos_driver_too__are_in_parts_by_share_and_only_sumos_driver_is_left_to_sumo() -> None:
    spec, persona = naive_ego(open_scene(PAPER_MERGE)), read_document(CAREFUL, Persona)
    beside = ((Steady(), 3.0), (SumoDriver(), 1.0))
    places = [replace(spec.places[0], drivers=(None, mixture_of(each, persona)), share=share) for each, share in beside]
    environment = open_games(replace(spec, places=tuple(places), alone_share=0.0))
    try:
        environment.reset()
        arenas = [each.arena for each in environment.environments]
        assert [arena.state.present.all(1).sum() for arena in arenas] == [6, 2]
        before = [arena.state.speed_mps[:, NON_EGO].copy() for arena in arenas]
        for _ in range(3):
            environment.step(np.zeros((8, 2), dtype=np.float32))
        gained_mps = [arena.state.speed_mps[:, NON_EGO] - was for arena, was in zip(arenas, before, strict=True)]
        assert (gained_mps[0] == 0.0).all()
        assert (gained_mps[1] != 0.0).all()
    finally:
        environment.close()


def test_games__of_a_training_are_in_equal_parts_on_its_roads() -> None:
    spec = naive_ego(open_scene(PAPER_MERGE))
    other = LearningPlace(scene=open_scene(MERGE), player=EGO, drivers=(None, None))
    environment = open_games(replace(spec, places=(*spec.places, other)))
    try:
        observed = environment.reset()
        games = {each.arena.scene.document.name: each.num_envs for each in environment.environments}
        assert games == {"paper_merge": 4, "merge": 4}
        assert len(observed) == 8
    finally:
        environment.close()
