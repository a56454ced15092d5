"""Training of one player on an arena with Stable-Baselines3's PPO, in segments.

A segment starts from the parameters and the optimiser state of the segment before; its seeds depend on its number only,
and every game is reset. So an interrupted training gives the same policy as an uninterrupted one.
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
from stable_baselines3.common.logger import configure
from stable_baselines3.common.utils import set_random_seed

from harness.config.campaign import Training
from harness.config.persona import Persona
from harness.drivers.mixture import Mixture, Player, mixture_of
from harness.drivers.policy_file import Policy
from harness.environments.arena import Arena, Seat
from harness.environments.joined_vec_env import JoinedVecEnv
from harness.environments.vector_env import ArenaVecEnv, GamesVecEnv
from harness.game.attention import HumanFactors
from harness.game.initial_state import StartDistribution
from harness.game.observation_layout import OF_OTHERS
from harness.game.seeding import seed_of
from harness.game.state import Outcome
from harness.traffic.scene import OpenScene
from harness.training.callbacks import CurveRecorder, DeviationBound
from harness.training.checkpoint import Progress, policy_of, put_policy, read_checkpoint, write_checkpoint
from harness.training.compiled_ppo import CompiledPPO
from harness.training.early_stopping import has_converged, still_fails

_GAE_LAMBDA = 0.95
_ALGORITHMS: dict[str, type[PPO]] = {"compiled": CompiledPPO, "stable_baselines3": PPO}


@dataclass(frozen=True, kw_only=True)
class LearningPlace:
    """A place of the scene in which the learner drives in a part of the games, and who drives in the others."""

    learner: int
    """The player."""
    drivers: tuple[Mixture | None, ...]
    """[P]; None: the learner's own place, or no one drives there."""


@dataclass(frozen=True, kw_only=True)
class TrainingSpec:
    """The inputs of a training: learner, personas (payoff and human factors), opponent, initial policy, settings."""

    scene: OpenScene
    learner: int
    personas: tuple[Persona, Persona]  # of the ego's seat and of the non-ego's
    opponent: Player
    """The driver of the other player; None: the learner is alone in every game."""
    alone_share: float
    """Share of the games without the opponent."""
    attentive_share: float
    """Share of the budget, from its start, without lapses of attention."""
    initial: Policy | None
    """The policy that training starts from; None: random parameters."""
    settings: Training
    parts: tuple[str | int, ...]
    """They name the random numbers of the training."""
    places: tuple[LearningPlace, ...] = ()
    """With several people: each has an equal part of the games, and `opponent` is not used. Left out: the place of
    `learner`, beside `opponent`."""
    as_it_drives: bool = False
    """Train with all human factors of the persona, as in assessment: a best response is computed under the limits under
    which it is assessed."""


@dataclass(frozen=True, kw_only=True)
class Trained:
    """The result of a training."""

    policy: Policy
    progress: Progress
    stopped: str
    """The reason for the end: "converged" or "budget"."""


def train(
    spec: TrainingSpec,
    checkpoint: Path,
    key: str,
    card: dict[str, Any],
    tensorboard: Path | None = None,
    on_progress: Callable[[int, int], None] = lambda done, total: None,
    on_start: Callable[[int], None] = lambda segment: None,
) -> Trained:
    """Train until convergence or the end of the budget. Training continues from `checkpoint` if it has this `key`.

    `card` is the metadata of the policy. `on_progress` gets the number of finished steps and their total after each
    rollout, `on_start` the number of each segment before it starts.
    Raises FloatingPointError if a parameter is not finite or a number of a game is impossible (`game.sanity_checks`),
    SimulationError if SUMO fails, ValueError if the initial policy does not fit the network.
    """
    torch.set_num_threads(1)
    environment = _environment(spec)
    try:
        model = _learner(spec, environment, tensorboard)
        new = Progress(segments=0, steps=0, segment_payoffs=[], curve=[], alone_games=[], alone_failures=[])
        progress = read_checkpoint(model, key, checkpoint) or new
        while (stopped := _stop_reason(spec, progress)) is None:
            on_start(progress.segments)
            progress = _segment(spec, model, environment, progress=progress, on_progress=on_progress)
            write_checkpoint(model, progress, key, checkpoint)
        return Trained(policy=policy_of(model, card), progress=progress, stopped=stopped)
    finally:
        environment.close()


def _stop_reason(spec: TrainingSpec, progress: Progress) -> str | None:
    """The reason to stop, or None. It is checked before each segment, so that a training continued from a finished
    training's checkpoint stops as well."""
    settings = spec.settings
    attentive = ceil(_attentive_steps(spec) / settings.segment_steps)
    fails = still_fails(progress.alone_games, progress.alone_failures)
    if settings.early_convergence and not fails and has_converged(progress.segment_payoffs[attentive:]):
        return "converged"
    return "budget" if progress.steps >= settings.steps else None


def _environment(spec: TrainingSpec) -> GamesVecEnv:
    places, games = _places(spec), spec.settings.games
    environments: list[ArenaVecEnv] = []
    try:
        for number, place in enumerate(places):
            own_games = games // len(places) + (number < games % len(places))
            environments.append(_environment_of(spec, place, own_games, parts=_parts_of(spec, place, *spec.parts)))
    except BaseException:
        for each in environments:
            each.close()
        raise
    return environments[0] if len(environments) == 1 else JoinedVecEnv(environments)


def _environment_of(spec: TrainingSpec, place: LearningPlace, games: int, parts: tuple[str | int, ...]) -> ArenaVecEnv:
    empty = [Seat(None)]  # of a player that is in no game
    seats = [
        [Seat(each.driver) for each in driver.members] if driver is not None else empty for driver in place.drivers
    ]
    seats[place.learner] = [Seat(None, spec.personas[spec.learner].payoff)]
    arena = Arena(spec.scene, games, seats, seed=seed_of(*spec.parts, "sumo") % 2**31)
    scale = spec.settings.payoff_scale
    return ArenaVecEnv(arena, place.learner, _start_distribution(spec, place, 0), *parts, payoff_scale=scale)


def _places(spec: TrainingSpec) -> tuple[LearningPlace, ...]:
    if spec.places:
        return spec.places
    drivers: list[Mixture | None] = [None, None]
    if spec.opponent is not None:
        drivers[1 - spec.learner] = mixture_of(spec.opponent, spec.personas[1 - spec.learner])
    return (LearningPlace(learner=spec.learner, drivers=tuple(drivers)),)


def _parts_of(spec: TrainingSpec, place: LearningPlace, *parts: str | int) -> tuple[str | int, ...]:
    """The parts that name the random numbers of the games in a place."""
    return (*parts, "place", place.learner) if spec.places else parts


def _sample(spec: TrainingSpec, environment: GamesVecEnv, steps: int, *parts: str | int) -> None:
    """Draw the next games from these parts, `steps` after the start of the training."""
    environments = environment.environments if isinstance(environment, JoinedVecEnv) else (environment,)
    for place, each in zip(_places(spec), environments, strict=True):
        assert isinstance(each, ArenaVecEnv)
        each.sample_from(_start_distribution(spec, place, steps), *_parts_of(spec, place, *parts))


def _start_distribution(spec: TrainingSpec, place: LearningPlace, steps: int) -> StartDistribution:
    """The start distribution of the games in a place, `steps` after the start of the training."""
    players, alone = len(place.drivers), not any(place.drivers)
    present = [0.0 if alone else 1.0 - spec.alone_share] * players
    present[place.learner] = 1.0
    human_factors, shares = _factors_beside(spec, place)
    # A learner that overlooks a vehicle without harm learns nothing from it. So it trains with blind-spot checks and
    # without looked-but-failed-to-see errors; its persona's own values apply when it drives. Its other limits
    # (reaction, sight, controls) apply from the start of the training.
    own = spec.personas[spec.learner].human_factors
    own_factors = own if spec.as_it_drives else own.with_open_eyes
    human_factors[place.learner], shares[place.learner] = [own_factors], [1.0]
    if steps < _attentive_steps(spec):
        human_factors = [[replace(each, attention=None) for each in of_player] for of_player in human_factors]
    return spec.scene.start_distribution(human_factors, present, shares, spec.settings.along_route_share)


def _factors_beside(spec: TrainingSpec, place: LearningPlace) -> tuple[list[list[HumanFactors]], list[list[float]]]:
    """Human factors and shares [P] of the drivers' members; those of the other persona where no one drives."""
    absent = [spec.personas[1 - spec.learner].human_factors]
    factors = [absent if driver is None else driver.human_factors for driver in place.drivers]
    return factors, [[1.0] if driver is None else driver.shares for driver in place.drivers]


def _attentive_steps(spec: TrainingSpec) -> float:
    """Steps at the start of the training without lapses of attention; 0 if no persona has lapses."""
    place = _places(spec)[0]
    beside, _ = _factors_beside(spec, place)
    beside[place.learner] = [spec.personas[spec.learner].human_factors]
    lapses = any(each.attention is not None for of_player in beside for each in of_player)
    return spec.attentive_share * spec.settings.steps if lapses else 0.0


def _learner(spec: TrainingSpec, environment: GamesVecEnv, tensorboard: Path | None) -> PPO:
    settings = spec.settings
    set_random_seed(seed_of(*spec.parts, "parameters") % 2**32)
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
        _zero_other_weights(model)
    return model


def _zero_other_weights(model: PPO) -> None:
    """Set the weights of the entries of other road users to zero: a learner that is always alone ignores them."""
    extractor: Any = model.policy.mlp_extractor
    with torch.no_grad():
        for network in (extractor.policy_net, extractor.value_net):
            network[0].weight[:, torch.as_tensor(OF_OTHERS)] = 0.0


def _segment(
    spec: TrainingSpec,
    model: PPO,
    environment: GamesVecEnv,
    *,
    progress: Progress,
    on_progress: Callable[[int, int], None],
) -> Progress:
    parts = (*spec.parts, "segment", progress.segments)
    set_random_seed(seed_of(*parts, "learner") % 2**32)
    _sample(spec, environment, progress.steps, *parts)
    environment.reload(seed_of(*parts, "sumo") % 2**31)
    steps = min(spec.settings.segment_steps, spec.settings.steps - progress.steps)
    curve = CurveRecorder(
        environment,
        progress,
        steps=spec.settings.steps,
        step_s=spec.scene.world.step_s,
        on_progress=on_progress,
    )
    model.num_timesteps = progress.steps
    model._last_obs = None  # SB3 then resets the games
    try:
        bound = DeviationBound(spec.settings.max_deviation)
        model.learn(steps, callback=[curve, bound], reset_num_timesteps=False)
    except FloatingPointError as error:
        raise FloatingPointError(f"{error}, after {model.num_timesteps} steps") from error
    for name, value in model.policy.state_dict().items():
        if not torch.isfinite(value).all():
            raise FloatingPointError(f"parameter {name} is not finite after {model.num_timesteps} steps")
    payoffs = [game.payoff for game in curve.games]
    alone = [game.outcome is not Outcome.GOAL for game in curve.games if game.alone]
    mean = float(np.mean(payoffs)) if payoffs else float("-inf")
    return Progress(
        segments=progress.segments + 1,
        steps=model.num_timesteps,
        segment_payoffs=[*progress.segment_payoffs, mean],
        curve=curve.windows,
        alone_games=[*progress.alone_games, len(alone)],
        alone_failures=[*progress.alone_failures, sum(alone)],
    )
