"""The games of a training: who learns in them in which place, beside which drivers, and from which starts."""

from __future__ import annotations

from dataclasses import dataclass, replace

from harness.config.persona import Persona
from harness.config.training import Training
from harness.drivers.mixture import Mixture, Player, mixture_of
from harness.drivers.policy_file import Policy
from harness.environments.arena import Arena, Seat
from harness.environments.vector_env import ArenaVecEnv, GamesVecEnv, JoinedVecEnv
from harness.game.attention import HumanFactors
from harness.game.initial_state import StartDistribution
from harness.game.seeding import seed_of
from harness.traffic.scene import OpenScene

ALONG_ROUTE_SHARE = 0.7
"""Share of the games without another player that start anywhere along the route, at any legal speed: a learner that
fails early sees the rest of its route too. Games with another player, and all games of an assessment, start as the
scene says: players that start apart seldom meet."""


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


def open_games(spec: TrainingSpec) -> GamesVecEnv:
    """The games of a training; each of its places has an arena of its own. Raises SimulationError if SUMO fails."""
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


def sample(spec: TrainingSpec, environment: GamesVecEnv, steps: int, *parts: str | int) -> None:
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
    if steps < attentive_steps(spec):
        human_factors = [[replace(each, attention=None) for each in of_player] for of_player in human_factors]
    starts = spec.scene.start_distribution(human_factors, present, shares, ALONG_ROUTE_SHARE)
    return replace(starts, meet_in_place=True)


def _factors_beside(spec: TrainingSpec, place: LearningPlace) -> tuple[list[list[HumanFactors]], list[list[float]]]:
    """Human factors and shares [P] of the drivers' members; those of the other persona where no one drives."""
    absent = [spec.personas[1 - spec.learner].human_factors]
    factors = [absent if driver is None else driver.human_factors for driver in place.drivers]
    return factors, [[1.0] if driver is None else driver.shares for driver in place.drivers]


def attentive_steps(spec: TrainingSpec) -> float:
    """Steps at the start of the training without lapses of attention; 0 if no persona has lapses."""
    place = _places(spec)[0]
    beside, _ = _factors_beside(spec, place)
    beside[place.learner] = [spec.personas[spec.learner].human_factors]
    lapses = any(each.attention is not None for of_player in beside for each in of_player)
    return spec.attentive_share * spec.settings.steps if lapses else 0.0
