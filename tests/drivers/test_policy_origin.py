"""What a policy's card says about the games in which it learned, held against those of a scene."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.config.scene import Varies
from harness.drivers.policy_file import Policy, write_policy
from harness.drivers.policy_origin import grouped, origin_card, other_games
from harness.errors import UsageError
from harness.game.roles import EGO, NON_EGO
from harness.road.scene.open_scene import OpenScene
from tests.support.policies import some_policy


def write(folder: Path, **card: Any) -> Path:
    write_policy(Policy(some_policy().tensors, card), folder)
    return folder


def told(folder: Path, scene: OpenScene, player: int = EGO, **changes: Any) -> str:
    document = scene.document.model_copy(update=changes)
    return other_games(folder, document, scene.world, player=player)


@pytest.mark.parametrize("player", [EGO, NON_EGO])
def test_games__of_the_scene_that_a_policy_learned_in_are_the_same(
    player: int, merge: OpenScene, tmp_path: Path
) -> None:
    assert told(write(tmp_path, **origin_card(merge.document, merge.world, player)), merge, player) == ""


def test_games__each_difference_is_named(merge: OpenScene, tmp_path: Path) -> None:
    card = origin_card(merge.document, merge.world, EGO) | {"player": "non_ego"}
    folder = write(tmp_path, **card | {"scene": "crossing", "step_s": 0.05, "friction": [0.3, 0.5]})
    assert told(folder, merge) == (
        "learned in other games: scene crossing, here merge; player non_ego, here ego; step_s 0.05, here 0.1; "
        "friction 0.3 to 0.5, here 0.8"
    )


def test_games__of_a_road_on_which_a_policy_learned_too_are_the_same(merge: OpenScene, tmp_path: Path) -> None:
    card = origin_card(merge.document, merge.world, EGO) | {"scene": "crossing", "friction": [0.3, 0.5]}
    assert told(write(tmp_path, **card, roads=["zebra", "merge"]), merge) == ""
    assert "scene crossing, here merge" in told(write(tmp_path, **card, roads=["zebra"]), merge)


@pytest.mark.parametrize(("friction", "is_told"), [((0.5, 0.8), False), ((0.4, 0.8), True), ((0.8, 1.0), True)])
def test_friction__within_the_range_that_a_policy_learned_in_is_no_difference(
    friction: tuple[float, float], is_told: bool, merge: OpenScene, tmp_path: Path
) -> None:
    folder = write(tmp_path, friction=[0.5, 0.9])
    assert bool(told(folder, merge, varies=Varies(friction=friction))) is is_told


def test_card__that_says_nothing_is_compared_with_nothing(merge: OpenScene, tmp_path: Path) -> None:
    assert told(write(tmp_path), merge) == ""


@pytest.mark.parametrize("limit", ["max_acceleration_mps2", "max_braking_mps2", "max_steering_rad"])
def test_car__of_other_actuators_is_refused(limit: str, merge: OpenScene, tmp_path: Path) -> None:
    folder = write(tmp_path, **origin_card(merge.document, merge.world, EGO))
    values = getattr(merge.world.actuators, limit).copy()
    values[EGO] *= 0.5
    world = replace(merge.world, actuators=merge.world.actuators._replace(**{limit: values}))
    with pytest.raises(UsageError, match=rf"policy.json: cars: it learned with .*{limit}.*another meaning"):
        other_games(folder, merge.document, world, player=EGO)
    other_games(
        write(tmp_path / "person", **origin_card(merge.document, merge.world, NON_EGO)),
        merge.document,
        world,
        player=NON_EGO,
    )


@pytest.mark.parametrize(
    ("key", "value"),
    [("step_s", "soon"), ("friction", [0.5]), ("friction", [np.nan, 1.0]), ("cars", 3), ("scene", "x" * 300)],
)
def test_card__that_is_damaged_is_refused(key: str, value: Any, merge: OpenScene, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=rf"policy.json: {key}.*train the policy again"):
        told(write(tmp_path, **{key: value}), merge)


def test_grouped__names_with_the_same_remark_share_a_line() -> None:
    remarks = dict.fromkeys("abcde", "far away") | {"f": "near"}
    assert list(grouped(remarks)) == [("a, b, c, 2 more", "far away"), ("f", "near")]
