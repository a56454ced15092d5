"""A rule-based driver: it cruises, keeps its lane, and reacts to danger as its document says.

The reference drivers of UN R157 define only the reaction to danger. Cruising and steering are not part of them: they
come from the adaptive cruise control and the lane keeping of the same document. During the reaction time the driver
continues the request of the step before, because the foot is still on its way to the brake.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import NamedTuple, TypeAlias

import numpy as np

from harness.config.rule_driver import (
    REACTIONS,
    CarefulAndCompetent,
    Cruise,
    EmergencyBraking,
    FuzzySafety,
    LaneKeeping,
    Rss,
    Rules,
)
from harness.drivers import emergency_braking
from harness.drivers.adaptive_cruise import cruise_mps2
from harness.drivers.car import Car, car_of
from harness.drivers.ordinary_walker import OrdinaryWalker
from harness.drivers.perception import Encounters, OwnMotion, perceive
from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.bicycle import followed_share
from harness.game.world import World

CALM_S = 1.0
"""After this time without danger, the next danger needs the full reaction time again."""
_CRUISING, _REQUESTED = 3, 4
"""Rows of a driver's state, after those of `ReactionState`: what cruise control and driver requested last, in m/s²."""
_Law: TypeAlias = EmergencyBraking | CarefulAndCompetent | Rss | FuzzySafety

_LANE_KEEPER = Rules(
    kind="rules",
    name="lane_keeper",
    description="Cruises and keeps its lane, with so little inertia that its actions follow from what it sees.",
    cruise=Cruise(max_jerk_mps3=50.0),
    lane_keeping=LaneKeeping(max_lateral_jerk_mps3=20.0),
)


@dataclass(frozen=True, kw_only=True)
class BrakeReaction:
    """Parameters of a driver's reaction to danger."""

    reaction_s: float = 0.0
    jerk_mps3: float = 0.0
    coasting_mps2: float = 0.0
    """Deceleration of the car while its driver reacts."""


class ReactionState(NamedTuple):
    """State of the reaction in each game, [N] each."""

    reacted_s: FloatArray
    """Time spent reacting."""
    calm_s: FloatArray
    """Time without danger."""
    braking_mps2: FloatArray
    """Braking built up so far."""


def react(
    state: ReactionState, *, danger: BoolArray, demand_mps2: FloatArray, parameters: BrakeReaction, step_s: float
) -> tuple[ReactionState, BoolArray, FloatArray]:
    """One step of N games: the new state, the games [N] in which the driver still reacts, and the braking [N], 0 in
    games without danger."""
    reacted, calm, braking = state
    reacting = danger & (reacted < parameters.reaction_s - 1e-9)
    acting = danger & ~reacting
    braking = np.where(acting, np.minimum(braking + parameters.jerk_mps3 * step_s, demand_mps2), braking)
    braking = np.where(reacting, np.maximum(braking, parameters.coasting_mps2), braking)
    reacted = np.where(reacting, reacted + step_s, reacted)
    calm = np.where(danger, 0.0, calm + step_s)
    over = calm >= CALM_S - 1e-9
    updated = ReactionState(np.where(over, 0.0, reacted), calm, np.where(over, 0.0, braking))
    return updated, reacting, np.where(danger, braking, 0.0)


def steering_rad(
    motion: OwnMotion, *, law: LaneKeeping, wheelbase_m: float, step_s: float, lag_s: float = 0.0
) -> FloatArray:
    """Steering angle to request (Stanley's law: Hoffmann et al. 2007, Autonomous Automobile Trajectory Tracking,
    with feedforward of the path's curvature, as the observation gives it):

        steering = atan(wheelbase curvature) + heading_gain turned + atan(offset_gain left / (v + softening))

    where `turned` is the direction of the path relative to that in which the middle of the car moves when it follows
    the path, and `left` is the distance of the path to the left of the front axle. In a bend a car on its path points
    outwards by the steady-state yaw of that paper, atan(tan(steering) / 2): without this term it would cut the bend.
    The angle and its rate are limited so that lateral acceleration and lateral jerk stay within UN R79. What is
    requested leads to this angle within a step: the lag of the steering is known.
    """
    steady_yaw = np.arctan(0.5 * np.tan(motion.road_steering_rad))
    turned, speed = motion.path_turned_rad[:, 0] - steady_yaw, motion.speed_mps
    left = motion.path_left_m + 0.5 * wheelbase_m * np.sin(turned)
    wanted = (
        motion.road_steering_rad
        + law.heading_gain * turned
        + np.arctan(law.offset_gain_per_s * left / (speed + law.softening_mps))
    )
    speed2 = np.maximum(speed, 0.5) ** 2
    largest = np.arctan(wheelbase_m * law.max_lateral_mps2 / speed2)
    rate = wheelbase_m * law.max_lateral_jerk_mps3 * step_s / speed2
    wanted = np.clip(wanted, -largest, largest)
    turn = np.clip(wanted - motion.steering_rad, -rate, rate)
    return motion.steering_rad + turn / followed_share(step_s, lag_s)


class RulesDriver:
    """Drives one player's car by a document's rules, in any number of games at once."""

    takes_over = True

    def __init__(self, rules: Rules, car: Car) -> None:
        self._rules, self._car = rules, car
        tables: list[_Law | None] = [getattr(rules, name) for name in REACTIONS]
        self._law = next((table for table in tables if table is not None), None)
        self._reaction = _reaction_by(self._law)
        wheelbase_m, lag_s = car.limits["wheelbase_m"], car.limits["steering_lag_s"]
        self._steering_rad = partial(
            steering_rad, law=rules.lane_keeping, wheelbase_m=wheelbase_m, step_s=car.step_s, lag_s=lag_s
        )
        self._state: FloatArray = np.zeros((_REQUESTED + 1, 0))

    def reset(self, games: IntArray) -> None:
        """Reset games [N]: no reaction is under way."""
        missing = int(games.max(initial=-1)) + 1 - self._state.shape[1]
        self._state = np.pad(self._state, ((0, 0), (0, max(missing, 0))))
        self._state[:, games] = 0.0

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        """Actions [N, 2] from observations [N, SIZE]. Decisions are deterministic: `noise` is not used."""
        state, rules, car = self._state, self._rules, self._car
        motion, encounters = perceive(car, observation)
        before_mps2 = state[_CRUISING, games]
        cruising = cruise_mps2(motion, encounters, before_mps2=before_mps2, law=rules.cruise, step_s=car.step_s)
        requested = self._react(games, motion, encounters, cruising)
        state[_CRUISING, games], state[_REQUESTED, games] = cruising, requested
        return car.actions(requested, self._steering_rad(motion), observation)

    def sees_danger(self, observation: FloatArray) -> BoolArray:
        """[N] whether the rules say danger for observations [N, SIZE], with no reaction under way."""
        motion, encounters = perceive(self._car, observation)
        dangers, _ = self._dangers(motion, encounters, braking_mps2=np.zeros(len(observation)))
        return np.any(dangers, axis=1)

    def _react(
        self, games: IntArray, motion: OwnMotion, encounters: Encounters, cruising_mps2: FloatArray
    ) -> FloatArray:
        """[N] acceleration to request: that of the cruise control, or the reaction to danger where it is lower."""
        before = ReactionState(*self._state[:_CRUISING, games])
        dangers, demands = self._dangers(motion, encounters, before.braking_mps2)
        after, reacting, braking = react(
            before,
            danger=np.any(dangers, axis=1),
            demand_mps2=np.where(dangers, demands, 0.0).max(axis=1),
            parameters=self._reaction,
            step_s=self._car.step_s,
        )
        self._state[:_CRUISING, games] = after
        continued = np.minimum(self._state[_REQUESTED, games], -self._reaction.coasting_mps2)
        return np.where(reacting, continued, np.minimum(cruising_mps2, np.where(braking > 0.0, -braking, np.inf)))

    def _dangers(
        self, motion: OwnMotion, encounters: Encounters, braking_mps2: FloatArray
    ) -> tuple[BoolArray, FloatArray]:
        """[N, K] road users that are a danger, and the braking that each requires; `braking_mps2` is under way."""
        own, braking = motion.speed_mps[:, None], braking_mps2[:, None]
        match self._law:
            case None:
                return np.zeros_like(encounters.seen), np.zeros(encounters.seen.shape)
            case EmergencyBraking() as law:
                return emergency_braking.emergency(encounters, own, braking > law.warning_braking_mps2, law)
            case CarefulAndCompetent() as law:
                return emergency_braking.careful_and_competent(encounters, own, braking > law.coasting_mps2, law)
            case Rss() as law:
                return emergency_braking.rss(encounters, own, law)
            case FuzzySafety() as law:
                return emergency_braking.fuzzy(encounters, own, motion.acceleration_mps2[:, None], law)


def _reaction_by(law: _Law | None) -> BrakeReaction:
    match law:
        case None:
            return BrakeReaction()
        case EmergencyBraking():
            return BrakeReaction(jerk_mps3=law.build_up_mps3)
        case CarefulAndCompetent(coasting_mps2=coasting_mps2):
            return BrakeReaction(reaction_s=law.reaction_s, jerk_mps3=law.jerk_mps3, coasting_mps2=coasting_mps2)
        case _:
            return BrakeReaction(reaction_s=law.reaction_s, jerk_mps3=law.jerk_mps3)


def lane_keeper(world: World, player: int) -> RulesDriver | OrdinaryWalker:
    """The driver that a player's new policies imitate, and that tries its route; on foot an ordinary walker."""
    return OrdinaryWalker(world, player) if world.walks[player] else RulesDriver(_LANE_KEEPER, car_of(world, player))
