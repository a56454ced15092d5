"""A training of several personas: each game has one, the network knows which, and each gets a policy of its own."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.drivers.policy_file import LearnedDriver, Policy, read_policy, write_policy
from harness.drivers.policy_of_many import as_persona, card_of_many, read_policy_of_many
from harness.errors import UsageError
from harness.game.observation_layout import SIZE
from harness.game.roles import NON_EGO
from harness.road.scene.open_scene import OpenScene
from harness.training.training_games import TrainingSpec, open_games
from tests.support.tiny import CAREFUL, SPEEDY, TEXTING, settings
from tests.support.trainings import beside, in_one_go, naive_ego

NAMES = ("speedy", "texting", "careful")
SEEN = st.lists(st.floats(-1.0, 1.0, width=32), min_size=SIZE, max_size=SIZE)


@pytest.fixture
def together(merge: OpenScene) -> TrainingSpec:
    personas = tuple(read_document(file, Persona) for file in (SPEEDY, TEXTING))
    return beside(naive_ego(merge), NON_EGO, None, personas=personas)


def test_games__each_has_one_of_the_personas_which_the_learner_is_told_and_paid_as(together: TrainingSpec) -> None:
    games = open_games(replace(together, settings=settings(games=32)))
    try:
        observed = games.reset()
        assert observed.shape == (32, SIZE + 2) == (32, *games.observation_space.shape)
        which = observed[:, SIZE:]
        assert set(map(tuple, which.tolist())) == {(1.0, 0.0), (0.0, 1.0)}
        step = games.environments[0].arena.step(np.zeros((32, 2, 2)))
        for k, persona in enumerate(together.personas):
            own = which[:, k] == 1.0
            paid = persona.payoff.total(step.quantities, NON_EGO)[own]
            np.testing.assert_allclose(step.payoff[own, NON_EGO], paid)
            assert np.abs(paid).min() > 0.0
    finally:
        games.close()


def test_train__the_policy_of_several_has_an_input_for_each(together: TrainingSpec, tmp_path: Path) -> None:
    policy = in_one_go(together, tmp_path).policy
    for part in ("actor", "critic"):
        weight = policy.layers(part)[0][0]
        assert weight.shape[1] == SIZE + 2
        assert (weight[:, SIZE] != weight[:, SIZE + 1]).any()


@given(number=st.integers(0, 2), seen=SEEN)
def test_persona__its_policy_decides_as_the_policy_of_several_told_which(number: int, seen: list[float]) -> None:
    of_many = _of_many(seed=3)
    told = np.concatenate((np.array(seen, dtype=np.float32), np.eye(3, dtype=np.float32)[number]))
    expected = LearnedDriver(of_many, sampled=False).decide(np.zeros(1, int), told[None], np.zeros((1, 2)))
    alone = LearnedDriver(as_persona(of_many, NAMES[number]), sampled=False)
    decided = alone.decide(np.zeros(1, int), told[None, :SIZE], np.zeros((1, 2)))
    np.testing.assert_allclose(decided, expected, atol=1e-5)


def test_persona__the_policy_of_several_is_no_driver(tmp_path: Path) -> None:
    of_many = _of_many(seed=4)
    write_policy(of_many, tmp_path / "people-seed1")
    with pytest.raises(UsageError, match=r"several personas.*name that of one of them"):
        read_policy(tmp_path / "people-seed1")
    write_policy(as_persona(read_policy_of_many(tmp_path / "people-seed1"), "texting"), tmp_path / "texting-seed1")
    assert read_policy(tmp_path / "texting-seed1").layers("actor")[0][0].shape[1] == SIZE
    with pytest.raises(UsageError, match="is not a policy of several personas"):
        read_policy_of_many(tmp_path / "texting-seed1")


def _of_many(seed: int) -> Policy:
    generator = np.random.default_rng(seed)
    tensors = {"log_deviation": np.zeros(2, dtype=np.float32)}
    for part, outputs in (("actor", 2), ("critic", 1)):
        for k, (inputs, units) in enumerate(((SIZE + 3, 6), (6, outputs))):
            tensors[f"{part}.{k}.weight"] = generator.normal(0.0, 0.3, (units, inputs)).astype(np.float32)
            tensors[f"{part}.{k}.bias"] = generator.normal(0.0, 0.3, units).astype(np.float32)
    return Policy(tensors, card_of_many([read_document(file, Persona) for file in (SPEEDY, TEXTING, CAREFUL)]))
