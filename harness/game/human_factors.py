"""The human factors of a driver: what it sees and how exactly, reaction time, use of the car, and lapses of attention
(`game.lapses`).

The records have the keys of a persona's document. What they mean for one game is drawn before it starts.

The reaction time delays what a driver knows of the other players, and a lapse stops it: they are perceived as they
would be now if they had moved on at the speed and heading that they had when they were looked at. Their
drivers' own motion and the road are perceived at once, as people steer by what they feel and by the road ahead.

The errors of estimated distances and closing speeds are those of the human driver model (Treiber, Kesting and Helbing,
Delays, inaccuracies and anticipation in microscopic traffic models, Physica A 360, 2006, section 2.2): a distance s is
estimated as s exp(V w), and the error of a closing speed is s sigma w'. V is `distance_error`, sigma is
`closing_error_per_s`, and w and w' are autocorrelated normal processes of variance 1 and correlation time
`PERSISTENCE_S`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.jit import compiled
from harness.game.lapses import NOTICED_TTC_S, Attention, Lapses, PlayersLapses, lags
from harness.game.state import State, sight_cosine

PERSISTENCE_S = 20.0  # correlation time of estimation errors (Treiber, Kesting and Helbing 2006, table 1)


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


class ActuatorShares(NamedTuple):
    """Shares of the car's acceleration, braking and steering that the driver uses at full pedals and wheel."""

    throttle_share: float = 1.0
    braking_share: float = 1.0
    steering_share: float = 1.0


FULL_USE = ActuatorShares()


@dataclass(frozen=True, kw_only=True)
class HumanFactors:
    """The human factors of a driver; by default it has none."""

    attention: Attention | None = None
    sight: Sight = Sight()
    delay_s: tuple[float, float] = (0.0, 0.0)
    """The range of the reaction time, after which the motion of other players is perceived: uniform, for each game."""
    actuator_shares: ActuatorShares = FULL_USE

    @property
    def with_open_eyes(self) -> HumanFactors:
        """The same factors with every glance over the shoulder and no failure to see."""
        usual = Sight()
        names = ("no_shoulder_glance_share", "looked_but_failed_to_see_share", "noticed_within_m")
        return replace(self, sight=replace(self.sight, **{name: getattr(usual, name) for name in names}))


# --- limits of the body ----------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Limits:
    """The limits of one player in one game of T steps, drawn before the game starts."""

    delay_steps: int = 0
    sight_m: float = np.inf
    field_of_view_rad: float = np.inf
    estimation_errors: FloatArray | None = None
    """[T, 2] errors of estimated distances (share of the distance) and closing speeds (per second of distance)."""
    actuator_shares: ActuatorShares = FULL_USE


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
        self.lapses = PlayersLapses(games, players, steps)
        self._delay_steps: IntArray = np.zeros((games, players), dtype=np.int64)
        self._lags: IntArray = np.zeros((games, players, steps), dtype=np.int64)
        self._estimation_errors = np.zeros((games, players, steps, 2))
        self._actuator_shares = np.ones((games, players, 3))
        self.delays = self.misjudges = self.spares = False
        """Whether any player so far had a reaction time, estimation errors, or actuator shares below 1."""

    def reset(self, game: int, player: int, limits: Limits, lapses: Lapses, state: State) -> None:
        """Set a player's limits and lapses for a game that starts, and its sight in the state."""
        self._delay_steps[game, player] = limits.delay_steps
        self.lapses.reset(game, player, lapses)
        self._know(game, player, lapses.lapsed)
        self._actuator_shares[game, player] = limits.actuator_shares
        errors = limits.estimation_errors
        self._estimation_errors[game, player] = 0.0 if errors is None else errors
        state.sight_m[game, player] = limits.sight_m
        state.sight_cosine[game, player] = sight_cosine(limits.field_of_view_rad)
        first = self._estimation_errors[game, player, 0]
        state.distance_error[game, player], state.closing_error_per_s[game, player] = first
        self.delays |= limits.delay_steps > 0
        self.misjudges |= errors is not None
        self.spares |= limits.actuator_shares != FULL_USE

    def end_glances(self, state: State, leader_ttc_s: FloatArray) -> None:
        """End the glances of players that notice by peripheral sight that they close in on the vehicle ahead, from the
        next step on. `leader_ttc_s` are their times to collision with it [G, P]."""
        noticed = state.lapsed & self.lapses.held & (leader_ttc_s <= NOTICED_TTC_S)
        for game, player in np.argwhere(noticed).tolist():
            self._know(game, player, self.lapses.end(game, player, int(state.step[game])))

    def _know(self, game: int, player: int, lapsed: BoolArray) -> None:
        """Set the steps [T] of a player's game with a lapse, in which it does not see what others do."""
        delay_steps = int(self._delay_steps[game, player])
        self._lags[game, player] = lags(lapsed, delay_steps) if delay_steps else 0

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
