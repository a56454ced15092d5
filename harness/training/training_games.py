"""The games of a training: who learns in them in which place, beside which drivers, and from which starts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import floor

from harness.config.persona import Persona
from harness.config.training import Training
from harness.drivers.mixture import Mixture, factors_of, shares_of
from harness.drivers.policy_file import Policy
from harness.drivers.protocol import Driver
from harness.environments.auto_reset import Replays
from harness.environments.seats import Seat, seats_of
from harness.environments.vector_env import ArenaVecEnv, JoinedVecEnv, open_arenas
from harness.game.initial_state import StartDistribution
from harness.game.seeding import seed_of
from harness.road.scene.open_scene import OpenScene

ALONG_ROUTE_SHARE = 0.7
"""Share of the games without another player that start anywhere along the route, at any legal speed: a learner that
fails early sees the rest of its route too. Games with another player, and all games of an assessment, start as the
scene says: players that start apart seldom meet."""


@dataclass(frozen=True, kw_only=True)
class LearningPlace:
    """A place of a scene in which the learner drives in a part of the games, and who drives in the others."""

    scene: OpenScene
    player: int
    """The learner's place on the players' axis."""
    drivers: tuple[Mixture | None, ...]
    """[P]; None: the learner's own place, or no one drives there."""
    share: float = 1.0
    """Its share of the games, relative to those of the other places."""


@dataclass(frozen=True, kw_only=True)
class TrainingSpec:
    """The inputs of a training: who learns in which places, beside whom, from which parameters, by which settings."""

    personas: tuple[Persona, ...]
    """Of the learner: its payoff and human factors. Of several, each game has one, in equal shares, and the learner has
    as many inputs more, which say which."""
    places: tuple[LearningPlace, ...]
    """The first one is in the scene of the campaign, and the only one with replays."""
    alone_share: float
    """Share of the games without other players."""
    attentive_share: float
    """Share of the budget, from its start, without lapses of attention."""
    initial: Policy | None
    """The policy that training starts from; None: random parameters."""
    settings: Training
    parts: tuple[str | int, ...]
    """They name the random numbers of the training."""
    as_it_drives: bool = False
    """Train with all human factors of the persona, as in assessment: a best response is computed under the limits under
    which it is assessed."""
    best_known: Driver | None = None
    """Of an ego: the best known one. With it, the training replays starts by regret (`regret_starts`)."""

    @property
    def scene(self) -> OpenScene:
        """The scene of the campaign."""
        return self.places[0].scene

    @property
    def demonstration_steps(self) -> int:
        """Steps, over all games, that a rule-based driver shows: none of a policy that is given."""
        shown = min(self.settings.demonstration_steps, self.settings.steps // 5)
        return shown if self.initial is None else 0


def open_games(spec: TrainingSpec) -> JoinedVecEnv:
    """The games of a training; each of its places has an arena of its own, and they share SUMO where they can. Raises
    SimulationError if SUMO fails."""
    games = games_of_places(spec.settings.games, [place.share for place in spec.places])
    parts = []
    for place, own_games in zip(spec.places, games, strict=True):
        seats = [seats_of(each, paid=False) for each in place.drivers]
        seats[place.player] = tuple(Seat(None, each.payoff) for each in spec.personas)
        parts.append((place.scene, own_games, seats))
    environments = []
    for number, arena in enumerate(open_arenas(parts, seed=seed_of(*spec.parts, "sumo") % 2**31)):
        place = spec.places[number]
        starts, of_place = _start_distribution(spec, place, 0), _parts_of(number, *spec.parts)
        scale = spec.settings.payoff_scale
        environments.append(ArenaVecEnv(arena, place.player, starts, *of_place, payoff_scale=scale))
    return JoinedVecEnv(environments)


def games_of_places(games: int, shares: Sequence[float]) -> list[int]:
    """The games in each place, which add up to `games`: at least one in each, the others by the largest remainders,
    among equal ones those of the first places.

    >>> games_of_places(64, [5.0, 1.0])
    [53, 11]
    """
    exact = [games * share / sum(shares) for share in shares]
    whole = [max(1, floor(each)) for each in exact]
    by_remainder = sorted(range(len(shares)), key=lambda place: whole[place] - exact[place])
    while sum(whole) > games:
        whole[whole.index(max(whole))] -= 1
    for place in by_remainder[: games - sum(whole)]:
        whole[place] += 1
    return whole


def _parts_of(number: int, *parts: str | int) -> tuple[str | int, ...]:
    """The parts that name the random numbers of the games in a place: each place after the first has its own."""
    return (*parts, "place", number) if number else parts


def sample(
    spec: TrainingSpec,
    environment: JoinedVecEnv,
    steps: int,
    *parts: str | int,
    replays: Replays | None = None,
) -> None:
    """Draw the next games from these parts, `steps` after the start of the training; `replays` are those of the first
    place."""
    for number, (place, each) in enumerate(zip(spec.places, environment.environments, strict=True)):
        of_place = None if number else replays
        each.sample_from(_start_distribution(spec, place, steps), *_parts_of(number, *parts), replays=of_place)


def _start_distribution(spec: TrainingSpec, place: LearningPlace, steps: int) -> StartDistribution:
    alone = not any(place.drivers)
    present = [0.0 if alone else 1.0 - spec.alone_share] * len(place.drivers)
    present[place.player] = 1.0
    # A learner that overlooks a vehicle without harm learns nothing from it. So it trains with shoulder glances and
    # without looked-but-failed-to-see errors; its persona's own values apply when it drives. Its other limits
    # (reaction, sight, controls) apply from the start of the training.
    own = [each.human_factors for each in spec.personas]
    human_factors = [factors_of(each) for each in place.drivers]
    human_factors[place.player] = own if spec.as_it_drives else [each.with_open_eyes for each in own]
    if steps < attentive_steps(spec):
        human_factors = [[replace(each, attention=None) for each in of_player] for of_player in human_factors]
    shares = [shares_of(each) for each in place.drivers]
    shares[place.player] = [1.0] * len(own)
    return place.scene.start_distribution(human_factors, present, shares, ALONG_ROUTE_SHARE)


def attentive_steps(spec: TrainingSpec) -> float:
    """Steps at the start of the training without lapses of attention; 0 if no persona has lapses."""
    beside = [factors for driver in spec.places[0].drivers for factors in factors_of(driver)]
    own = (each.human_factors for each in spec.personas)
    lapses = any(each.attention is not None for each in (*own, *beside))
    return spec.attentive_share * spec.settings.steps if lapses else 0.0
