"""Exact geometry of oriented boxes and line segments, independent of games and roads.

Computations use a box's own frame, in which the box is |u| <= half length, |v| <= half width. The distance of two
convex shapes is the distance of a corner of one to the other. The shapes touch unless an axis of one separates them.
"""

from __future__ import annotations

from math import cos, hypot, inf, sin, sqrt
from typing import Any, NamedTuple

import numpy as np

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.jit import compiled


class Box(NamedTuple):
    """Oriented boxes by centre, heading and size: numbers, or arrays of the shapes that the function documents."""

    x_m: Any
    y_m: Any
    heading_rad: Any
    length_m: Any
    width_m: Any


def boxes_of(boxes: Box) -> list[Box]:
    """The boxes of a box with arrays [N], one by one."""
    return [Box(*each) for each in np.array(boxes, dtype=float).T.tolist()]


# --- two boxes -------------------------------------------------------------------------------------------------------


@compiled
def box_distance(a: Box, b: Box) -> float:
    """Distance (m) between two boxes; 0 if they share a point (separating axis theorem)."""
    from_a, apart_in_a = _distance_in_frame(a, b)
    from_b, apart_in_b = _distance_in_frame(b, a)
    return min(from_a, from_b) if apart_in_a or apart_in_b else 0.0


@compiled
def _distance_in_frame(frame: Box, box: Box) -> tuple[float, bool]:
    """Distance of a box's nearest corner to the box `frame`, and whether an axis of `frame` separates the two boxes."""
    u, v = in_frame(frame, box.x_m, box.y_m)
    turned = box.heading_rad - frame.heading_rad
    cosine, sine = cos(turned), sin(turned)
    half_length, half_width = 0.5 * frame.length_m, 0.5 * frame.width_m
    nearest2 = inf
    for along in (0.5 * box.length_m, -0.5 * box.length_m):
        for across in (0.5 * box.width_m, -0.5 * box.width_m):
            beyond_end = max(abs(u + along * cosine - across * sine) - half_length, 0.0)
            beyond_side = max(abs(v + along * sine + across * cosine) - half_width, 0.0)
            nearest2 = min(nearest2, beyond_end**2 + beyond_side**2)
    reach_u, reach_v = _reach(box, cosine, sine)
    return sqrt(nearest2), abs(u) > half_length + reach_u or abs(v) > half_width + reach_v


@compiled
def time_to_contact(a: Box, b: Box, velocity_x_mps: float, velocity_y_mps: float) -> float:
    """Seconds until box b, moving at a velocity relative to a, touches a: 0 if they touch now, inf if never.

    Exact for boxes of constant heading and velocity (separating axes, swept in time).
    """
    enter, leave = _overlap_in_frame(a, b, velocity_x_mps, velocity_y_mps)
    enter_b, leave_b = _overlap_in_frame(b, a, -velocity_x_mps, -velocity_y_mps)
    enter, leave = max(enter, enter_b), min(leave, leave_b)
    return max(enter, 0.0) if enter <= leave and leave >= 0.0 else inf


@compiled
def _overlap_in_frame(frame: Box, box: Box, velocity_x_mps: float, velocity_y_mps: float) -> tuple[float, float]:
    """The time interval (s) in which no axis of `frame` separates it from a box moving relative to it."""
    u, v = in_frame(frame, box.x_m, box.y_m)
    rate_u, rate_v = in_frame(Box(0.0, 0.0, frame.heading_rad, 0.0, 0.0), velocity_x_mps, velocity_y_mps)
    turned = box.heading_rad - frame.heading_rad
    reach_u, reach_v = _reach(box, cos(turned), sin(turned))
    enter_u, leave_u = _overlap(u, rate_u, 0.5 * frame.length_m + reach_u)
    enter_v, leave_v = _overlap(v, rate_v, 0.5 * frame.width_m + reach_v)
    return max(enter_u, enter_v), min(leave_u, leave_v)


@compiled
def _overlap(place: float, rate: float, reach: float) -> tuple[float, float]:
    """The interval of t in which |place + rate * t| <= reach."""
    if abs(rate) <= 1e-9:
        return (-inf, inf) if abs(place) <= reach else (inf, -inf)
    middle, half = -place / rate, reach / abs(rate)
    return middle - half, middle + half


@compiled
def in_frame(frame: Box, x_m: float, y_m: float) -> tuple[float, float]:
    """Coordinates u, v of a point in the frame of a box."""
    cosine, sine = cos(frame.heading_rad), sin(frame.heading_rad)
    dx, dy = x_m - frame.x_m, y_m - frame.y_m
    return dx * cosine + dy * sine, dy * cosine - dx * sine


@compiled
def _reach(box: Box, cosine: float, sine: float) -> tuple[float, float]:
    """Extent of a rotated box from its centre along each axis; cosine and sine of its angle to the frame."""
    half_length, half_width = 0.5 * box.length_m, 0.5 * box.width_m
    return (
        half_length * abs(cosine) + half_width * abs(sine),
        half_length * abs(sine) + half_width * abs(cosine),
    )


# --- a box and a segment ---------------------------------------------------------------------------------------------


@compiled
def _box_segment_distance(
    box: Box, direction: tuple[float, float], segment: tuple[float, float, float, float], limit_m: float
) -> float:
    """Distance (m) of a box to a segment (x and y of its start and of its end); 0 if they touch. If not below the
    limit, any value that is not. `direction` is the cosine and sine of the heading."""
    (cosine, sine), (start_x_m, start_y_m, end_x_m, end_y_m) = direction, segment
    dx, dy = start_x_m - box.x_m, start_y_m - box.y_m
    u0, v0 = dx * cosine + dy * sine, dy * cosine - dx * sine
    dx, dy = end_x_m - box.x_m, end_y_m - box.y_m
    u1, v1 = dx * cosine + dy * sine, dy * cosine - dx * sine
    half_length, half_width = 0.5 * box.length_m, 0.5 * box.width_m
    gap = max(min(u0, u1) - half_length, -max(u0, u1) - half_length)
    gap = max(gap, min(v0, v1) - half_width, -max(v0, v1) - half_width)
    if gap >= limit_m:
        return gap
    nearest2 = min(
        max(abs(u0) - half_length, 0.0) ** 2 + max(abs(v0) - half_width, 0.0) ** 2,
        max(abs(u1) - half_length, 0.0) ** 2 + max(abs(v1) - half_width, 0.0) ** 2,
    )
    span_u, span_v = u1 - u0, v1 - v0
    span2 = max(span_u * span_u + span_v * span_v, 1e-12)
    least_side, most_side = inf, -inf
    for corner_u in (half_length - u0, -half_length - u0):
        for corner_v in (half_width - v0, -half_width - v0):
            share = min(max((corner_u * span_u + corner_v * span_v) / span2, 0.0), 1.0)
            nearest2 = min(nearest2, (corner_u - share * span_u) ** 2 + (corner_v - share * span_v) ** 2)
            side = corner_u * span_v - corner_v * span_u
            least_side, most_side = min(least_side, side), max(most_side, side)
    return sqrt(nearest2) if gap > 0.0 or least_side > 0.0 or most_side < 0.0 else 0.0


# --- many of them ----------------------------------------------------------------------------------------------------
# Boxes `own` have places [N, P] and sizes [P], boxes `others` are [N, B]. Each own box is compared with the others of
# its row that are marked in `among` [N, P, B].


@compiled
def distance_to_nearest_box(own: Box, others: Box, among: BoolArray, limit_m: float) -> FloatArray:
    """[N, P] distance (m) to the nearest marked box, at most `limit_m`."""
    nearest_m = np.full(own.x_m.shape, limit_m)
    for n, p, b in np.ndindex(among.shape):
        if among[n, p, b]:
            a, other = _own(own, n, p), other_box(others, n, b)
            dx, dy = abs(a.x_m - other.x_m), abs(a.y_m - other.y_m)
            extents = 0.5 * (a.length_m + a.width_m + other.length_m + other.width_m)  # at least the radii below
            if max(dx, dy) - extents >= nearest_m[n, p]:
                continue
            radii = 0.5 * (hypot(a.length_m, a.width_m) + hypot(other.length_m, other.width_m))
            if hypot(a.x_m - other.x_m, a.y_m - other.y_m) - radii < nearest_m[n, p]:
                nearest_m[n, p] = min(nearest_m[n, p], box_distance(a, other))
    return nearest_m


@compiled
def time_to_first_contact(
    own: Box, others: Box, speeds_mps: tuple[FloatArray, FloatArray], among: BoolArray
) -> FloatArray:
    """[N, P] seconds until the first contact with a marked box at constant headings and speeds [N, P] and [N, B]; inf
    if none."""
    own_speed_mps, speed_mps = speeds_mps
    soonest_s = np.full(own.x_m.shape, inf)
    for n, p, b in np.ndindex(among.shape):
        if among[n, p, b]:
            a, other = _own(own, n, p), other_box(others, n, b)
            velocity_x = speed_mps[n, b] * cos(other.heading_rad) - own_speed_mps[n, p] * cos(a.heading_rad)
            velocity_y = speed_mps[n, b] * sin(other.heading_rad) - own_speed_mps[n, p] * sin(a.heading_rad)
            soonest_s[n, p] = min(soonest_s[n, p], time_to_contact(a, other, velocity_x, velocity_y))
    return soonest_s


@compiled
def distance_to_nearest_segment(
    own: Box, segments: FloatArray, lists: tuple[IntArray, IntArray], limit_m: float
) -> FloatArray:
    """[N, P] distance (m) to the nearest of the segments [S, 2, 2] in each box's list, at most `limit_m`.

    `lists` are the lists [L, K] of rows of `segments`, and the number of each box's list [N, P]. A list ends at its
    first negative row.
    """
    rows, of_box = lists
    nearest_m = np.full(own.x_m.shape, limit_m)
    for n, p in np.ndindex(own.x_m.shape):
        box, listed = _own(own, n, p), of_box[n, p]
        direction = (cos(box.heading_rad), sin(box.heading_rad))
        for k in range(rows.shape[1]):
            row = rows[listed, k]
            if row < 0:
                break
            segment = (segments[row, 0, 0], segments[row, 0, 1], segments[row, 1, 0], segments[row, 1, 1])
            distance = _box_segment_distance(box, direction, segment, nearest_m[n, p])
            nearest_m[n, p] = min(nearest_m[n, p], distance)
    return nearest_m


@compiled
def _own(own: Box, n: int, p: int) -> Box:
    return Box(own.x_m[n, p], own.y_m[n, p], own.heading_rad[n, p], own.length_m[p], own.width_m[p])


@compiled
def other_box(others: Box, n: int, b: int) -> Box:
    return Box(
        others.x_m[n, b], others.y_m[n, b], others.heading_rad[n, b], others.length_m[n, b], others.width_m[n, b]
    )
