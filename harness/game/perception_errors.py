"""Errors of the ego's perception: the parameters, and the random numbers of one game.

An object is lost and found again at random (a Markov chain, whose rates depend on the distance), and its position and
speed have errors that are correlated in time (autoregressive processes of order 1). This is the form of the perception
error models of Piazzoni, Cherian, Dauwels and Chau (PEM: Perception Error Model for Virtual Testing of Autonomous
Vehicles, arXiv 2302.11919). A ghost is an object that is not there: ghosts appear at a rate, for an exponential time.

The random numbers of an object hang on the game and on the object's name alone, those of ghosts on the game alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from harness.game.arrays import FloatArray
from harness.game.human_factors import autocorrelated
from harness.game.seeding import between, generator_of

MOST_GHOSTS = 8
"""Ghosts at one time; a ghost that would be one more does not appear."""
LOSS, X, Y, SPEED = range(4)
"""Columns of the random numbers of an object."""


@dataclass(frozen=True, kw_only=True)
class Noise:
    """An error with a normal distribution, correlated in time."""

    sd: float = 0.0
    """Standard deviation at the ego."""
    sd_per_m: float = 0.0
    """What is added to it per metre of distance."""
    persistence_s: float = 1.0
    """Correlation time."""


@dataclass(frozen=True, kw_only=True)
class GhostRates:
    """Objects that are not there. Intervals are drawn from uniformly."""

    per_min: float
    mean_lifetime_s: float
    ahead_m: tuple[float, float]
    """From the ego's centre, along its heading."""
    left_m: tuple[float, float]
    speed_mps: tuple[float, float]
    """In the ego's heading."""
    length_m: float
    width_m: float


@dataclass(frozen=True, kw_only=True)
class PerceptionErrors:
    """The errors of the ego's perception; by default it has none."""

    range_m: float = np.inf
    field_of_view_rad: float = np.inf
    latency_s: float = 0.0
    losses: tuple[tuple[float, float, float], ...] = ()
    """Distance (m), losses per minute, and their mean duration (s), by increasing distance; linear between two."""
    position: Noise = Noise()
    """Of x and of y, in metres."""
    speed: Noise = Noise()
    """In m/s."""
    ghosts: GhostRates | None = None


class Ghost(NamedTuple):
    """A ghost, which has one of `MOST_GHOSTS` places."""

    place: int
    end_step: int
    ahead_m: float  # of the ego, when it appears
    left_m: float
    speed_mps: float


def draw_object(errors: PerceptionErrors, steps: int, step_s: float, name: str, *parts: str | int) -> FloatArray:
    """[T, 4] the random numbers of an object in a game of T steps: `LOSS` is uniform, the others are normal processes
    of variance 1."""
    generator = generator_of(*parts, "perception", name)
    uniform, normal = generator.random((steps, 1)), generator.standard_normal((steps, 3))
    position, speed = (np.exp(-step_s / each.persistence_s) for each in (errors.position, errors.speed))
    return np.concatenate((uniform, autocorrelated(normal[:, :2], position), autocorrelated(normal[:, 2:], speed)), 1)


def draw_ghosts(ghosts: GhostRates, steps: int, step_s: float, *parts: str | int) -> dict[int, list[Ghost]]:
    """Draw the ghosts of a game of `steps` steps, by the step in which they appear. As many are there at its start as
    at any other time."""
    generator, drawn = generator_of(*parts, "perception", "ghosts"), dict[int, list[Ghost]]()
    free_from = [0] * MOST_GHOSTS
    time_s = -10.0 * ghosts.mean_lifetime_s  # those that appeared earlier have gone but for one in 20,000
    while ghosts.per_min > 0.0:
        time_s += generator.exponential(60.0 / ghosts.per_min)
        first = max(int(np.ceil(time_s / step_s)), 0)
        if first >= steps:
            break
        end = int(np.ceil((time_s + generator.exponential(ghosts.mean_lifetime_s)) / step_s))
        pose = [between(each, generator.random()) for each in (ghosts.ahead_m, ghosts.left_m, ghosts.speed_mps)]
        place = next((k for k, each in enumerate(free_from) if each <= first), None)
        if end > first and place is not None:
            free_from[place] = end
            drawn.setdefault(first, []).append(Ghost(place, end, *pose))
    return drawn
