"""One recorded game as the rules use it: the quantities of every step, and the relative positions of the players."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pandas as pd

from harness.evaluation.encounters import Encounter, encounters_of
from harness.evaluation.manoeuvres.thresholds import HALF_LANE_M, SAME_WITHIN_S
from harness.evaluation.trace_quantities import drove_in, quantities_of, sizes_by_name
from harness.game.arrays import BoolArray, FloatArray
from harness.game.quantities import Quantities
from harness.game.roles import EGO
from harness.game.route_coordinates import PATH_M
from harness.game.state import Bodies
from harness.game.world import World

_HERE = int(np.flatnonzero(PATH_M == 0.0)[0])
_NEARBY_M = 10.0  # of road, behind and ahead
_LARGEST_STEP_M = 1.0  # sideways in a step; more means that another lane is now the nearest
_SAME_LANE_M = 0.1  # centres of lanes that are nearer are of one lane
_ROUNDING_S = 1e-9

Stretch = tuple[int, int]  # its first and last step


@dataclass(frozen=True, kw_only=True)
class Course:
    """T steps of one game; arrays are [T], or [T, P] in `quantities`: its games' axis is the steps' axis."""

    quantities: Quantities
    """Of the players among all road users."""
    between: Quantities
    """Of the players alone: with two, the leader and the collision partner are the other player."""
    drove: BoolArray
    """[T, P] whether each player was driving; in a game with an ego, only until the ego's game ends."""

    @classmethod
    def of(
        cls,
        trace: pd.DataFrame,
        world: World,
        sizes_m: Mapping[str, tuple[float, float]],
    ) -> Course:
        """From one game's trace. `sizes_m` are length and width of vehicle types, by default those of SUMO."""
        quantities = quantities_of(trace, world, sizes_by_name(trace, sizes_m))
        players = len(world.roles)
        bodies = Bodies._make(column[:, :players].copy() for column in quantities.bodies)
        between = Quantities(world, quantities.state, bodies, quantities.advanced_m, quantities.lateral_offset_m)
        drove = drove_in(trace, world.roles)
        if drove[:, EGO].any():
            drove[int(np.flatnonzero(drove[:, EGO])[-1]) + 1 :] = False
        return cls(quantities=quantities, between=between, drove=drove)

    def of_pair(self, player: int, other: int) -> Course:
        """The course in which these are the only players in `between`."""
        bodies = self.between.bodies
        if bodies.present.shape[1] == 2:
            return self
        alone = np.isin(np.arange(bodies.present.shape[1]), (player, other))
        of_both = bodies._replace(present=bodies.present & alone)
        q = self.quantities
        between = Quantities(q.world, q.state, of_both, q.advanced_m, q.lateral_offset_m)
        return replace(self, between=between)

    @property
    def step_s(self) -> float:
        return self.quantities.world.step_s

    def steps(self, seconds: float) -> int:
        """The least number of steps that cover a time."""
        return int(np.ceil(seconds / self.step_s - _ROUNDING_S))

    def stretches(self, mask: BoolArray, least_s: float, parted: BoolArray | None = None) -> Iterator[Stretch]:
        """The stretches over which `mask` [T] holds for at least `least_s` in total. A pause of up to `SAME_WITHIN_S`
        is ignored, unless `parted` [T] holds in it."""
        spans: list[list[int]] = []
        counts: list[int] = []
        for first, last in runs(mask):
            pause = slice(spans[-1][1] + 1 if spans else 0, first)
            continues = bool(spans) and first - pause.start <= self.steps(SAME_WITHIN_S)
            if continues and not (parted is not None and parted[pause].any()):
                spans[-1][1] = last
                counts[-1] += last - first + 1
            else:
                spans.append([first, last])
                counts.append(last - first + 1)
        for (first, last), count in zip(spans, counts, strict=True):
            if count >= self.steps(least_s):
                yield first, last

    def encounters(self, player: int) -> list[Encounter]:
        """The player's encounters with other road users at junctions."""
        return encounters_of(self.quantities, player, self.drove[:, player])

    # --- across the road ------------------------------------------------------------------------------------------

    @cached_property
    def _from_lane_m(self) -> FloatArray:
        """[T, P] to the left of the centre of the nearest lane."""
        quantities = self.quantities
        routes = quantities.world.road.routes
        lanes = routes.lane_offset_m[routes.rows(quantities.state.station_m)]
        away = quantities.lateral_offset_m[..., None] - lanes
        nearest = np.where(np.isnan(away), np.inf, np.abs(away)).argmin(-1)
        return np.take_along_axis(away, nearest[..., None], -1)[..., 0]

    @cached_property
    def sideways_m(self) -> FloatArray:
        """[T, P] displacement to the left, relative to the direction of the lane, since the start."""
        moved = np.diff(self._from_lane_m, axis=0, prepend=self._from_lane_m[:1])
        return np.where(np.abs(moved) < _LARGEST_STEP_M, moved, 0.0).cumsum(0)

    @cached_property
    def turned_rad(self) -> FloatArray:
        """[T, P] heading to the left of the road's."""
        turned = self.quantities.state.heading_rad - self.quantities.path_heading_rad[..., _HERE]
        return (turned + np.pi) % (2.0 * np.pi) - np.pi

    def swerving_mps2(self, player: int, side: float) -> FloatArray:
        """[T] lateral acceleration to a side (1 left, -1 right), minus that of the tightest curve of the road nearby.

        Roads are polylines: their curvature is measured over lengths of 5 m and more.
        """
        near = np.flatnonzero(np.abs(PATH_M) <= _NEARBY_M)
        headings = np.unwrap(self.quantities.path_heading_rad[:, player, near], axis=-1)
        curve = (side * np.diff(headings, axis=-1) / np.diff(PATH_M[near])).max(-1)
        own = side * self.quantities.lateral_acceleration_mps2[:, player]
        return own - np.maximum(curve, 0.0) * self.quantities.speed_mps[:, player] ** 2

    # --- relative to the other player -----------------------------------------------------------------------------

    def ahead_m(self, player: int, of: int) -> FloatArray:
        """[T] how far the centre of `player` is ahead of that of `of`, along the route of `of`."""
        return self.between.on_path.ahead_m[:, of, player]

    def gap_m(self, player: int, of: int) -> FloatArray:
        """[T] from the front of `of` to the rear of `player`; negative where they are side by side."""
        on_path = self.between.on_path
        own = 0.5 * self.quantities.world.length_m[of]
        return on_path.ahead_m[:, of, player] - on_path.half_length_m[:, of, player] - own

    def in_way(self, player: int, of: int) -> BoolArray:
        """[T] whether the bodies of the two overlap across the road: `player` is in the path of `of`."""
        on_path = self.between.on_path
        half_width = on_path.half_width_m[:, of, player] + 0.5 * self.quantities.world.width_m[of]
        return np.abs(on_path.left_m[:, of, player]) < half_width

    def over_mark(self, player: int, of: int) -> BoolArray:
        """[T] whether a part of the body of `player` is within the lane in which `of` drives."""
        q, on_path = self.quantities, self.between.on_path
        routes = q.world.road.routes
        lanes = routes.lane_offset_m[routes.rows(q.state.station_m)][:, of]
        away = np.abs(lanes - q.lateral_offset_m[:, of, None])
        nearest = np.where(np.isnan(away), np.inf, away).argmin(-1)
        centre = np.take_along_axis(lanes, nearest[:, None], -1)
        apart = np.abs(lanes - centre)
        apart = np.where(apart > _SAME_LANE_M, apart, np.inf).min(-1)  # NaN, no lane, is not greater
        half = np.minimum(0.5 * apart, HALF_LANE_M)
        return np.abs(self.left_m(player, of) - centre[:, 0]) - on_path.half_width_m[:, of, player] < half

    def left_m(self, player: int, of: int) -> FloatArray:
        """[T] how far `player` is to the left of the route of `of`."""
        return self.between.on_path.left_m[:, of, player] + self.quantities.lateral_offset_m[:, of]


def runs(mask: BoolArray) -> Iterator[Stretch]:
    """The stretches over which `mask` [T] holds without interruption."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], mask.astype(np.int8), [0]))))
    for first, end in edges.reshape(-1, 2).tolist():
        yield first, end - 1
