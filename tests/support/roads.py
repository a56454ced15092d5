"""Routes of simple shapes: straight and round."""

from __future__ import annotations

import numpy as np

from harness.game.arrays import FloatArray
from harness.game.road import MARGIN_M, SPACING_M, Route


def route(x: FloatArray, y: FloatArray, heading: FloatArray, length: float, lanes: int = 1) -> Route:
    n = len(x)
    return Route(
        x_m=x,
        y_m=y,
        heading_rad=heading,
        left_edge_m=np.full(n, 3.0),
        right_edge_m=np.full(n, -3.0),
        own_left_m=np.full(n, np.inf),
        own_right_m=np.full(n, -np.inf),
        speed_limit_mps=np.full(n, 13.0),
        lane_offset_m=np.zeros((n, lanes)),
        lane_end_m=np.full((n, lanes), np.inf),
        length_m=length,
        goal_m=length - 5.0,
    )


def straight(heading: float, length: float = 80.0, lanes: int = 1, x0: float = 0.0, y0: float = 0.0) -> Route:
    stations = np.arange(-MARGIN_M, length + MARGIN_M + SPACING_M, SPACING_M)
    x, y = x0 + stations * np.cos(heading), y0 + stations * np.sin(heading)
    return route(x, y, np.full(len(x), heading), length, lanes)


def arc(radius: float, length: float = 60.0) -> Route:
    """A circular arc from the origin, to the east and then left (negative radius: right), straight at both ends."""
    stations = np.arange(-MARGIN_M, length + MARGIN_M + SPACING_M, SPACING_M)
    within = np.clip(stations, 0.0, length)
    turned, beyond = within / radius, stations - within
    x = radius * np.sin(turned) + beyond * np.cos(turned)
    y = radius * (1.0 - np.cos(turned)) + beyond * np.sin(turned)
    return route(x, y, turned, length)


def on_arc(radius: float, station: float, offset: float) -> tuple[float, float]:
    turned = station / radius
    return (radius - offset) * np.sin(turned), radius - (radius - offset) * np.cos(turned)
