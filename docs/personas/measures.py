"""Measures of a persona's driving, taken from recorded games."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from harness.environments.recorded import recorded_game
from harness.game.arrays import BoolArray, FloatArray
from harness.game.quantities import Quantities
from harness.game.roles import NON_EGO
from harness.game.world import World
from harness.road.scene.open_scene import OpenScene


@dataclass(frozen=True, kw_only=True)
class PersonGame:
    """A recorded game and its non-ego: arrays are [T] over the steps, the start included."""

    quantities: Quantities
    drove: BoolArray
    """Whether the non-ego was driving: its game had not ended."""

    @classmethod
    def of(cls, trace: pd.DataFrame, scene: OpenScene) -> PersonGame:
        """The game of a trace."""
        game = recorded_game(trace, scene)
        return cls(quantities=game.quantities, drove=game.drove[:, NON_EGO])

    @property
    def world(self) -> World:
        return self.quantities.world

    def while_driving(self, values: FloatArray) -> FloatArray:
        """The values of the non-ego in [T, P], in the steps in which it drove."""
        return values[self.drove, NON_EGO]


def speed_over_limit(games: Sequence[PersonGame]) -> float:
    """Mean of the speed over the limit, as a share of the limit."""
    return float(np.mean(np.concatenate([game.while_driving(game.quantities.speed_over_limit) for game in games])))


def time_gap_s(games: Sequence[PersonGame]) -> float:
    """Median of the time gap, in the steps with a car ahead."""
    gaps = np.concatenate([game.while_driving(game.quantities.time_gap_s) for game in games])
    return float(np.median(gaps[np.isfinite(gaps)]))


def reaction_s(games: Sequence[PersonGame]) -> float:
    """Mean time from the start of a game to the first movement of pedal or wheel by the driver. 0 stands for a movement
    in the first step."""
    times_s = []
    for game in games:
        state = game.quantities.state
        moved = (state.acceleration_mps2[:, NON_EGO] != 0.0) | (state.steering_rad[:, NON_EGO] != 0.0)
        steps = np.flatnonzero(moved & ~state.lapsed[:, NON_EGO].astype(bool) & game.drove)
        if len(steps):
            times_s.append((steps[0] - 1) * game.world.step_s)  # a row is the end of its step; row 0 is the start
    return float(np.mean(times_s))


def lapse_s(games: Sequence[PersonGame]) -> float:
    """Mean length of the lapses that begin and end within a game. This underestimates the mean: a long lapse is more
    often cut off by the end of a game."""
    lengths = []
    for game in games:
        lapsed = game.quantities.state.lapsed[game.drove, NON_EGO].astype(int)
        lapsed[0] = lapsed[1]  # row 0 has no decision; a lapse in row 1 began before the game
        begins, ends = (np.flatnonzero(np.diff(lapsed) == step) for step in (1, -1))
        ends = ends[ends > begins[0]] if len(begins) else ends[:0]
        lengths += [float(end - begin) * game.world.step_s for begin, end in zip(begins, ends, strict=False)]
    return float(np.mean(lengths)) if lengths else float("nan")


def lane_left_m(games: Sequence[PersonGame]) -> float:
    """Median of the rest of the ending lane when the car's centre crosses the line to the next lane; negative in the
    taper."""
    rests_m = []
    for game in games:
        q, routes = game.quantities, game.world.road.routes
        row = q.world.road.routes.rows(q.state.station_m)[0, NON_EGO]
        lanes, ends = routes.lane_offset_m[row], routes.lane_end_m[row]
        own = int(np.nanargmin(np.abs(lanes - q.lateral_offset_m[0, NON_EGO])))
        if not np.isfinite(ends[own]):
            continue  # the lane of the start goes on
        beside = min((k for k in range(len(lanes)) if np.isinf(ends[k])), key=lambda k: abs(lanes[k] - lanes[own]))
        line_m = 0.5 * (lanes[own] + lanes[beside])
        over = np.sign(q.lateral_offset_m[:, NON_EGO] - line_m) == np.sign(lanes[beside] - line_m)
        if (crossed := np.flatnonzero(over & game.drove)).size:
            rests_m.append(float(ends[own] - q.state.station_m[crossed[0], NON_EGO]))
    return float(np.median(rests_m)) if rests_m else float("nan")


def lateral_deviation_m(games: Sequence[PersonGame]) -> float:
    """Standard deviation of lateral position (SDLP) of all games, where the road has its final width."""
    parts = []
    for game in games:
        q, routes = game.quantities, game.world.road.routes
        rows = slice(routes.first_row[NON_EGO], routes.last_row[NON_EGO] + 1)
        has_final_width = (routes.left_edge_m[rows] == routes.left_edge_m[rows][-1]) & (
            routes.right_edge_m[rows] == routes.right_edge_m[rows][-1]
        )
        others = np.flatnonzero(~has_final_width)
        from_row = routes.first_row[NON_EGO] + (others[-1] + 1 if len(others) else 0)
        measured = (routes.rows(q.state.station_m)[:, NON_EGO] >= from_row) & game.drove
        parts.append(q.lateral_offset_m[measured, NON_EGO])
    offsets = np.concatenate(parts)
    return float(offsets.std()) if len(offsets) else float("nan")
