"""Training: the same policy with and without interruptions, from a valid checkpoint only; and it learns."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import harness.training.ppo
from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.config.training import Training
from harness.drivers.mixture import mixture_of
from harness.drivers.policy_file import LearnedDriver, write_policy
from harness.drivers.sumo import SumoDriver
from harness.environments.vector_env import ArenaVecEnv, JoinedVecEnv
from harness.game.initial_state import StartDistribution
from harness.game.observation_layout import OF_OTHERS, SIZE
from harness.game.payoff_terms import TERMS
from harness.game.quantities import Quantities
from harness.game.roles import EGO, NON_EGO
from harness.road.scene.open_scene import OpenScene
from harness.training.checkpoint import Progress
from harness.training.ppo import TrainingResult, train
from harness.training.training_games import TrainingSpec
from tests.support.rollouts import Steady
from tests.support.tiny import SPEEDY, TEXTING, settings
from tests.support.trainings import beside, in_one_go, naive_ego
from tests.support.work import assert_work

OTHERS = np.flatnonzero(OF_OTHERS)


@pytest.fixture(scope="session")
def alone(merge: OpenScene) -> TrainingSpec:
    return naive_ego(merge)


@pytest.fixture(scope="session")
def trained(alone: TrainingSpec, tmp_path_factory: pytest.TempPathFactory) -> TrainingResult:
    """The result of a training without interruption."""
    return in_one_go(alone, tmp_path_factory.mktemp("training"))


def stop_after(segments: int) -> Callable[[int, int], None]:
    """An `on_progress` that ends the training, as a killed process would, in the segment after `segments`."""

    def report(done: int, total: int) -> None:
        if done > segments * 1024:
            raise KeyboardInterrupt

    return report


def same(one: TrainingResult, other: TrainingResult, folder: Path) -> bool:
    for name, each in (("one", one), ("other", other)):
        write_policy(each.policy, folder / name)
    one_bytes, other_bytes = ((folder / name / "policy.safetensors").read_bytes() for name in ("one", "other"))
    return one_bytes == other_bytes and one.progress == other.progress and one.stopped == other.stopped


def test_train__has_a_complete_curve(alone: TrainingSpec, trained: TrainingResult) -> None:
    assert trained.stopped == "budget"
    assert trained.progress.steps == 3072
    assert trained.progress.segments == len(trained.progress.segment_payoffs) == 3
    curve = trained.progress.curve
    assert [window.steps for window in curve] == [1024, 2048, 3072]  # a short segment has a window of its own
    assert all(window.games > 0 and 0.0 <= window.failure_rate <= 1.0 for window in curve)
    assert all(0.0 < window.mean_duration_s <= alone.scene.world.time_limit_s for window in curve)
    # the games of a segment are those of its windows
    assert [window.mean_payoff for window in curve] == pytest.approx(trained.progress.segment_payoffs)


def test_train__again_is_the_same(alone: TrainingSpec, trained: TrainingResult, tmp_path: Path) -> None:
    threads = threading.active_count()
    assert same(in_one_go(alone, tmp_path, tensorboard=tmp_path / "events"), trained, tmp_path)
    assert list((tmp_path / "events").glob("events.out.tfevents*"))
    assert threading.active_count() == threads  # the one that writes for TensorBoard has ended


@pytest.mark.parametrize("segments", [0, 1, 2])
def test_train__an_interruption_does_not_change_the_policy(
    segments: int, alone: TrainingSpec, trained: TrainingResult, tmp_path: Path
) -> None:
    with pytest.raises(KeyboardInterrupt):
        in_one_go(alone, tmp_path, on_progress=stop_after(segments))
    assert (tmp_path / "checkpoint.safetensors").exists() == (segments > 0)
    reports: list[tuple[int, int]] = []
    resumed = in_one_go(alone, tmp_path, on_progress=lambda *counts: reports.append(counts))
    assert same(resumed, trained, tmp_path)
    assert reports[0] == (segments * 1024 + 512, 3072)  # it continued from the checkpoint
    assert reports[-1] == (3072, 3072)
    assert same(in_one_go(alone, tmp_path, on_progress=stop_after(0)), trained, tmp_path)  # of a finished training


def test_train__a_continued_converged_training_stays_converged(
    alone: TrainingSpec, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(harness.training.ppo, "has_converged", lambda payoffs: len(payoffs) >= 2)
    monkeypatch.setattr(harness.training.ppo, "failing_roads", lambda games, failures: [])
    converged = in_one_go(alone, tmp_path)
    assert (converged.stopped, converged.progress.converged_at) == ("converged", 2048)
    assert converged.progress.steps == 2048 + 512  # a tenth of the budget more, in whole rollouts
    assert same(in_one_go(alone, tmp_path, on_progress=stop_after(0)), converged, tmp_path)
    patient = replace(alone, settings=settings(steps=3072, early_convergence=False))
    trained = train(patient, checkpoint=tmp_path / "patient.safetensors", key="key", card={})
    assert (trained.stopped, trained.progress.steps) == ("budget", 3072)


def test_train__ignores_a_checkpoint_with_another_key(
    alone: TrainingSpec, trained: TrainingResult, tmp_path: Path
) -> None:
    short = replace(alone, settings=settings(steps=1024), parts=("training", 9, "naive"))
    train(short, checkpoint=tmp_path / "checkpoint.safetensors", key="another key", card={})
    assert same(in_one_go(alone, tmp_path), trained, tmp_path)


def test_train__a_policy_trained_alone_ignores_other_road_users(trained: TrainingResult) -> None:
    weight = trained.policy.tensors["actor.0.weight"]
    assert np.all(weight[:, OTHERS] == 0.0)
    assert np.all(trained.policy.tensors["critic.0.weight"][:, OTHERS] == 0.0)
    assert np.abs(np.delete(weight, OTHERS, axis=1)).min() > 0.0
    draw = np.random.default_rng(1)
    seen = draw.uniform(-1.0, 1.0, (50, SIZE)).astype(np.float32)
    elsewhere = seen.copy()
    elsewhere[:, OTHERS] = draw.uniform(-1.0, 1.0, (50, len(OTHERS)))
    driver, games, noise = LearnedDriver(trained.policy, sampled=False), np.arange(50), np.zeros((50, 2))
    np.testing.assert_array_equal(driver.decide(games, seen, noise), driver.decide(games, elsewhere, noise))


def test_train__a_policy_trained_with_an_opponent_observes_it(
    alone: TrainingSpec, trained: TrainingResult, tmp_path: Path
) -> None:
    ego = LearnedDriver(trained.policy, sampled=False)
    spec = beside(alone, NON_EGO, mixture_of(ego, alone.personas[0]), alone_share=0.25, settings=settings(steps=1024))
    with_opponent = in_one_go(spec, tmp_path)
    assert np.abs(with_opponent.policy.tensors["actor.0.weight"][:, OTHERS]).max() > 0.0


def test_train__starts_from_the_initial_policy(
    alone: TrainingSpec, trained: TrainingResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    over = Progress(segments=1, steps=10**9, segment_payoffs=[0.0], curve=[], alone_games=[{}], alone_failures=[{}])
    monkeypatch.setattr(harness.training.ppo, "_segment", lambda *_, **__: over)
    warm = in_one_go(replace(alone, initial=trained.policy), tmp_path)
    for name, tensor in trained.policy.tensors.items():
        if name != "log_deviation":
            np.testing.assert_array_equal(warm.policy.tensors[name], tensor)
    assert np.exp(warm.policy.tensors["log_deviation"]) == pytest.approx([Training().initial_deviation] * 2)


def test_train__an_initial_policy_of_another_network_is_refused(
    alone: TrainingSpec, trained: TrainingResult, tmp_path: Path
) -> None:
    larger = replace(alone, initial=trained.policy, settings=settings(network=[9]))
    with pytest.raises(ValueError, match="other layer sizes"):
        in_one_go(larger, tmp_path)


@pytest.mark.parametrize("share", [0.0, 0.25, 1.0])
def test_train__alone_share_is_the_share_of_games_without_opponent(
    share: float, alone: TrainingSpec, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    present: list[bool] = []
    reset = harness.environments.vector_env.Arena.reset

    def recording(arena: Any, starts: Any, departures: Any = None) -> None:
        present.extend(bool(each.present[NON_EGO]) for each in starts.values())
        assert all(each.present[EGO] for each in starts.values())
        reset(arena, starts, departures)

    monkeypatch.setattr(harness.environments.vector_env.Arena, "reset", recording)
    short_games = alone.settings.model_copy(update={"initial_deviation": 0.5})  # most of them end at the rail
    spec = beside(alone, EGO, mixture_of(SumoDriver(), alone.personas[0]), alone_share=share, settings=short_games)
    progress = in_one_go(spec, tmp_path).progress
    assert len(present) > 60
    tolerance = 0.15 if 0.0 < share < 1.0 else 0.0
    assert 1.0 - np.mean(present) == pytest.approx(share, abs=tolerance)
    ended = sum(window.games for window in progress.curve)
    assert sum(sum(each.values()) for each in progress.alone_games) / ended == pytest.approx(share, abs=tolerance)


def samplings(monkeypatch: pytest.MonkeyPatch) -> list[StartDistribution]:
    """The start distributions of the segments of a training, as it begins them."""
    sampled: list[StartDistribution] = []
    sample_from = ArenaVecEnv.sample_from

    def recording(
        environment: ArenaVecEnv, start_distribution: StartDistribution, *parts: str | int, **options: Any
    ) -> None:
        if "segment" in parts:
            sampled.append(start_distribution)
        sample_from(environment, start_distribution, *parts, **options)

    monkeypatch.setattr(ArenaVecEnv, "sample_from", recording)
    return sampled


@pytest.mark.parametrize(("share", "lapsing"), [(0.0, [True] * 3), (0.5, [False, False, True])])
def test_train__lapses_of_attention_start_after_the_attentive_share(
    share: float, lapsing: list[bool], alone: TrainingSpec, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sampled = samplings(monkeypatch)
    texting = mixture_of(Steady(), read_document(TEXTING, Persona))
    in_one_go(beside(alone, EGO, texting, attentive_share=share), tmp_path)
    factors = [[each for of_player in starts.human_factors for each in of_player] for starts in sampled]
    assert [any(each.attention is not None for each in of_game) for of_game in factors] == lapsing


@pytest.mark.parametrize(("learner", "opponents_share"), [(EGO, 0.85), (NON_EGO, 0.0)])
def test_train__the_learner_glances_over_the_shoulder_and_the_opponent_does_not(
    learner: int, opponents_share: float, alone: TrainingSpec, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sampled = samplings(monkeypatch)
    speedy = read_document(SPEEDY, Persona)
    assert speedy.human_factors.sight.no_shoulder_glance_share == 0.85  # of a person; the ego is a machine
    in_one_go(beside(alone, learner, mixture_of(Steady(), speedy), personas=(speedy,)), tmp_path)
    shares = [[each.sight.no_shoulder_glance_share for (each,) in starts.human_factors] for starts in sampled]
    assert shares
    assert all(each[learner] == 0.0 and each[1 - learner] == opponents_share for each in shares)


def test_train__the_deviation_of_actions_is_bounded(alone: TrainingSpec, tmp_path: Path) -> None:
    def deviations(bound: float) -> np.ndarray:
        rewarded = settings(
            steps=1024,
            learning_rate=0.01,
            entropy_coefficient=1.0,
            initial_deviation=0.5,
            max_deviation=bound,
            final_deviation=bound,
        )
        folder = tmp_path / f"{bound}"
        folder.mkdir()
        return np.exp(in_one_go(replace(alone, settings=rewarded), folder).policy.tensors["log_deviation"])

    assert (deviations(2.0) > 0.55).all()  # the entropy term raises it from 0.5
    assert (deviations(0.5) <= 0.5 + 1e-6).all()


def test_train__the_deviation_of_actions_ends_narrow(alone: TrainingSpec, tmp_path: Path) -> None:
    narrow = replace(alone, settings=settings(steps=2048, final_deviation=0.2, narrowing_share=0.5))
    assert (np.exp(in_one_go(narrow, tmp_path).policy.tensors["log_deviation"]) <= 0.2 + 1e-6).all()


@pytest.mark.filterwarnings("error")
def test_train__a_minibatch_need_not_divide_the_buffer(alone: TrainingSpec, tmp_path: Path) -> None:
    uneven = replace(alone, settings=settings(steps=1024, minibatch=96))
    assert in_one_go(uneven, tmp_path).progress.steps == 1024


def test_train__ppo_sees_scaled_payoffs_and_the_curve_does_not(
    alone: TrainingSpec, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rewards: list[np.ndarray] = []
    step = JoinedVecEnv.step_wait

    def recording(environment: JoinedVecEnv) -> Any:
        result = step(environment)
        rewards.append(result[1])
        return result

    def curve(scale: float) -> float:
        (tmp_path / f"{scale}").mkdir()
        # one update at the end: both play the same games
        spec = replace(alone, settings=settings(steps=1024, buffer=1024, payoff_scale=scale))
        return in_one_go(spec, tmp_path / f"{scale}").progress.curve[0].mean_payoff

    monkeypatch.setattr(JoinedVecEnv, "step_wait", recording)
    assert curve(0.25) == pytest.approx(curve(1.0))
    scaled, plain = np.split(np.concatenate(rewards), 2)
    np.testing.assert_allclose(scaled, 0.25 * plain, rtol=1e-6)


@pytest.mark.parametrize(("demonstration_steps", "place"), [(0, r"after \d+ steps"), (512, "in a demonstration")])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_train__a_payoff_that_is_not_finite_ends_it_with_its_place(
    value: float,
    demonstration_steps: int,
    place: str,
    alone: TrainingSpec,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def broken(q: Quantities) -> np.ndarray:
        return np.where(q.state.step[:, None] == 17, value, q.advanced_m)

    monkeypatch.setattr(Quantities, "broken", property(broken), raising=False)
    monkeypatch.setitem(TERMS, "progress", replace(TERMS["progress"], quantity="broken"))  # type: ignore[index]
    spec = replace(alone, settings=settings(steps=3072, demonstration_steps=demonstration_steps))
    with pytest.raises(FloatingPointError, match=rf"payoff of ego is (nan|inf) in step 17 of game \d+, {place}"):
        in_one_go(spec, tmp_path)
    assert not (tmp_path / "checkpoint.safetensors").exists()


def test_train__a_flat_curve_of_failures_is_not_convergence(
    alone: TrainingSpec, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(harness.training.ppo, "has_converged", lambda payoffs: len(payoffs) >= 1)
    trained = in_one_go(alone, tmp_path)
    assert (trained.stopped, trained.progress.steps) == ("budget", 3072)
    games, failures = (
        [sum(each.values()) for each in counts]
        for counts in (trained.progress.alone_games, trained.progress.alone_failures)
    )
    assert sum(games) == sum(window.games for window in trained.progress.curve)  # it is alone in all of them
    assert sum(failures) > 0.5 * sum(games)


WITHOUT_COMPILER = """
import sys
import threading
import torch
from harness.training.ppo import _leave_out_compiler

_leave_out_compiler()
layer = torch.nn.Linear(2, 1)
adam = torch.optim.Adam(layer.parameters(), lr=0.5)
adam.load_state_dict(adam.state_dict())
adam.zero_grad()
assert "torch._dynamo" not in sys.modules
before = layer.weight.clone()
layer(torch.ones(2)).sum().backward()
adam.step()
assert torch.allclose(before - layer.weight, torch.tensor(0.5))  # Adam's first step is the learning rate
"""


def test_optimiser__is_made_without_the_compiler_and_takes_its_steps() -> None:
    done = subprocess.run([sys.executable, "-c", WITHOUT_COMPILER], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_train__an_ego_alone_learns_to_drive(alone: TrainingSpec, tmp_path: Path) -> None:
    budget = settings(
        steps=262_144,
        segment_steps=131_072,
        games=64,
        buffer=2048,
        minibatch=512,
        epochs=10,
        network=[64, 64],
        demonstration_steps=0,
    )
    began = time.process_time()
    learned = in_one_go(replace(alone, settings=budget), tmp_path)
    curve = learned.progress.curve
    assert len(curve) == 16
    assert curve[-1].mean_payoff > curve[0].mean_payoff + 5.0
    assert_work(time.process_time() - began, 240.0)  # whatever else the machine does
