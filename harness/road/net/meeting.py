"""The place where the routes of two players meet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from harness.game.arrays import FloatArray
from harness.game.road import MARGIN_M, SPACING_M, Route

_MEETS_M = 1.6  # routes whose lines are closer than half a lane meet


@dataclass(frozen=True, kw_only=True)
class Meeting:
    """The first place along the ego's route where another player's route meets it, in metres along both."""

    ego_m: float
    other_m: float


def meeting(ego: Route, other: Route) -> Meeting | None:
    """The first place where the routes, up to their goals, meet; None if they do not."""
    ego_points, other_points = (route_points(route)[: round(route.goal_m / SPACING_M) + 1] for route in (ego, other))
    return meeting_of_lines(ego_points, other_points)


def meeting_of_lines(ego_points: FloatArray, other_points: FloatArray) -> Meeting | None:
    """The first place where two lines, of points [n, 2] every `SPACING_M`, meet; None if they do not."""
    from scipy.spatial import KDTree  # loads SciPy's sparse matrices: only for commands that open a scene

    distances, rows = KDTree(other_points).query(ego_points)
    near = np.flatnonzero(distances < _MEETS_M)
    if not len(near):
        return None
    first = near[0]
    last = first + int(np.argmin(np.append(distances[first:] < _MEETS_M, False)))
    closest = first + int(np.flatnonzero(distances[first:last] <= distances[first:last].min() + 0.1)[0])
    return Meeting(ego_m=float(closest * SPACING_M), other_m=float(rows[closest] * SPACING_M))


def route_points(route: Route) -> FloatArray:
    """[n, 2] the line of a route, every `SPACING_M` from its station 0."""
    first = round(MARGIN_M / SPACING_M)
    return np.stack((route.x_m[first:-first], route.y_m[first:-first]), axis=1)
