"""Training of one player on an arena with Stable-Baselines3's PPO, in segments.

A segment starts from the parameters and the optimiser state of the segment before; its seeds depend on its number only,
and every game is reset. So an interrupted training gives the same policy as an uninterrupted one.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from contextlib import ExitStack, closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common import logger, utils
from stable_baselines3.common.callbacks import BaseCallback

from harness.config.training import CurvePoint
from harness.drivers.policy_file import Policy
from harness.environments.vector_env import Finished, JoinedVecEnv
from harness.game.observation_layout import OF_OTHERS
from harness.game.outcome import Outcome
from harness.game.roles import EGO
from harness.game.seeding import seed_of
from harness.training.checkpoint import Progress, read_checkpoint, write_checkpoint
from harness.training.compiled_ppo import CompiledPPO
from harness.training.early_stopping import Narrowing, by_road, failing_roads, has_converged
from harness.training.imitation import imitate
from harness.training.policy_arrays import layers_of, policy_of, put_policy
from harness.training.regret_starts import RegretReplays, first_scores, pool_of
from harness.training.training_games import TrainingSpec, attentive_steps, open_games, sample

CURVE_WINDOW_STEPS = 16_384
_GAE_LAMBDA = 0.95
_ALGORITHMS: dict[str, type[PPO]] = {"compiled": CompiledPPO, "stable_baselines3": PPO}


@dataclass(frozen=True, kw_only=True)
class TrainingResult:
    policy: Policy
    progress: Progress
    stopped: str
    """The reason for the end: "converged" or "budget"."""


def train(
    spec: TrainingSpec,
    *,
    checkpoint: Path,
    key: str,
    card: dict[str, Any],
    tensorboard: Path | None = None,
    on_progress: Callable[[int, int], None] = lambda done, total: None,
    on_start: Callable[[int], None] = lambda segment: None,
) -> TrainingResult:
    """Train until convergence or the end of the budget; the last part is that of `Narrowing`. Training continues from
    `checkpoint` if it has this `key`.

    `card` is the metadata of the policy. `on_progress` gets the number of finished steps and their total after each
    rollout, `on_start` the number of each segment before it starts.
    Raises FloatingPointError if a parameter is not finite or a number of a game is impossible (`game.sanity_checks`),
    SimulationError if SUMO fails, ValueError if the initial policy does not fit the network.
    """
    torch.set_num_threads(1)
    with ExitStack() as opened:
        environment = opened.enter_context(closing(open_games(spec)))
        model = _learner(spec, environment, tensorboard)
        opened.enter_context(closing(model.logger))  # TensorBoard writes in a thread
        progress = read_checkpoint(model, key, checkpoint)
        if progress is None:
            progress = Progress(
                segments=0,
                steps=0,
                segment_payoffs=[],
                curve=[],
                alone_games=[],
                alone_failures=[],
                regret=first_scores(spec),
            )
            if spec.demonstration_steps:
                _imitate(spec, model, environment)
        while (stopped := _stop_reason(spec, progress)) is None:
            on_start(progress.segments)
            progress = _segment(spec, model, environment, progress=progress, on_progress=on_progress)
            write_checkpoint(model, progress, key, checkpoint)
        return TrainingResult(policy=policy_of(model, card), progress=progress, stopped=stopped)


def _stop_reason(spec: TrainingSpec, progress: Progress) -> str | None:
    """The reason to stop, or None. It is checked before each segment, so that a training continued from a finished
    training's checkpoint stops as well."""
    if progress.steps < Narrowing.of(spec.settings, progress.converged_at).end:
        return None
    return "budget" if progress.converged_at is None else "converged"


def _converged_at(spec: TrainingSpec, progress: Progress) -> int | None:
    settings = spec.settings
    if not settings.early_convergence or progress.steps >= Narrowing.of(settings, None).start:
        return None
    attentive = int(np.ceil(attentive_steps(spec) / settings.segment_steps))
    fails = failing_roads(progress.alone_games, progress.alone_failures)
    return progress.steps if not fails and has_converged(progress.segment_payoffs[attentive:]) else None


def _learner(spec: TrainingSpec, environment: JoinedVecEnv, tensorboard: Path | None) -> PPO:
    settings = spec.settings
    utils.set_random_seed(seed_of(*spec.parts, "parameters") % 2**32)
    _leave_out_compiler()
    deviation = float(np.log(settings.initial_deviation))
    with warnings.catch_warnings():  # the last minibatch of a pass may be smaller
        warnings.filterwarnings("ignore", "You have specified a mini-batch size")
        model = _ALGORITHMS[settings.learner](
            "MlpPolicy",
            environment,
            learning_rate=settings.learning_rate,
            n_steps=settings.buffer // settings.games,
            batch_size=settings.minibatch,
            n_epochs=settings.epochs,
            gamma=settings.discount,
            gae_lambda=_GAE_LAMBDA,
            clip_range=settings.clip,
            ent_coef=settings.entropy_coefficient,
            policy_kwargs={"net_arch": list(settings.network), "log_std_init": deviation},
            device="cpu",
        )
    model.set_logger(logger.configure(str(tensorboard), ["tensorboard"]) if tensorboard else logger.Logger(None, []))
    if spec.initial is not None:
        put_policy(model, spec.initial, settings.initial_deviation)
        return model
    with torch.no_grad():  # a learner that is always alone ignores other road users
        for layers in layers_of(model.policy).values():
            layers[0].weight[:, torch.as_tensor(np.flatnonzero(OF_OTHERS))] = 0.0
    return model


def _imitate(spec: TrainingSpec, model: PPO, environment: JoinedVecEnv) -> None:
    """Let a new policy imitate a rule-based driver. An ego is shown the games of its training, in which the driver also
    yields; a person is shown its route alone, so that it has no courtesy that its payoff does not ask for."""
    if spec.places[0].player != EGO:
        sample(replace(spec, alone_share=1.0), environment, 0, *spec.parts)
    steps, seed = spec.demonstration_steps, seed_of(*spec.parts, "demonstration") % 2**31
    try:
        imitate(model, environment, steps=steps, deviation=spec.settings.initial_deviation, seed=seed)
    except FloatingPointError as error:
        raise FloatingPointError(f"{error}, in a demonstration") from error


def _leave_out_compiler() -> None:
    """Let optimisers be made without importing PyTorch's compiler, which takes more than a second in each process that
    trains, and nothing is compiled here.

    PyTorch looks up the form of a method that is not compiled in this attribute: it is the method itself. A version of
    PyTorch that does not look it up imports its compiler as before.
    """
    for name in ("add_param_group", "state_dict", "load_state_dict", "zero_grad"):
        plain = getattr(getattr(torch.optim.Optimizer, name), "__wrapped__", None)
        if plain is not None:
            setattr(plain, "__dynamo_disable", plain)


def _segment(
    spec: TrainingSpec,
    model: PPO,
    environment: JoinedVecEnv,
    *,
    progress: Progress,
    on_progress: Callable[[int, int], None],
) -> Progress:
    parts = (*spec.parts, "segment", progress.segments)
    utils.set_random_seed(seed_of(*parts, "learner") % 2**32)
    replays = RegretReplays(pool_of(spec), progress.regret) if progress.regret is not None else None
    sample(spec, environment, progress.steps, *parts, replays=replays)
    environment.reload(seed_of(*parts, "sumo") % 2**31)
    narrowing = Narrowing.of(spec.settings, progress.converged_at)
    steps = min(spec.settings.segment_steps, narrowing.end - progress.steps)
    curve = _CurveRecorder(
        environment,
        progress,
        replays,
        steps=spec.settings.steps,
        step_s=spec.scene.world.step_s,
        largest_deviation=narrowing.largest_deviation,
        on_progress=on_progress,
    )
    model.num_timesteps = progress.steps
    model._last_obs = None  # SB3 then resets the games
    updates = max(1, CURVE_WINDOW_STEPS // spec.settings.buffer)  # a point in TensorBoard for each of the curve's
    try:
        model.learn(steps, callback=curve, log_interval=updates, reset_num_timesteps=False)
    except FloatingPointError as error:
        raise FloatingPointError(f"{error}, after {model.num_timesteps} steps") from error
    for name, value in model.policy.state_dict().items():
        if not torch.isfinite(value).all():
            raise FloatingPointError(f"parameter {name} is not finite after {model.num_timesteps} steps")
    payoffs = [game.payoff for game in curve.games]
    alone = [game for game in curve.games if game.alone]
    failed = [game for game in alone if game.outcome is not Outcome.GOAL]
    mean = float(np.mean(payoffs)) if payoffs else float("-inf")
    after = Progress(
        segments=progress.segments + 1,
        steps=model.num_timesteps,
        segment_payoffs=[*progress.segment_payoffs, mean],
        curve=curve.windows,
        alone_games=[*progress.alone_games, by_road(game.road for game in alone)],
        alone_failures=[*progress.alone_failures, by_road(game.road for game in failed)],
        converged_at=progress.converged_at,
        regret=replays.scores if replays is not None else None,
    )
    return after if after.converged_at is not None else replace(after, converged_at=_converged_at(spec, after))


class _CurveRecorder(BaseCallback):
    """Records the learning curve of a segment, reports progress, and bounds the standard deviation of actions.

    Actions are clipped at ±1: beyond the bound the entropy term of PPO still rewards a larger deviation, which is no
    exploration any more, but full throttle and full brake in turn.
    """

    def __init__(
        self,
        environment: JoinedVecEnv,
        progress: Progress,
        replays: RegretReplays | None,
        *,
        steps: int,
        step_s: float,
        largest_deviation: Callable[[int], float],
        on_progress: Callable[[int, int], None],
    ) -> None:
        """`progress` is that of the segments before; `steps` is the training's budget, of steps of `step_s` seconds;
        `largest_deviation` is the bound after so many of them."""
        super().__init__()
        self._environment, self._on_progress, self._largest_deviation = environment, on_progress, largest_deviation
        self._steps, self._step_s, self._replays = steps, step_s, replays
        self._window: list[Finished] = []
        self._window_start = progress.steps
        self.windows, self.games = list(progress.curve), list[Finished]()

    def _on_step(self) -> bool:
        return True

    def _on_rollout_start(self) -> None:
        self._bound_deviation()

    def _on_rollout_end(self) -> None:
        finished = self._environment.take_finished()
        self._window += finished
        self.games += finished
        if self.num_timesteps - self._window_start >= CURVE_WINDOW_STEPS:
            self._close_window()
        self._on_progress(self.num_timesteps, self._steps)

    def _on_training_end(self) -> None:
        self._bound_deviation()  # the stored policy is within the bound as well
        self._close_window()  # a window contains games of one segment only, so a short segment has a short window
        self.logger.dump(self.num_timesteps)

    def _bound_deviation(self) -> None:
        deviation: Any = self.model.policy.log_std
        with torch.no_grad():
            deviation.clamp_(max=float(np.log(self._largest_deviation(self.num_timesteps))))

    def _close_window(self) -> None:
        games = self._window
        if not games:
            return
        window = CurvePoint(
            steps=self.num_timesteps,
            mean_payoff=float(np.mean([game.payoff for game in games])),
            failure_rate=float(np.mean([game.outcome != Outcome.GOAL for game in games])),
            games=len(games),
            mean_duration_s=float(np.mean([game.steps for game in games])) * self._step_s,
            mean_regret=self._replays.scores.mean_regret if self._replays is not None else None,
        )
        for name in ("mean_payoff", "failure_rate", "mean_duration_s", "mean_regret"):
            if (value := getattr(window, name)) is not None:
                self.logger.record(f"games/{name}", value)
        self.windows.append(window)
        self._window, self._window_start = [], self.num_timesteps
