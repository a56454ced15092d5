"""The constants of a game."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from harness.game.arrays import BoolArray, FloatArray
from harness.game.bicycle import ActuatorLimits
from harness.game.junctions import NO_JUNCTIONS, RightOfWay
from harness.game.road import Road
from harness.game.roles import roles_of
from harness.game.sight import NOTHING_HIDES, Hiding


@dataclass(frozen=True, kw_only=True)
class World:
    """The constants of a game: road, right of way, cars, step length, time limit. Sizes are [P]."""

    road: Road
    actuators: ActuatorLimits
    length_m: FloatArray
    width_m: FloatArray
    step_s: float
    time_limit_s: float
    walks: BoolArray
    """[P] players on foot."""
    right_of_way: RightOfWay = NO_JUNCTIONS
    hiding: Hiding = NOTHING_HIDES

    @cached_property
    def roles(self) -> tuple[str, ...]:
        """The players' names, as `roles_of`."""
        return roles_of(len(self.length_m))

    def on_carriageway(self, x_m: FloatArray, y_m: FloatArray) -> FloatArray:
        """[G, P] 1 for players on foot at points [G, P] of the carriageway, else 0."""
        if self.road.carriageway is None:
            return np.zeros(x_m.shape)
        return np.where(self.walks, self.road.carriageway.at(x_m, y_m), 0.0)

    @cached_property
    def steps(self) -> int:
        return round(self.time_limit_s / self.step_s)
