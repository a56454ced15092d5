"""How close the judged player comes to other road users, and the criteria of a near miss."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from harness.evaluation.recorded_game import RecordedGame
from harness.evaluation.severity import contact
from harness.evaluation.severity import limits as at
from harness.game.arrays import BoolArray, FloatArray
from harness.game.state import Bodies


class Headways(NamedTuple):
    """Of the nearest road user ahead that goes the same way, in each step in which a player drives [N]."""

    time_s: FloatArray
    """The time headway; inf without such a road user."""
    opens: BoolArray
    """Whether it is faster than the player along the player's heading: the gap opens."""


@lru_cache(maxsize=1)
def headways(game: RecordedGame, player: int) -> Headways:
    q = game.quantities
    speed_mps = q.state.speed_mps[:, player]
    turned = q.bodies.heading_rad - q.state.heading_rad[:, player, None]
    gap = np.where(np.cos(turned) > math.cos(at.LEADER_TURNED_RAD), q.leader_gaps_m[:, player], np.inf)
    nearest = gap.argmin(-1)[:, None]
    along_mps = np.take_along_axis(q.bodies.speed_mps * np.cos(turned), nearest, -1)[:, 0]
    time_s = gap.min(-1) / np.maximum(speed_mps, 0.1)
    steps = steps_of(game, player)
    return Headways(time_s[steps], (along_mps > speed_mps)[steps])


@lru_cache(maxsize=1)
def least_pet_s(game: RecordedGame, player: int) -> float:
    """Least post-encroachment time; inf without one."""
    step_s = game.world.step_s
    most = round(at.LONGEST_PET_S / step_s)
    bodies, among = bodies_of(game, player)
    return float(contact.post_encroachment_s(bodies.boxes, among, player, at.CROSSING_RAD, step_s, most))


def _least_ttc_s(game: RecordedGame, player: int) -> float:
    return min(game.while_driving(game.quantities.time_to_collision_s, player), default=math.inf)


def _least_headway_s(game: RecordedGame, player: int) -> float:
    time_s, opens = headways(game, player)
    return min(time_s[~opens], default=math.inf)


@dataclass(frozen=True, kw_only=True)
class Criterion:
    """A measure of closeness, and the value up to which a game without contact is a near miss."""

    name: str
    """As it ends the columns `near_miss_...` of episodes.csv and `near_misses_by_...` of summary.csv."""
    words: str
    """The measure, after "by"."""
    limit_s: float
    least_s: Callable[[RecordedGame, int], float]
    """The least value of a player in a game; inf without one."""
    behind: str = ""
    """Behind which road users alone it counts, after the limit; empty: any."""
    source: str = ""
    """Of the limit; empty: our own."""

    @property
    def bound(self) -> str:
        """The measure with its limit."""
        return f"{self.words} of at most {self.limit_s:g} s"

    def is_met(self, game: RecordedGame, player: int) -> bool:
        return self.least_s(game, player) <= self.limit_s


CRITERIA = (
    Criterion(
        name="ttc", words="time to collision", limit_s=at.CONFLICT_TTC_S, least_s=_least_ttc_s, source="FHWA-HRT-08-051"
    ),
    Criterion(
        name="pet",
        words="post-encroachment time",
        limit_s=at.CONFLICT_PET_S,
        least_s=least_pet_s,
        source="Peesapati, Hunter and Rodgers 2013",
    ),
    Criterion(
        name="headway",
        words="time headway",
        limit_s=at.CONFLICT_HEADWAY_S,
        least_s=_least_headway_s,
        behind=" behind a road user that is not faster than the ego. Behind a faster one the gap opens",
    ),
)
"""A game without contact that meets one of them is a near miss; it may meet several."""


def least_share(game: RecordedGame, player: int) -> float:
    """The least of the measures of closeness, each over its limit; inf without any."""
    return min(each.least_s(game, player) / each.limit_s for each in CRITERIA)


def steps_of(game: RecordedGame, player: int) -> BoolArray:
    """[T] the steps in which the player drove, without the start."""
    drove = game.drove[:, player].copy()
    drove[0] = False
    return drove


def bodies_of(game: RecordedGame, player: int) -> tuple[Bodies, BoolArray]:
    """All bodies in the steps in which the player drove [N, B], and which are others that are there [N, B]."""
    steps = steps_of(game, player)
    bodies = Bodies._make(column[steps] for column in game.bodies)
    among = bodies.present.copy()
    among[:, player] = False
    return bodies, among
