"""The constants of a game."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from harness.game.arrays import FloatArray
from harness.game.bicycle import Actuators
from harness.game.right_of_way import NO_JUNCTIONS, RightOfWay
from harness.game.road import Road
from harness.game.sight import NOTHING_HIDES, Hiding
from harness.game.state import roles_of


@dataclass(frozen=True, kw_only=True)
class World:
    """The constants of a game: road, right of way, cars, step length, time limit. Sizes are [P]."""

    road: Road
    actuators: Actuators
    length_m: FloatArray
    width_m: FloatArray
    step_s: float
    time_limit_s: float
    right_of_way: RightOfWay = NO_JUNCTIONS
    hiding: Hiding = NOTHING_HIDES

    @cached_property
    def roles(self) -> tuple[str, ...]:
        """The players' names, as `roles_of`."""
        return roles_of(len(self.length_m))

    @cached_property
    def steps(self) -> int:
        """Steps until the time limit."""
        return round(self.time_limit_s / self.step_s)
