"""What a person's body can't do: act at once, see far and exactly, use all that the car can do.

A game's limits are drawn before it starts. Where nobody has any, the queue of decisions, the errors and the shares are
left out altogether.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from harness.game.arrays import FloatArray, IntArray
from harness.game.jit import compiled
from harness.game.state import State

PERSISTENCE_S = 20.0  # how long errors of estimation last (Treiber, Kesting and Helbing 2006, table 1)


@dataclass(frozen=True)
class Reaction:
    """Decisions reach pedals and wheel so much later: drawn uniformly for each game."""

    delay_s: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Sight:
    """How far others are seen, and how far off what is seen of them is.

    The errors are those of the human driver model (Treiber, Kesting and Helbing, Delays, inaccuracies and anticipation
    in microscopic traffic models, Physica A 360, 2006, section 2.2): a distance s is taken for s exp(V w), a closing
    speed is off by s sigma w', where V is `distance_error`, sigma `closing_error_per_s`, and w and w' are
    autocorrelated normal processes of variance 1 and correlation time `error_s`.
    """

    range_m: float = np.inf
    distance_error: float = 0.0
    closing_error_per_s: float = 0.0
    error_s: float = PERSISTENCE_S


@dataclass(frozen=True)
class LookedButFailedToSee:
    """Looking and failing to see: in `share` of the games, others are noticed only within a distance."""

    share: float = 0.0
    within_m: float = np.inf


@dataclass(frozen=True)
class Uses:
    """Shares of what the car can do that a person uses, with pedals and wheel as far as they go."""

    throttle: float = 1.0
    braking: float = 1.0
    steering: float = 1.0


AT_ONCE, EXACT, NOBODY, ALL = Reaction(), Sight(), LookedButFailedToSee(), Uses()
"""No limits: decisions count at once, sight is exact, nobody is missed, all of the car is used."""


@dataclass(frozen=True)
class Limits:
    """One player's limits in one game of T steps, drawn before it starts."""

    delay_steps: int = 0
    sight_m: float = np.inf
    misjudged: FloatArray | None = None
    """[T, 2] how far off distances (as a share of them) and closing speeds (per second of distance) are."""
    uses: tuple[float, float, float] = (1.0, 1.0, 1.0)
    """Shares of throttle, brake and wheel."""


NO_LIMITS = Limits()


def draw_delay_steps(reaction: Reaction, step_s: float, generator: np.random.Generator) -> int:
    """How many steps later a player's decisions reach pedals and wheel in one game."""
    return round(generator.uniform(*reaction.delay_s) / step_s)


def draw_noticed_m(missing: LookedButFailedToSee, generator: np.random.Generator) -> float:
    """Up to what distance others are noticed in one game; inf: as far as one sees."""
    return missing.within_m if generator.random() < missing.share else np.inf


def draw_misjudged(sight: Sight, steps: int, step_s: float, generator: np.random.Generator) -> FloatArray:
    """[T, 2] by how much distances (as a share) and closing speeds (per second of distance) are misjudged: they begin
    as the processes are in the long run, and change slowly."""
    slow = _autocorrelated(generator.standard_normal((steps, 2)), np.exp(-step_s / sight.error_s))
    return np.stack((np.expm1(sight.distance_error * slow[:, 0]), sight.closing_error_per_s * slow[:, 1]), axis=1)


@compiled
def _autocorrelated(noise: FloatArray, kept: float) -> FloatArray:
    """[T, N] a stationary process of order 1 and variance 1 of each column: x' = kept x + sqrt(1 - kept^2) noise."""
    found = noise.copy()
    fresh = np.sqrt(1.0 - kept * kept)
    for step in range(1, noise.shape[0]):
        for column in range(noise.shape[1]):
            found[step, column] = kept * found[step - 1, column] + fresh * noise[step, column]
    return found


class PlayersLimits:
    """The limits of the players of G games that are played together; what nobody has need not be asked for."""

    def __init__(self, games: int, players: int, steps: int) -> None:
        self._games, self._players = np.arange(games)[:, None], np.arange(players)
        self._delay_steps: IntArray = np.zeros((games, players), dtype=np.int64)
        self._decided = np.zeros((games, players, steps, 2))
        self._misjudged = np.zeros((games, players, steps, 2))
        self._uses = np.ones((games, players, 3))
        self.delays = self.misjudges = self.spares = False
        """Whether anybody's decisions were ever late, others misjudged, the car not used in full."""

    def reset(self, game: int, player: int, limits: Limits, state: State) -> None:
        """A player's limits in a game that starts."""
        self._delay_steps[game, player] = limits.delay_steps
        self._uses[game, player] = limits.uses
        self._misjudged[game, player] = 0.0 if limits.misjudged is None else limits.misjudged
        state.sight_m[game, player] = limits.sight_m
        state.distance_error[game, player], state.closing_error_per_s[game, player] = self._misjudged[game, player, 0]
        self.delays |= limits.delay_steps > 0
        self.misjudges |= limits.misjudged is not None
        self.spares |= limits.uses != NO_LIMITS.uses

    def arriving(self, decided: FloatArray, now: IntArray) -> FloatArray:
        """[G, P, 2] the decisions that reach pedals and wheel in the steps `now` [G], in which these are made. Before
        the first arrives, pedals are let go and the wheel stands straight."""
        self._decided[self._games, self._players, now[:, None]] = decided
        made = now[:, None] - self._delay_steps
        arrived = self._decided[self._games, self._players, np.maximum(made, 0)]
        return np.where(made[..., None] >= 0, arrived, 0.0)

    def within(self, acceleration: FloatArray, steering: FloatArray) -> tuple[FloatArray, FloatArray]:
        """[G, P] what is asked of the car, as far as the players use it."""
        throttle, braking, wheel = np.moveaxis(self._uses, -1, 0)
        return acceleration * np.where(acceleration >= 0.0, throttle, braking), steering * wheel

    def look(self, state: State) -> None:
        """Put into a state by how much its players misjudge others."""
        now = np.minimum(state.step, self._misjudged.shape[2] - 1)
        misjudged = self._misjudged[self._games, self._players, now[:, None]]
        state.distance_error, state.closing_error_per_s = misjudged[..., 0].copy(), misjudged[..., 1].copy()
