"""Obstacles: bodies that stand in one place for a whole game. Each game draws their places from its seed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np

from harness.game.arrays import BoolArray, FloatArray
from harness.game.geometry import Box
from harness.game.seeding import between, generator_of

Range: TypeAlias = tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class OnLane:
    """A place on the centre line of a lane. Ranges are drawn uniformly, one after the other."""

    line: FloatArray  # [n, 2]
    position_m: Range  # of the obstacle's centre, along the lane
    offset_m: Range  # to the left of the centre line
    turned_rad: Range  # from the lane's direction, counter-clockwise
    scale: float = 1.0  # metres of the line per metre of the lane

    def pose(self, shares: tuple[float, float, float]) -> tuple[float, float, float]:
        """x_m, y_m and heading_rad at three shares, from 0 to 1, of the ranges."""
        position, offset, turned = map(between, (self.position_m, self.offset_m, self.turned_rad), shares)
        ways = np.diff(self.line, axis=0)
        lengths = np.hypot(*ways.T)
        stations = np.concatenate(([0.0], np.cumsum(lengths)))
        station = position * self.scale
        k = int(np.clip(np.searchsorted(stations, station, side="right") - 1, 0, len(ways) - 1))
        x, y = self.line[k] + (station - stations[k]) / lengths[k] * ways[k]
        heading = float(np.arctan2(ways[k, 1], ways[k, 0]))
        return float(x - offset * np.sin(heading)), float(y + offset * np.cos(heading)), heading + turned


@dataclass(frozen=True, kw_only=True)
class AtPoint:
    """A place in the coordinates of the net."""

    x_m: Range
    y_m: Range
    heading_rad: Range

    def pose(self, shares: tuple[float, float, float]) -> tuple[float, float, float]:
        """x_m, y_m and heading_rad at three shares, from 0 to 1, of the ranges."""
        x, y, heading = map(between, (self.x_m, self.y_m, self.heading_rad), shares)
        return x, y, heading


@dataclass(frozen=True, kw_only=True)
class PlacedObstacle:
    """A body that stands in one place for a whole game."""

    name: str
    kind: str
    length_m: float
    width_m: float
    hides: bool  # is higher than eyes
    place: OnLane | AtPoint

    @property
    def vehicle_type(self) -> str:
        """Its type in traces and replays."""
        return f"{self.name}_{self.kind}"

    @cached_property
    def fixed_pose(self) -> tuple[float, float, float] | None:
        """Its pose in every game; None if games differ."""
        low, high = self.place.pose((0.0, 0.0, 0.0)), self.place.pose((1.0, 1.0, 1.0))
        return low if low == high else None


@dataclass(frozen=True, kw_only=True)
class Obstacles:
    """The obstacles of a scene, and the walls of its buildings."""

    each: tuple[PlacedObstacle, ...] = ()
    outlines: tuple[FloatArray, ...] = ()  # [n, 2] corners of the buildings, which hide and stand off the road

    def poses(self, *parts: str | int) -> FloatArray:
        """[O, 3] x_m, y_m and heading_rad in the game whose seeds have these parts."""
        poses = np.empty((len(self.each), 3))
        for k, obstacle in enumerate(self.each):
            if obstacle.fixed_pose is not None:
                poses[k] = obstacle.fixed_pose
            else:
                shares = generator_of(*parts, "obstacle", k).random(3).tolist()
                poses[k] = obstacle.place.pose((shares[0], shares[1], shares[2]))
        return poses

    def boxes(self, *parts: str | int) -> Box:
        """Their boxes [O] in that game."""
        x_m, y_m, heading_rad = self.poses(*parts).T
        return Box(x_m, y_m, heading_rad, self.length_m, self.width_m)

    @cached_property
    def length_m(self) -> FloatArray:
        """[O]"""
        return np.array([obstacle.length_m for obstacle in self.each])

    @cached_property
    def width_m(self) -> FloatArray:
        """[O]"""
        return np.array([obstacle.width_m for obstacle in self.each])

    @cached_property
    def hides(self) -> BoolArray:
        """[O]"""
        return np.array([obstacle.hides for obstacle in self.each], dtype=bool)

    @cached_property
    def walls(self) -> FloatArray:
        """[S, 2, 2] start and end of each wall."""
        closed = [np.concatenate((outline, outline[:1])) for outline in self.outlines]
        walls = [np.stack((line[:-1], line[1:]), axis=1) for line in closed]
        return np.concatenate(walls) if walls else np.zeros((0, 2, 2))


NO_OBSTACLES = Obstacles()
