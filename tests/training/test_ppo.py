"""Training: the same in one go and in pieces, and it learns."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from safetensors import safe_open
from safetensors.numpy import load_file, save_file

import harness.training.ppo
from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.drivers.policy import LearnedDriver
from harness.drivers.policy_file import write_policy
from harness.drivers.sumo import SumoDriver
from harness.environments.vector_env import ArenaVecEnv
from harness.game.initial_state import StartDistribution
from harness.game.observation import OF_OTHERS, SIZE
from harness.game.payoff import TERMS
from harness.game.quantities import Quantities
from harness.game.state import EGO, NON_EGO
from harness.traffic.scene import OpenScene
from harness.training.checkpoint import Progress
from harness.training.ppo import Trained, TrainingSpec, train
from tests.support.tiny import CAREFUL, DISTRACTED, SPEEDY, settings

OTHERS = np.flatnonzero(OF_OTHERS)


@pytest.fixture(scope="session")
def alone(merge: OpenScene) -> TrainingSpec:
    """The naive ego's spec, tiny: three segments."""
    careful, speedy = (read_document(file, Persona) for file in (CAREFUL, SPEEDY))
    return TrainingSpec(
        scene=merge,
        learner=EGO,
        personas=(careful, speedy),
        opponent=None,
        alone_share=1.0,
        attentive_share=0.0,
        initial=None,
        settings=settings(steps=3072),
        parts=("training", 1, "naive"),
    )


@pytest.fixture(scope="session")
def trained(alone: TrainingSpec, tmp_path_factory: pytest.TempPathFactory) -> Trained:
    """What the lesson comes to in one go."""
    return in_one_go(alone, tmp_path_factory.mktemp("training"))


def in_one_go(spec: TrainingSpec, folder: Path, **options: Any) -> Trained:
    return train(spec, checkpoint=folder / "checkpoint.safetensors", key="key", card={}, **options)


def stop_after(segments: int) -> Callable[[int, int], None]:
    """A report that ends training, as a killed process would, in the segment after so many."""

    def report(done: int, total: int) -> None:
        if done > segments * 1024:
            raise KeyboardInterrupt

    return report


def same(one: Trained, other: Trained, folder: Path) -> bool:
    for name, each in (("one", one), ("other", other)):
        write_policy(each.policy, folder / name)
    one_bytes, other_bytes = ((folder / name / "policy.safetensors").read_bytes() for name in ("one", "other"))
    return one_bytes == other_bytes and one.progress == other.progress and one.stopped == other.stopped


def test_train__in_one_go(alone: TrainingSpec, trained: Trained) -> None:
    assert trained.stopped == "budget"
    assert trained.progress.steps == 3072
    assert trained.progress.segments == len(trained.progress.segment_payoffs) == 3
    curve = trained.progress.curve
    assert [window.steps for window in curve] == [1024, 2048, 3072]  # a short segment is a window
    assert all(window.games > 0 and 0.0 <= window.failure_rate <= 1.0 for window in curve)
    assert all(0.0 < window.mean_duration_s <= alone.scene.world.time_limit_s for window in curve)
    # every game that ended is in the curve: the games of a segment are those of its windows
    assert [window.mean_payoff for window in curve] == pytest.approx(trained.progress.segment_payoffs)


def test_train__again_is_the_same(alone: TrainingSpec, trained: Trained, tmp_path: Path) -> None:
    assert same(in_one_go(alone, tmp_path, tensorboard=tmp_path / "events"), trained, tmp_path)
    assert list((tmp_path / "events").glob("events.out.tfevents*"))


@pytest.mark.parametrize("segments", [0, 1, 2])
def test_train__interrupted_is_uninterrupted(
    segments: int, alone: TrainingSpec, trained: Trained, tmp_path: Path
) -> None:
    with pytest.raises(KeyboardInterrupt):
        in_one_go(alone, tmp_path, on_progress=stop_after(segments))
    assert (tmp_path / "checkpoint.safetensors").exists() == (segments > 0)
    reports: list[tuple[int, int]] = []
    resumed = in_one_go(alone, tmp_path, on_progress=lambda *counts: reports.append(counts))
    assert same(resumed, trained, tmp_path)
    assert reports[0] == (segments * 1024 + 512, 3072)  # it went on; it did not begin again
    assert reports[-1] == (3072, 3072)


def test_train__going_on_from_a_finished_training_changes_nothing(
    alone: TrainingSpec, trained: Trained, tmp_path: Path
) -> None:
    in_one_go(alone, tmp_path)
    assert same(in_one_go(alone, tmp_path, on_progress=stop_after(0)), trained, tmp_path)


def test_train__a_converged_training_that_is_taken_up_again_stays_converged(
    alone: TrainingSpec, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(harness.training.ppo, "has_converged", lambda payoffs: len(payoffs) >= 2)
    converged = in_one_go(alone, tmp_path)
    assert (converged.stopped, converged.progress.steps) == ("converged", 2048)
    assert same(in_one_go(alone, tmp_path, on_progress=stop_after(0)), converged, tmp_path)
    patient = replace(alone, settings=settings(steps=3072, early_convergence=False))
    trained = train(patient, checkpoint=tmp_path / "patient.safetensors", key="key", card={})
    assert (trained.stopped, trained.progress.steps) == ("budget", 3072)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda file: None,
        lambda file: file.write_bytes(file.read_bytes()[:-10]),
        lambda file: file.write_bytes(b""),
        lambda file: save_file(load_file(file), file),
    ],
    ids=["of other inputs", "truncated", "empty", "without its key"],
)
def test_train__a_checkpoint_that_is_not_ours_counts_for_nothing(
    spoil: Callable[[Path], object], alone: TrainingSpec, trained: Trained, tmp_path: Path
) -> None:
    checkpoint = tmp_path / "checkpoint.safetensors"
    short = replace(alone, settings=settings(steps=1024), parts=("training", 9, "naive"))
    train(short, checkpoint=checkpoint, key="another key", card={})
    spoil(checkpoint)
    assert same(in_one_go(alone, tmp_path), trained, tmp_path)


@pytest.mark.parametrize(
    "change",
    [
        lambda tensors, about: tensors.pop("policy/log_std"),
        lambda tensors, about: tensors.update({"policy/action_net.weight": np.zeros((3, 3), np.float32)}),
        lambda tensors, about: tensors.update({"policy/more": np.zeros(1, np.float32)}),
        lambda tensors, about: tensors.update({"optimizer/0/exp_avg": np.zeros(7, np.float32)}),
        lambda tensors, about: tensors.update({"optimizer/99/step": np.zeros((), np.float32)}),
        lambda tensors, about: about.update(progress="[1, 2]"),
        lambda tensors, about: about.update(progress="{"),
        lambda tensors, about: about.update(progress='{"segments": 1, "steps": 1024, "segment_payoffs": []}'),
    ],
    ids=[
        "parameter missing",
        "shape",
        "parameter too many",
        "moments",
        "no such parameter",
        "list",
        "torn",
        "no curve",
    ],
)
def test_train__a_checkpoint_of_another_learner_counts_for_nothing(
    change: Callable[[dict[str, Any], dict[str, str]], object], alone: TrainingSpec, trained: Trained, tmp_path: Path
) -> None:
    checkpoint = tmp_path / "checkpoint.safetensors"
    in_one_go(replace(alone, settings=settings(steps=1024), parts=("training", 9, "naive")), tmp_path)
    with safe_open(checkpoint, framework="np") as file:
        about = {name: text for name, text in file.metadata().items() if name != "digest"}
    tensors = load_file(checkpoint)
    change(tensors, about)
    save_file(tensors, checkpoint, about)
    assert same(in_one_go(alone, tmp_path), trained, tmp_path)


def test_train__another_seed_learns_otherwise(alone: TrainingSpec, trained: Trained, tmp_path: Path) -> None:
    other = in_one_go(replace(alone, parts=("training", 2, "naive")), tmp_path)
    assert not same(other, trained, tmp_path)
    assert other.progress.segment_payoffs != trained.progress.segment_payoffs


def test_train__who_was_always_alone_does_not_heed_others(trained: Trained) -> None:
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


def test_train__who_met_others_heeds_them(alone: TrainingSpec, trained: Trained, tmp_path: Path) -> None:
    ego = LearnedDriver(trained.policy, sampled=False)
    spec = replace(alone, learner=NON_EGO, opponent=ego, alone_share=0.25, settings=settings(steps=1024))
    met = in_one_go(spec, tmp_path)
    assert np.abs(met.policy.tensors["actor.0.weight"][:, OTHERS]).max() > 0.0


def test_train__warm_start_begins_from_the_given_networks(
    alone: TrainingSpec, trained: Trained, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        harness.training.ppo, "_segment", lambda *_: Progress(segments=1, steps=10**9, segment_payoffs=[0.0], curve=[])
    )
    warm = in_one_go(replace(alone, initial=trained.policy), tmp_path)
    for name, tensor in trained.policy.tensors.items():
        if name != "log_deviation":
            np.testing.assert_array_equal(warm.policy.tensors[name], tensor)
    assert np.exp(warm.policy.tensors["log_deviation"]) == pytest.approx([0.5, 0.5])


def test_train__warm_start_from_another_network_is_refused(
    alone: TrainingSpec, trained: Trained, tmp_path: Path
) -> None:
    larger = replace(alone, initial=trained.policy, settings=settings(network=[9]))
    with pytest.raises(ValueError, match="other layer sizes"):
        in_one_go(larger, tmp_path)


@pytest.mark.parametrize("share", [0.0, 0.25, 1.0])
def test_train__so_many_games_are_played_alone(
    share: float, alone: TrainingSpec, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    met: list[bool] = []
    start = harness.environments.vector_env.Arena.reset

    def noting(arena: Any, starts: Any, departures: Any = None) -> None:
        met.extend(bool(each.present[NON_EGO]) for each in starts.values())
        assert all(each.present[EGO] for each in starts.values())
        start(arena, starts, departures)

    monkeypatch.setattr(harness.environments.vector_env.Arena, "reset", noting)
    spec = replace(alone, opponent=SumoDriver(), alone_share=share)
    in_one_go(spec, tmp_path)
    assert len(met) > 60
    assert 1.0 - np.mean(met) == pytest.approx(share, abs=0.15 if 0.0 < share < 1.0 else 0.0)


@pytest.mark.parametrize(("share", "lapsing"), [(0.0, [True] * 3), (0.5, [False, False, True])])
def test_train__attention_lapses_only_after_its_share_of_the_budget(
    share: float, lapsing: list[bool], alone: TrainingSpec, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[bool] = []
    begin = ArenaVecEnv.sample_from

    def noting(environment: ArenaVecEnv, start_distribution: StartDistribution, *parts: str | int) -> None:
        if "segment" in parts:
            seen.append(
                any(each.attention is not None for of_player in start_distribution.human_factors for each in of_player)
            )
        begin(environment, start_distribution, *parts)

    monkeypatch.setattr(ArenaVecEnv, "sample_from", noting)
    careful, distracted = alone.personas[0], read_document(DISTRACTED, Persona)
    in_one_go(replace(alone, personas=(careful, distracted), attentive_share=share), tmp_path)
    assert seen == lapsing


@pytest.mark.parametrize("learner", [EGO, NON_EGO])
def test_train__the_learner_overlooks_nobody_while_it_learns_and_its_opponent_does(
    learner: int, alone: TrainingSpec, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[list[float]] = []
    begin = ArenaVecEnv.sample_from

    def noting(environment: ArenaVecEnv, start_distribution: StartDistribution, *parts: str | int) -> None:
        seen.append([each.no_blind_spot_check.share for (each,) in start_distribution.human_factors])
        begin(environment, start_distribution, *parts)

    monkeypatch.setattr(ArenaVecEnv, "sample_from", noting)
    speedy = alone.personas[1]
    share = speedy.human_factors.no_blind_spot_check.share
    assert share > 0.0
    in_one_go(replace(alone, learner=learner, personas=(speedy, speedy)), tmp_path)
    assert seen
    assert all(shares[learner] == 0.0 and shares[1 - learner] == share for shares in seen)


def test_train__the_deviation_of_actions_keeps_to_its_bound(alone: TrainingSpec, tmp_path: Path) -> None:
    def deviations(most: float) -> np.ndarray:
        tempted = settings(steps=1024, learning_rate=0.01, entropy_coefficient=1.0, max_deviation=most)
        folder = tmp_path / f"{most}"
        folder.mkdir()
        return np.exp(in_one_go(replace(alone, settings=tempted), folder).policy.tensors["log_deviation"])

    assert (deviations(2.0) > 0.55).all()  # the entropy term raises it from 0.5
    assert (deviations(0.5) <= 0.5 + 1e-6).all()


def test_train__ppo_sees_scaled_payoffs_and_the_curve_does_not(
    alone: TrainingSpec, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: dict[float, np.ndarray] = {}
    curves: dict[float, float] = {}
    step = ArenaVecEnv.step_wait
    for scale in (1.0, 0.25):
        rewards: list[np.ndarray] = []

        def noting(environment: ArenaVecEnv, kept: list[np.ndarray] = rewards) -> Any:
            result = step(environment)
            kept.append(result[1])
            return result

        monkeypatch.setattr(ArenaVecEnv, "step_wait", noting)
        folder = tmp_path / f"{scale}"
        folder.mkdir()
        # one update, at the very end: both play the same games until then
        spec = replace(alone, settings=settings(steps=1024, buffer=1024, payoff_scale=scale))
        curves[scale] = in_one_go(spec, folder).progress.curve[0].mean_payoff
        seen[scale] = np.concatenate(rewards)
    np.testing.assert_allclose(seen[0.25], 0.25 * seen[1.0], rtol=1e-6)
    assert curves[0.25] == pytest.approx(curves[1.0])


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_train__a_payoff_that_is_no_number_stops_it_and_is_placed(
    value: float, alone: TrainingSpec, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(q: Quantities) -> np.ndarray:
        return np.where(q.state.step[:, None] == 17, value, q.advanced_m)

    monkeypatch.setattr(Quantities, "broken", property(broken), raising=False)
    monkeypatch.setitem(TERMS, "progress", replace(TERMS["progress"], quantity="broken"))  # type: ignore[index]
    with pytest.raises(FloatingPointError, match=r"payoff of ego is (nan|inf) in step 17 of game \d+, after \d+ steps"):
        in_one_go(alone, tmp_path)
    assert not (tmp_path / "checkpoint.safetensors").exists()


def test_train__gives_the_simulation_back(alone: TrainingSpec, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    closed: list[ArenaVecEnv] = []
    close = ArenaVecEnv.close
    monkeypatch.setattr(ArenaVecEnv, "close", lambda self: (closed.append(self), close(self)))
    with pytest.raises(KeyboardInterrupt):
        in_one_go(alone, tmp_path, on_progress=stop_after(0))
    assert len(closed) == 1


def test_checkpoint__opening_one_runs_no_code(alone: TrainingSpec, tmp_path: Path) -> None:
    in_one_go(replace(alone, settings=settings(steps=1024)), tmp_path)
    content = (tmp_path / "checkpoint.safetensors").read_bytes()
    header = json.loads(content[8 : 8 + int.from_bytes(content[:8], "little")])  # safetensors: a JSON header, numbers
    assert header["__metadata__"]["key"] == "key"
    assert any(name.startswith("optimizer/") for name in header)


@pytest.mark.slow
def test_train__an_ego_alone_learns_to_drive(alone: TrainingSpec, tmp_path: Path) -> None:
    budget = settings(
        steps=262_144, segment_steps=131_072, games=64, buffer=2048, minibatch=512, epochs=10, network=[64, 64]
    )
    began = time.monotonic()
    learned = in_one_go(replace(alone, settings=budget), tmp_path)
    curve = learned.progress.curve
    assert len(curve) == 16
    assert curve[-1].mean_payoff > curve[0].mean_payoff + 5.0
    assert time.monotonic() - began < 120.0
