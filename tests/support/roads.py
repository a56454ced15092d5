"""Roads of simple shapes: straight and round routes, and the sources of a net with a roundabout."""

from __future__ import annotations

import numpy as np

from harness.game.arrays import FloatArray
from harness.game.road import MARGIN_M, SPACING_M, Route, Routes


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


def roundabout_sources() -> tuple[str, str]:
    """The nodes and edges of a ring of four entries i0 to i3, ring edges r0 to r3 and exits o0 to o3."""

    def place(radius_m: float, quarter: float) -> str:
        turned = quarter * np.pi / 2.0
        return f"{radius_m * np.cos(turned):.2f},{radius_m * np.sin(turned):.2f}"

    nodes, edges = "", ""
    for k in range(4):
        for name, radius_m in (("r", 20.0), ("o", 80.0)):
            x, y = place(radius_m, k).split(",")
            nodes += f'<node id="{name}{k}" x="{x}" y="{y}"/>'
        shape = " ".join(place(20.0, k + share) for share in np.linspace(0.0, 1.0, 7))
        edges += f'<edge id="r{k}" from="r{k}" to="r{(k + 1) % 4}" shape="{shape}"/>'
        edges += f'<edge id="i{k}" from="o{k}" to="r{k}"/><edge id="o{k}" from="r{k}" to="o{k}"/>'
    return nodes, edges


def nearest_station_m(routes: Routes, x_m: FloatArray, y_m: FloatArray) -> FloatArray:
    """[G, P] stations in the table nearest to points [G, P], by a search of the whole route of each player."""
    stations = np.empty(x_m.shape)
    for p, (first, last) in enumerate(zip(routes.first_row, routes.last_row, strict=True)):
        rows = slice(first, last + 1)
        away_m = np.hypot(routes.x_m[rows] - x_m[:, p, None], routes.y_m[rows] - y_m[:, p, None])
        stations[:, p] = away_m.argmin(axis=1) * SPACING_M - MARGIN_M
    return stations
