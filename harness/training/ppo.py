"""Training one player on an arena with Stable-Baselines3's PPO, in segments.

A segment starts from parameters, optimiser state and seeds hashed from its number alone, with every game started
anew. So a training that was interrupted and one that was not are the same training.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import configure
from stable_baselines3.common.utils import set_random_seed

from harness.config.campaign import Training
from harness.config.persona import Persona
from harness.drivers.mixture import Mixture, Player, mixture_of
from harness.drivers.policy_file import Policy
from harness.environments.arena import Arena, Seat
from harness.environments.vector_env import ArenaVecEnv, Finished
from harness.game.attention import HumanFactors
from harness.game.initial_state import StartDistribution
from harness.game.observation import OF_OTHERS
from harness.game.seeding import seed_of
from harness.game.state import Outcome
from harness.traffic.scene import OpenScene
from harness.training.checkpoint import CurvePoint, Progress, policy_of, put_policy, read_checkpoint, write_checkpoint
from harness.training.early_stopping import has_converged

CURVE_WINDOW_STEPS = 16_384
_GAE_LAMBDA = 0.95


@dataclass(frozen=True)
class TrainingSpec:
    """What one training is made of: who learns, on what payoff, against whom, beginning from what."""

    scene: OpenScene
    learner: int
    personas: tuple[Persona, Persona]  # of the ego's seat and of the non-ego's
    opponent: Player
    """Who has the other seat; None: the learner is alone in every game."""
    alone_share: float
    attentive_share: float
    """Share of the budget in which nobody's attention lapses yet."""
    initial: Policy | None
    settings: Training
    parts: tuple[str | int, ...]
    """Names the lesson's random numbers."""
    as_it_drives: bool = False
    """Learn with the habits of driving as well: a best response is best under the limits it is judged by."""


@dataclass(frozen=True)
class Trained:
    """What a training came to."""

    policy: Policy
    progress: Progress
    stopped: str  # "converged" or "budget"


def train(
    spec: TrainingSpec,
    checkpoint: Path,
    key: str,
    card: dict[str, Any],
    tensorboard: Path | None = None,
    on_progress: Callable[[int, int], None] = lambda done, total: None,
    on_start: Callable[[int], None] = lambda segment: None,
) -> Trained:
    """Train to convergence or to the end of the budget, going on from `checkpoint` if it was made with this `key`.

    `on_progress` gets the steps done and their total, several times a second, `on_start` the number of each segment
    before it starts.
    Raises FloatingPointError where a parameter is not finite or a number of the game can't be right
    (`game.plausibility`), SimulationError where SUMO fails, ValueError where the initial policy doesn't fit.
    """
    torch.set_num_threads(1)
    environment = _environment(spec)
    try:
        model = _learner(spec, environment, tensorboard)
        progress = read_checkpoint(model, key, checkpoint) or Progress(0, 0, [], [])
        while (stopped := _why_to_stop(spec, progress)) is None:
            on_start(progress.segments)
            progress = _segment(spec, model, environment, progress, on_progress)
            write_checkpoint(model, progress, key, checkpoint)
        return Trained(policy_of(model, card), progress, stopped)
    finally:
        environment.close()


def _why_to_stop(spec: TrainingSpec, progress: Progress) -> str | None:
    """Asked before each segment, so that one who goes on from a finished training's checkpoint is told as well."""
    settings = spec.settings
    attentive = ceil(_attentive_steps(spec) / settings.segment_steps)
    if settings.early_convergence and has_converged(progress.segment_payoffs[attentive:]):
        return "converged"
    return "budget" if progress.steps >= settings.steps else None


def _environment(spec: TrainingSpec) -> ArenaVecEnv:
    others = _others(spec)
    nobody = [Seat(None)]  # and is in no game
    seats = [[Seat(each.driver) for each in others.members] if others is not None else nobody] * 2
    seats[spec.learner] = [Seat(None, spec.personas[spec.learner].payoff)]
    seed = seed_of(*spec.parts, "sumo") % 2**31
    arena = Arena(spec.scene, spec.settings.games, seats, seed)
    scale = spec.settings.payoff_scale
    return ArenaVecEnv(arena, spec.learner, _start_distribution(spec, 0), *spec.parts, payoff_scale=scale)


def _start_distribution(spec: TrainingSpec, steps: int) -> StartDistribution:
    """What the games are drawn from, `steps` into the training."""
    present = [0.0 if spec.opponent is None else 1.0 - spec.alone_share] * 2
    present[spec.learner] = 1.0
    theirs, their_shares = _of_other(spec)
    human_factors, shares = [theirs, theirs], [their_shares, their_shares]
    # Nobody learns from what was overlooked and went well: a driver learns with open eyes, and drives by habit. What
    # the body can't do is there from the first lesson on.
    own = spec.personas[spec.learner].human_factors
    eyes_open = own if spec.as_it_drives else own.with_open_eyes
    human_factors[spec.learner], shares[spec.learner] = [eyes_open], [1.0]
    if steps < _attentive_steps(spec):
        human_factors = [[replace(each, attention=None) for each in of_player] for of_player in human_factors]
    return spec.scene.start_distribution(human_factors, present, shares)


def _others(spec: TrainingSpec) -> Mixture | None:
    opponent = spec.opponent
    return mixture_of(opponent, spec.personas[1 - spec.learner]) if opponent is not None else None


def _of_other(spec: TrainingSpec) -> tuple[list[HumanFactors], list[float]]:
    """HumanFactors and shares of who has the other seat."""
    others = _others(spec)
    if others is None:
        return [spec.personas[1 - spec.learner].human_factors], [1.0]
    return others.human_factors, others.shares


def _attentive_steps(spec: TrainingSpec) -> float:
    human_factors, _ = _of_other(spec)
    lapses = any(each.attention is not None for each in (spec.personas[spec.learner].human_factors, *human_factors))
    return spec.attentive_share * spec.settings.steps if lapses else 0.0


def _learner(spec: TrainingSpec, environment: ArenaVecEnv, tensorboard: Path | None) -> PPO:
    settings = spec.settings
    set_random_seed(seed_of(*spec.parts, "parameters") % 2**32)
    model = PPO(
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
        policy_kwargs={
            "net_arch": list(settings.network),
            "log_std_init": float(np.log(settings.initial_deviation)),
        },
        device="cpu",
    )
    model.set_logger(configure(str(tensorboard), ["tensorboard"]) if tensorboard else configure(None, []))
    if spec.initial is not None:
        put_policy(model, spec.initial, settings.initial_deviation)
    else:
        _ignore_others(model)
    return model


def _ignore_others(model: PPO) -> None:
    """What a learner has never met has no say: the entries of others begin without weight, and get it as they vary."""
    extractor: Any = model.policy.mlp_extractor
    with torch.no_grad():
        for network in (extractor.policy_net, extractor.value_net):
            network[0].weight[:, torch.as_tensor(OF_OTHERS)] = 0.0


def _segment(
    spec: TrainingSpec,
    model: PPO,
    environment: ArenaVecEnv,
    progress: Progress,
    on_progress: Callable[[int, int], None],
) -> Progress:
    parts = (*spec.parts, "segment", progress.segments)
    set_random_seed(seed_of(*parts, "learner") % 2**32)
    environment.sample_from(_start_distribution(spec, progress.steps), *parts)
    environment.arena.reload(seed_of(*parts, "sumo") % 2**31)
    steps = min(spec.settings.segment_steps, spec.settings.steps - progress.steps)
    curve = _Curve(environment, progress, on_progress, spec)
    model.num_timesteps = progress.steps
    model._last_obs = None  # the games start anew
    try:
        keep = _KeepDeviation(spec.settings.max_deviation)
        model.learn(steps, callback=[curve, keep], reset_num_timesteps=False)
    except FloatingPointError as error:
        raise FloatingPointError(f"{error}, after {model.num_timesteps} steps") from error
    for name, value in model.policy.state_dict().items():
        if not torch.isfinite(value).all():
            raise FloatingPointError(f"parameter {name} is not finite after {model.num_timesteps} steps")
    payoffs = [game.payoff for game in curve.games]
    mean = float(np.mean(payoffs)) if payoffs else float("-inf")
    return Progress(progress.segments + 1, model.num_timesteps, [*progress.segment_payoffs, mean], curve.windows)


class _KeepDeviation(BaseCallback):
    """Keeps the deviation of actions below its bound. Actions end at ±1, so that beyond it the entropy term of PPO
    goes on paying for a deviation which is no exploration any more, but full throttle and full brake in turn."""

    def __init__(self, most: float) -> None:
        super().__init__()
        self._most = float(np.log(most))

    def _on_step(self) -> bool:
        return True

    def _on_rollout_start(self) -> None:
        self._bound()

    def _on_training_end(self) -> None:
        self._bound()  # what is kept is within it as well

    def _bound(self) -> None:
        deviation: Any = self.model.policy.log_std
        with torch.no_grad():
            deviation.clamp_(max=self._most)


class _Curve(BaseCallback):
    """Gathers the learning curve of a segment and tells how far it has come."""

    def __init__(
        self,
        environment: ArenaVecEnv,
        progress: Progress,
        on_progress: Callable[[int, int], None],
        spec: TrainingSpec,
    ) -> None:
        super().__init__()
        self._environment, self._report, self._lesson = environment, on_progress, spec
        self._window: list[Finished] = []
        self._window_start = progress.steps
        self.windows, self.games = list(progress.curve), list[Finished]()

    def _on_step(self) -> bool:
        return True

    def _on_rollout_end(self) -> None:
        finished = self._environment.take_finished()
        self._window += finished
        self.games += finished
        if self.num_timesteps - self._window_start >= CURVE_WINDOW_STEPS:
            self._close_window()
        self._report(self.num_timesteps, self._lesson.settings.steps)

    def _on_training_end(self) -> None:
        self._close_window()  # a segment's games are in its own windows, however short it was
        self.logger.dump(self.num_timesteps)

    def _close_window(self) -> None:
        games = self._window
        if not games:
            return
        window = CurvePoint(
            steps=self.num_timesteps,
            mean_payoff=float(np.mean([game.payoff for game in games])),
            failure_rate=float(np.mean([game.outcome != Outcome.GOAL for game in games])),
            games=len(games),
            mean_duration_s=float(np.mean([game.steps for game in games])) * self._lesson.scene.world.step_s,
        )
        for name in ("mean_payoff", "failure_rate", "mean_duration_s"):
            self.logger.record(f"games/{name}", getattr(window, name))
        self.windows.append(window)
        self._window, self._window_start = [], self.num_timesteps
