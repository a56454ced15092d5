"""Limits of the human body: reaction time, limited and inexact sight, partial use of the car.

The limits of a game are drawn before it starts. If no player of an arena has limits, the arena skips the queue of
decisions, the estimation errors and the actuator shares.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from harness.game.arrays import FloatArray, IntArray
from harness.game.jit import compiled
from harness.game.state import ALL_AROUND, State

PERSISTENCE_S = 20.0  # correlation time of estimation errors (Treiber, Kesting and Helbing 2006, table 1)


@dataclass(frozen=True)
class Reaction:
    """The delay from a decision to pedals and wheel: the range of a uniform draw for each game."""

    delay_s: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class Sight:
    """The range and the opening angle of sight, and the errors of estimated distances and closing speeds.

    The errors are those of the human driver model (Treiber, Kesting and Helbing, Delays, inaccuracies and anticipation
    in microscopic traffic models, Physica A 360, 2006, section 2.2): a distance s is estimated as s exp(V w), and the
    error of a closing speed is s sigma w'. V is `distance_error`, sigma is `closing_error_per_s`, and w and w' are
    autocorrelated normal processes of variance 1 and correlation time `error_s`.
    """

    range_m: float = np.inf
    opening_rad: float = np.inf
    """Angle, ahead of the car and half of it to each side, within which the centres of road users are seen."""
    distance_error: float = 0.0
    closing_error_per_s: float = 0.0
    error_s: float = PERSISTENCE_S


@dataclass(frozen=True, kw_only=True)
class LookedButFailedToSee:
    """Looked but failed to see: in `share` of the games, only road users within `within_m` are noticed."""

    share: float = 0.0
    within_m: float = np.inf


@dataclass(frozen=True, kw_only=True)
class ActuatorShares:
    """Shares of the car's acceleration, braking and steering that the driver uses at full pedals and wheel."""

    throttle: float = 1.0
    braking: float = 1.0
    steering: float = 1.0


NO_DELAY, EXACT_SIGHT, ALL_NOTICED, FULL_SHARES = Reaction(), Sight(), LookedButFailedToSee(), ActuatorShares()
"""No limits: no reaction delay, exact sight, every road user noticed, full use of the car."""


@dataclass(frozen=True, kw_only=True)
class Limits:
    """The limits of one player in one game of T steps, drawn before the game starts."""

    delay_steps: int = 0
    sight_m: float = np.inf
    opening_rad: float = np.inf
    estimation_errors: FloatArray | None = None
    """[T, 2] errors of estimated distances (share of the distance) and closing speeds (per second of distance)."""
    actuator_shares: tuple[float, float, float] = (1.0, 1.0, 1.0)
    """Shares of throttle, brake and wheel."""


NO_LIMITS = Limits()


def draw_delay_steps(reaction: Reaction, step_s: float, generator: np.random.Generator) -> int:
    """Draw a player's reaction delay for one game, in steps."""
    return round(generator.uniform(*reaction.delay_s) / step_s)


def draw_noticed_m(failure: LookedButFailedToSee, generator: np.random.Generator) -> float:
    """Draw the distance within which road users are noticed in one game; inf: no failure to see."""
    return failure.within_m if generator.random() < failure.share else np.inf


def draw_estimation_errors(sight: Sight, steps: int, step_s: float, generator: np.random.Generator) -> FloatArray:
    """[T, 2] errors of estimated distances (share) and closing speeds (per second of distance) for T = `steps`.

    Both processes start in their stationary distribution and have the correlation time `sight.error_s`.
    """
    processes = _autocorrelated(generator.standard_normal((steps, 2)), np.exp(-step_s / sight.error_s))
    distance = np.expm1(sight.distance_error * processes[:, 0])
    return np.stack((distance, sight.closing_error_per_s * processes[:, 1]), axis=1)


@compiled
def _autocorrelated(noise: FloatArray, correlation: float) -> FloatArray:
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
        self._games, self._players = np.arange(games)[:, None], np.arange(players)
        self._delay_steps: IntArray = np.zeros((games, players), dtype=np.int64)
        self._decisions = np.zeros((games, players, steps, 2))
        self._estimation_errors = np.zeros((games, players, steps, 2))
        self._actuator_shares = np.ones((games, players, 3))
        self.delays = self.misjudges = self.spares = False
        """Whether any player so far had a reaction delay, estimation errors, or actuator shares below 1."""

    def reset(self, game: int, player: int, limits: Limits, state: State) -> None:
        """Set a player's limits for a game that starts, and its sight in the state."""
        self._delay_steps[game, player] = limits.delay_steps
        self._actuator_shares[game, player] = limits.actuator_shares
        errors = limits.estimation_errors
        self._estimation_errors[game, player] = 0.0 if errors is None else errors
        state.sight_m[game, player] = limits.sight_m
        all_around = limits.opening_rad >= 2.0 * np.pi
        state.sight_cosine[game, player] = ALL_AROUND if all_around else np.cos(0.5 * limits.opening_rad)
        first = self._estimation_errors[game, player, 0]
        state.distance_error[game, player], state.closing_error_per_s[game, player] = first
        self.delays |= limits.delay_steps > 0
        self.misjudges |= errors is not None
        self.spares |= limits.actuator_shares != NO_LIMITS.actuator_shares

    def arriving(self, decided: FloatArray, now: IntArray) -> FloatArray:
        """[G, P, 2] decisions that reach pedals and wheel in the steps `now` [G].

        `decided` [G, P, 2] are the decisions of these steps. Until a player's first decision arrives, its pedals are
        released and its wheel is straight.
        """
        self._decisions[self._games, self._players, now[:, None]] = decided
        decided_in = now[:, None] - self._delay_steps
        arrived = self._decisions[self._games, self._players, np.maximum(decided_in, 0)]
        return np.where(decided_in[..., None] >= 0, arrived, 0.0)

    def within(self, acceleration: FloatArray, steering: FloatArray) -> tuple[FloatArray, FloatArray]:
        """[G, P] requested accelerations and steering angles, scaled by the players' actuator shares."""
        throttle, braking, wheel = np.moveaxis(self._actuator_shares, -1, 0)
        return acceleration * np.where(acceleration >= 0.0, throttle, braking), steering * wheel

    def look(self, state: State) -> None:
        """Set the players' current estimation errors in the state."""
        now = np.minimum(state.step, self._estimation_errors.shape[2] - 1)
        errors = self._estimation_errors[self._games, self._players, now[:, None]]
        state.distance_error, state.closing_error_per_s = errors[..., 0].copy(), errors[..., 1].copy()
