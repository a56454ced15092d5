"""The human factors of a driver: lapses of attention, what it sees and how exactly, reaction time, use of the car.

The records have the keys of a persona's document. What they mean for one game is drawn before it starts.

During a lapse of attention the driver's actions are omitted. Paper, section 4.3.2: the distracted driver "omits atomic
actions from the RL model during random intervals", of about 5 s each, the time that reading a text message takes
(NHTSA). The paper's driver releases pedals and wheel, and the car drifts. A glance at a telephone holds them: the
pedals stay as they are, and the wheel follows the road by peripheral sight.

The reaction time delays what a driver knows of the other players, and a lapse stops it: they are perceived as they
would be now if they had moved on at the speed and heading that they had when they were looked at (`lags`). Their
drivers' own motion and the road are perceived at once, as people steer by what they feel and by the road ahead.

The errors of estimated distances and closing speeds are those of the human driver model (Treiber, Kesting and Helbing,
Delays, inaccuracies and anticipation in microscopic traffic models, Physica A 360, 2006, section 2.2): a distance s is
estimated as s exp(V w), and the error of a closing speed is s sigma w'. V is `distance_error`, sigma is
`closing_error_per_s`, and w and w' are autocorrelated normal processes of variance 1 and correlation time
`PERSISTENCE_S`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, exp, log
from typing import Literal

import numpy as np

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.jit import compiled
from harness.game.seeding import between
from harness.game.state import State, sight_cosine

Controls = Literal["released", "held"]

_QUANTILE_95 = 1.6449  # of the standard normal distribution
PERIPHERAL_S = 2.0
"""Time constant with which peripheral sight turns a car to the direction of the road in a glance. Chosen here."""
PERSISTENCE_S = 20.0  # correlation time of estimation errors (Treiber, Kesting and Helbing 2006, table 1)


@dataclass(frozen=True, kw_only=True)
class Attention:
    """When attention lapses, and what the car does in a lapse.

    The time between lapses is exponentially distributed. The length of a lapse is drawn uniformly from `lapse_s`, or
    from the lognormal distribution whose middle 90 % it is. During a lapse, pedals and wheel are released or held.
    Bumps add an angle to the wheel that is drawn for each lapse from a normal distribution.
    """

    mean_attentive_s: float
    lapse_s: tuple[float, float]
    lapse_distribution: Literal["uniform", "lognormal"] = "uniform"
    controls: Controls = "released"
    bump_steering_sd_rad: float = 0.0

    @property
    def mean_lapse_s(self) -> float:
        """The mean length of a lapse."""
        if self.lapse_distribution == "uniform":
            return 0.5 * sum(self.lapse_s)
        mean, deviation = self._of_logarithm
        return exp(mean + 0.5 * deviation**2)

    def lapse_at_s(self, generator: np.random.Generator) -> float:
        """Draw the length of a lapse."""
        if self.lapse_distribution == "uniform":
            return between(self.lapse_s, generator.random())
        return float(generator.lognormal(*self._of_logarithm))

    @property
    def _of_logarithm(self) -> tuple[float, float]:
        """Mean and standard deviation of the logarithm of a lapse's length."""
        low, high = map(log, self.lapse_s)
        return 0.5 * (low + high), (high - low) / (2.0 * _QUANTILE_95)


@dataclass(frozen=True, kw_only=True)
class Sight:
    """What a driver sees of other road users, by their centres, and how exactly.

    It sees directly what is within its field of view. Mirrors show what is behind it, but not the blind spot (the
    adjacent zones of ISO 17387): up to `BLIND_BESIDE_M` beside the car and back to `BLIND_BEHIND_M` behind its rear.
    There, and beside the field of view, it sees with a glance over the shoulder, which it omits in a share of the
    games. In another share it looks but fails to see: it notices only those within `noticed_within_m`.
    """

    no_shoulder_glance_share: float = 0.0
    looked_but_failed_to_see_share: float = 0.0
    noticed_within_m: float = np.inf
    range_m: float = np.inf
    field_of_view_deg: float = np.inf
    """Angle, ahead of the car and half of it to each side, within which road users are seen directly."""
    distance_error: float = 0.0
    closing_error_per_s: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Reaction:
    """The delay with which the motion of the other players is perceived: the range of a draw for each game, uniform."""

    delay_s: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class ActuatorShares:
    """Shares of the car's acceleration, braking and steering that the driver uses at full pedals and wheel."""

    throttle_share: float = 1.0
    braking_share: float = 1.0
    steering_share: float = 1.0


@dataclass(frozen=True, kw_only=True)
class HumanFactors:
    """The human factors of a driver; by default it has none."""

    attention: Attention | None = None
    sight: Sight = Sight()
    reaction: Reaction = Reaction()
    actuator_shares: ActuatorShares = ActuatorShares()

    @property
    def with_open_eyes(self) -> HumanFactors:
        """The same factors with every glance over the shoulder and no failure to see."""
        usual = Sight()
        names = ("no_shoulder_glance_share", "looked_but_failed_to_see_share", "noticed_within_m")
        return replace(self, sight=replace(self.sight, **{name: getattr(usual, name) for name in names}))


# --- lapses of attention ---------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Lapses:
    """The lapses of one player in a game of T steps, drawn before the game starts."""

    lapsed: BoolArray  # [T]
    steering_rad: FloatArray  # [T] steering angle that bumps give the wheel in a lapse
    held: bool = False  # whether pedals and wheel are held in a lapse, or released

    @classmethod
    def none(cls, steps: int) -> Lapses:
        """No lapse in a game of `steps` steps."""
        return cls(np.zeros(steps, dtype=bool), np.zeros(steps))

    def lags(self, delay_steps: int) -> IntArray:
        """[T] how many steps old is what the player knows of the others: the reaction time, and more as long as the
        player did not look then; from the first step on at most the steps played."""
        steps = np.arange(len(self.lapsed))
        looked = np.maximum.accumulate(np.where(self.lapsed, 0, steps))
        return steps - looked[np.maximum(steps - delay_steps, 0)]


def draw_lapses(attention: Attention, steps: int, step_s: float, generator: np.random.Generator) -> Lapses:
    """Draw the lapses of one player for a game of `steps` steps of `step_s` seconds.

    Lapses also occur before the game. The probability that a game starts within a lapse is therefore the long-run
    share of time in lapses (stationary start of a renewal process).
    """
    lapses = replace(Lapses.none(steps), held=attention.controls == "held")
    starts_within = generator.random() < attention.mean_lapse_s / (attention.mean_lapse_s + attention.mean_attentive_s)
    elapsed_share = generator.random() if starts_within else 0.0  # part of the first lapse before the game
    time_s = 0.0 if starts_within else generator.exponential(attention.mean_attentive_s)
    attentive_from = 0
    while time_s < steps * step_s:
        duration_s = attention.lapse_at_s(generator) * (1.0 - elapsed_share)
        steering_rad = generator.normal(0.0, attention.bump_steering_sd_rad)
        first = max(ceil(time_s / step_s), attentive_from)
        end = first + max(round(duration_s / step_s), 1)
        lapses.lapsed[first:end], lapses.steering_rad[first:end] = True, steering_rad
        attentive_from = end + 1  # one attentive step keeps two lapses apart
        time_s += duration_s + generator.exponential(attention.mean_attentive_s)
        elapsed_share = 0.0
    return lapses


@compiled
def release_controls(
    requested: tuple[FloatArray, FloatArray],
    held: tuple[FloatArray, FloatArray],
    lapses: tuple[BoolArray, BoolArray, FloatArray],
    step: IntArray,
    drove: BoolArray,
) -> BoolArray:
    """Release or hold pedals and wheel of the players whose attention lapses in this step.

    The requested accelerations and steering angles [G, P] are changed in place. Released: no acceleration, and the
    angle that bumps give the wheel. Held: the accelerations and steering angles of `held` [G, P], the latter with the
    angle of the bumps. `lapses` are the steps with a lapse [G, P, T], whether a player holds pedals and wheel [G, P],
    and the steering angles of the bumps [G, P, T]; step [G] the current steps, drove [G, P] the players that still
    drive. Returns [G, P]: the players with a lapse.
    """
    (acceleration_mps2, steering_rad), (lapsed, holds, bump_rad) = requested, lapses
    inattentive = np.zeros(drove.shape, dtype=np.bool_)
    for g, p in np.ndindex(drove.shape):
        if drove[g, p] and lapsed[g, p, step[g]]:
            inattentive[g, p] = True
            acceleration_mps2[g, p], steering_rad[g, p] = 0.0, bump_rad[g, p, step[g]]
            if holds[g, p]:
                acceleration_mps2[g, p] = held[0][g, p]
                steering_rad[g, p] += held[1][g, p]
    return inattentive


def held_steering_rad(state: State, road: tuple[FloatArray, FloatArray], wheelbase_m: FloatArray) -> FloatArray:
    """[G, P] the steering angles of players who look away and hold the wheel: they follow the road, and turn the car to
    its direction. `road` are the steering angles that follow it and its headings [G, P]; wheelbases are [P]."""
    follows_rad, heading_rad = road
    turned_rad = (heading_rad - state.heading_rad + np.pi) % (2.0 * np.pi) - np.pi
    return follows_rad + np.arctan(wheelbase_m * turned_rad / (PERIPHERAL_S * np.maximum(state.speed_mps, 1.0)))


# --- limits of the body ----------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Limits:
    """The limits of one player in one game of T steps, drawn before the game starts."""

    delay_steps: int = 0
    sight_m: float = np.inf
    field_of_view_rad: float = np.inf
    estimation_errors: FloatArray | None = None
    """[T, 2] errors of estimated distances (share of the distance) and closing speeds (per second of distance)."""
    actuator_shares: tuple[float, float, float] = (1.0, 1.0, 1.0)
    """Shares of throttle, brake and wheel."""


NO_LIMITS = Limits()


BLIND_BESIDE_M, BLIND_BEHIND_M = 3.0, 3.0
"""Extent of the blind spot beside the flank and behind the rear of a car: the adjacent zones of ISO 17387."""


def glances_over_shoulder(sight: Sight, draw: float) -> bool:
    """Whether a player glances over the shoulder in one game, from a number drawn uniformly from 0 to 1."""
    return draw >= sight.no_shoulder_glance_share


def draw_estimation_errors(sight: Sight, steps: int, step_s: float, generator: np.random.Generator) -> FloatArray:
    """[T, 2] errors of estimated distances (share) and closing speeds (per second of distance) for T = `steps`.

    Both processes start in their stationary distribution and have the correlation time `PERSISTENCE_S`.
    """
    processes = autocorrelated(generator.standard_normal((steps, 2)), np.exp(-step_s / PERSISTENCE_S))
    distance = np.expm1(sight.distance_error * processes[:, 0])
    return np.stack((distance, sight.closing_error_per_s * processes[:, 1]), axis=1)


@compiled
def autocorrelated(noise: FloatArray, correlation: float) -> FloatArray:
    """[T, N] stationary processes of order 1 and variance 1: x' = c x + sqrt(1 - c^2) noise, c the correlation."""
    processes = noise.copy()
    innovation = np.sqrt(1.0 - correlation * correlation)
    for step in range(1, noise.shape[0]):
        for column in range(noise.shape[1]):
            processes[step, column] = correlation * processes[step - 1, column] + innovation * noise[step, column]
    return processes


class PlayersLimits:
    """The limits of the players of G games that are played together."""

    def __init__(self, games: int, players: int, steps: int) -> None:
        self._lags: IntArray = np.zeros((games, players, steps), dtype=np.int64)
        self._estimation_errors = np.zeros((games, players, steps, 2))
        self._actuator_shares = np.ones((games, players, 3))
        self.delays = self.misjudges = self.spares = False
        """Whether any player so far had a reaction time, estimation errors, or actuator shares below 1."""

    def reset(self, game: int, player: int, limits: Limits, lapses: Lapses, state: State) -> None:
        """Set a player's limits for a game that starts, and its sight in the state."""
        self._lags[game, player] = lapses.lags(limits.delay_steps) if limits.delay_steps else 0
        self._actuator_shares[game, player] = limits.actuator_shares
        errors = limits.estimation_errors
        self._estimation_errors[game, player] = 0.0 if errors is None else errors
        state.sight_m[game, player] = limits.sight_m
        state.sight_cosine[game, player] = sight_cosine(limits.field_of_view_rad)
        first = self._estimation_errors[game, player, 0]
        state.distance_error[game, player], state.closing_error_per_s[game, player] = first
        self.delays |= limits.delay_steps > 0
        self.misjudges |= errors is not None
        self.spares |= limits.actuator_shares != NO_LIMITS.actuator_shares

    def lags(self, now: IntArray) -> IntArray:
        """[G, P] how many steps old is what the players know of each other in the steps `now` [G]."""
        return _lags(self._lags, now)

    def within(self, acceleration: FloatArray, steering: FloatArray) -> tuple[FloatArray, FloatArray]:
        """[G, P] requested accelerations and steering angles, scaled by the players' actuator shares."""
        throttle, braking, wheel = np.moveaxis(self._actuator_shares, -1, 0)
        return acceleration * np.where(acceleration >= 0.0, throttle, braking), steering * wheel

    def look(self, state: State) -> None:
        """Set the players' current estimation errors in the state."""
        state.distance_error, state.closing_error_per_s = _errors(self._estimation_errors, state.step)


@compiled
def _lags(lags: IntArray, now: IntArray) -> IntArray:
    """[G, P] the entries of the steps `now` [G]; after the last step, those of the last one."""
    found = np.empty(lags.shape[:2], dtype=np.int64)
    for g, p in np.ndindex(found.shape):
        found[g, p] = lags[g, p, min(now[g], lags.shape[2] - 1)]
    return found


@compiled
def _errors(errors: FloatArray, now: IntArray) -> FloatArray:
    """[2, G, P] the same of estimation errors."""
    found = np.empty((2, *errors.shape[:2]))
    for g, p in np.ndindex(errors.shape[:2]):
        step = min(now[g], errors.shape[2] - 1)
        found[0, g, p], found[1, g, p] = errors[g, p, step, 0], errors[g, p, step, 1]
    return found
