"""Imitation: a new policy drives through bends before it has learned anything from its payoff."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.drivers.mixture import mixture_of
from harness.drivers.policy_file import Policy
from harness.drivers.sumo import SumoDriver
from harness.game.roles import EGO, NON_EGO
from harness.road.scene.open_scene import OpenScene, open_scene
from harness.training.imitation import returns_of
from tests.support.tiny import settings
from tests.support.trainings import beside, in_one_go, naive_ego

NO_LEARNING = 1e-9  # step size of Adam in the training after the imitation


@pytest.fixture(scope="module")
def left_turn(repository: Path) -> OpenScene:
    return open_scene(repository / "tests" / "data" / "scenes" / "left_turn")


def failures(scene: OpenScene, folder: Path, *, learner: int, demonstration_steps: int) -> float:
    """The share of games that a new policy fails, alone, after a demonstration of so many steps."""
    folder.mkdir()
    chosen = settings(
        steps=48_000,
        segment_steps=48_000,  # games end with a segment
        games=32,
        network=[64, 64],
        learning_rate=NO_LEARNING,
        demonstration_steps=demonstration_steps,
    )
    curve = in_one_go(beside(naive_ego(scene), learner, None, settings=chosen), folder).progress.curve
    games = np.array([window.games for window in curve])
    return float(games @ [window.failure_rate for window in curve] / games.sum())


@pytest.mark.parametrize(("name", "learner"), [("tests/data/scenes/left_turn", EGO), ("networks/crossing", NON_EGO)])
def test_imitation__a_new_policy_drives_or_walks_to_its_goal(
    name: str, learner: int, repository: Path, tmp_path: Path
) -> None:
    scene = open_scene(repository / name)
    shown, not_shown = (
        failures(scene, tmp_path / str(steps), learner=learner, demonstration_steps=steps) for steps in (9_600, 0)
    )
    assert shown < 0.2
    assert not_shown > 0.4


def first_policy(
    scene: OpenScene, folder: Path, *, learner: int, demonstration_steps: int, alone_share: float = 1.0
) -> Policy:
    """The policy with which a training begins, beside SUMO's driver in a share of its games."""
    folder.mkdir()
    chosen = settings(
        steps=1024, learning_rate=NO_LEARNING, demonstration_steps=demonstration_steps, final_deviation=0.5
    )
    spec = naive_ego(scene)
    other = mixture_of(SumoDriver(), spec.personas[0])
    return in_one_go(beside(spec, learner, other, settings=chosen, alone_share=alone_share), folder).policy


@pytest.mark.parametrize(("learner", "is_the_same"), [(NON_EGO, True), (EGO, False)])
def test_imitation__a_person_is_shown_its_route_alone(
    learner: int, is_the_same: bool, repository: Path, tmp_path: Path
) -> None:
    """Whatever the share of games with another player, of which only an ego sees the demonstrator's reaction."""
    merge = open_scene(repository / "networks" / "merge")
    alone, beside_sumo = (
        first_policy(merge, tmp_path / str(share), learner=learner, demonstration_steps=200, alone_share=share).tensors
        for share in (1.0, 0.0)
    )
    same = [np.allclose(tensor, beside_sumo[name], atol=1e-4) for name, tensor in alone.items()]
    assert all(same) == is_the_same


def test_demonstration__lasts_for_a_fifth_of_the_budget_at_most(left_turn: OpenScene) -> None:
    spec = naive_ego(left_turn)
    spec = replace(spec, settings=settings(steps=100_000, demonstration_steps=38_400))
    assert spec.demonstration_steps == 20_000
    assert replace(spec, settings=settings(steps=1_000_000, demonstration_steps=38_400)).demonstration_steps == 38_400


def test_returns__are_the_discounted_payoffs_until_the_end_of_the_game() -> None:
    payoffs = np.array([[1.0, 3.0], [2.0, 5.0], [4.0, 7.0], [8.0, 9.0]])
    ended = np.array([[False, False], [False, True], [True, False], [False, False]])
    returns = returns_of(payoffs, ended, discount=0.5)
    np.testing.assert_array_equal(returns[:, 0], [1.0 + 1.0 + 1.0, 2.0 + 2.0, 4.0, np.nan])
    np.testing.assert_array_equal(returns[:, 1], [3.0 + 2.5, 5.0, np.nan, np.nan])
