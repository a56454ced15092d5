"""The human factors of a driver: lapses of attention, what it sees and how exactly, reaction time, use of the car.

The records have the keys of a persona's document. What they mean for one game is drawn before it starts.

During a lapse of attention the driver's actions are omitted and the car drifts. Paper, section 4.3.2: the distracted
driver "omits atomic actions from the RL model during random intervals", of about 5 s each. This is the time that
reading a text message takes (NHTSA).

The errors of estimated distances and closing speeds are those of the human driver model (Treiber, Kesting and Helbing,
Delays, inaccuracies and anticipation in microscopic traffic models, Physica A 360, 2006, section 2.2): a distance s is
estimated as s exp(V w), and the error of a closing speed is s sigma w'. V is `distance_error`, sigma is
`closing_error_per_s`, and w and w' are autocorrelated normal processes of variance 1 and correlation time
`PERSISTENCE_S`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.jit import compiled
from harness.game.seeding import between
from harness.game.state import ALL_AROUND, State

PERSISTENCE_S = 20.0  # correlation time of estimation errors (Treiber, Kesting and Helbing 2006, table 1)


@dataclass(frozen=True, kw_only=True)
class Attention:
    """When attention lapses, and what the car does in a lapse.

    The time between lapses is exponentially distributed. A lapse lasts for a time drawn uniformly from `lapse_s`.
    During a lapse, pedals and wheel are released and the road steers: the crown of the road turns the wheel to the
    right, and bumps add an angle that is drawn for each lapse from a normal distribution.
    """

    mean_attentive_s: float
    lapse_s: tuple[float, float]
    crown_steering_rad: float = 0.0
    bump_steering_sd_rad: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Sight:
    """What a driver sees of other road users, by their centres, and how exactly.

    In a share of the games it does not check the mirrors and the blind spot: it sees only those at least
    `unseen_behind_m` ahead of its own centre. In another share it looks but fails to see: it notices only those within
    `noticed_within_m`.
    """

    no_blind_spot_check_share: float = 0.0
    unseen_behind_m: float = 0.0
    looked_but_failed_to_see_share: float = 0.0
    noticed_within_m: float = np.inf
    range_m: float = np.inf
    opening_deg: float = np.inf
    """Angle, ahead of the car and half of it to each side, within which road users are seen."""
    distance_error: float = 0.0
    closing_error_per_s: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Reaction:
    """The delay from a decision to pedals and wheel: the range of a uniform draw for each game."""

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
        """The same factors with every blind-spot check done and no failure to see."""
        usual, shares = Sight(), ("no_blind_spot_check_share", "looked_but_failed_to_see_share")
        names = (*shares, "unseen_behind_m", "noticed_within_m")
        return replace(self, sight=replace(self.sight, **{name: getattr(usual, name) for name in names}))


# --- lapses of attention ---------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Lapses:
    """The lapses of one player in a game of T steps, drawn before the game starts."""

    lapsed: BoolArray  # [T]
    steering_rad: FloatArray  # [T] steering angle that the road gives the wheel in a lapse

    @classmethod
    def none(cls, steps: int) -> Lapses:
        """No lapse in a game of `steps` steps."""
        return cls(np.zeros(steps, dtype=bool), np.zeros(steps))

    def with_reaction_delay(self, delay_steps: int) -> Lapses:
        """The same lapses, each longer by the steps that the first decision after it takes to reach the car."""
        steps = np.arange(len(self.lapsed))
        last = np.maximum.accumulate(np.where(self.lapsed, steps, -1 - len(steps)))
        released = steps - last <= delay_steps
        return Lapses(released, np.where(released, self.steering_rad[np.maximum(last, 0)], 0.0))


def draw_lapses(attention: Attention, steps: int, step_s: float, generator: np.random.Generator) -> Lapses:
    """Draw the lapses of one player for a game of `steps` steps of `step_s` seconds.

    Lapses also occur before the game. The probability that a game starts within a lapse is therefore the long-run
    share of time in lapses (stationary start of a renewal process).
    """
    lapses = Lapses.none(steps)
    mean_lapse_s = 0.5 * (attention.lapse_s[0] + attention.lapse_s[1])
    starts_within = generator.random() < mean_lapse_s / (mean_lapse_s + attention.mean_attentive_s)
    elapsed_share = generator.random() if starts_within else 0.0  # part of the first lapse before the game
    time_s = 0.0 if starts_within else generator.exponential(attention.mean_attentive_s)
    attentive_from = 0
    while time_s < steps * step_s:
        duration_s = between(attention.lapse_s, generator.random()) * (1.0 - elapsed_share)
        steering_rad = generator.normal(-attention.crown_steering_rad, attention.bump_steering_sd_rad)
        first = max(ceil(time_s / step_s), attentive_from)
        end = first + max(round(duration_s / step_s), 1)
        lapses.lapsed[first:end], lapses.steering_rad[first:end] = True, steering_rad
        attentive_from = end + 1  # one attentive step keeps two lapses apart
        time_s += duration_s + generator.exponential(attention.mean_attentive_s)
        elapsed_share = 0.0
    return lapses


@compiled
def release_controls(
    requested: tuple[FloatArray, FloatArray], lapses: tuple[BoolArray, FloatArray], step: IntArray, drove: BoolArray
) -> BoolArray:
    """Release pedals and wheel of the players whose attention lapses in this step.

    The requested accelerations and steering angles [G, P] are changed in place: no acceleration, and the steering angle
    of the road. `lapses` are the lapses of the games and the steering angle in them [G, P, T], step [G] the current
    steps, drove [G, P] the players that still drive. Returns [G, P]: the players with a lapse.
    """
    (acceleration_mps2, steering_rad), (lapsed, lapsed_steering_rad) = requested, lapses
    inattentive = np.zeros(drove.shape, dtype=np.bool_)
    for g, p in np.ndindex(drove.shape):
        if drove[g, p] and lapsed[g, p, step[g]]:
            inattentive[g, p] = True
            acceleration_mps2[g, p], steering_rad[g, p] = 0.0, lapsed_steering_rad[g, p, step[g]]
    return inattentive


# --- limits of the body ----------------------------------------------------------------------------------------------


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


def unseen_behind_m(sight: Sight, draw: float) -> float:
    """Least distance ahead of a player at which it sees road users in one game, from a number drawn uniformly from 0 to
    1; -inf: it sees them all around."""
    return sight.unseen_behind_m if draw < sight.no_blind_spot_check_share else -np.inf


def draw_estimation_errors(sight: Sight, steps: int, step_s: float, generator: np.random.Generator) -> FloatArray:
    """[T, 2] errors of estimated distances (share) and closing speeds (per second of distance) for T = `steps`.

    Both processes start in their stationary distribution and have the correlation time `PERSISTENCE_S`.
    """
    processes = _autocorrelated(generator.standard_normal((steps, 2)), np.exp(-step_s / PERSISTENCE_S))
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
