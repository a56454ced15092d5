"""Exact geometry of oriented boxes and line segments. Shapes broadcast; nothing here knows of games or roads.

Everything is worked out in a box's own frame, where a box is |u| <= half length, |v| <= half width: for convex shapes
the distance is that of a corner of one to the other, and they touch unless an axis of either separates them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from harness.game.arrays import BoolArray, FloatArray

_ALONG = np.array([0.5, 0.5, -0.5, -0.5])
_ACROSS = np.array([0.5, -0.5, -0.5, 0.5])


class Box(NamedTuple):
    """Oriented boxes by centre, heading and size, each [...]."""

    x_m: FloatArray
    y_m: FloatArray
    heading_rad: FloatArray
    length_m: FloatArray
    width_m: FloatArray


def corners(box: Box) -> tuple[FloatArray, FloatArray]:
    """x, y [..., 4] of a box's corners: front left, front right, rear right, rear left."""
    cos, sin = np.cos(box.heading_rad)[..., None], np.sin(box.heading_rad)[..., None]
    along, across = box.length_m[..., None] * _ALONG, box.width_m[..., None] * _ACROSS
    return box.x_m[..., None] + along * cos - across * sin, box.y_m[..., None] + along * sin + across * cos


def _corners_in_frame(of: Box, frame: Box) -> tuple[FloatArray, FloatArray]:
    """u, v [..., 4] of the corners of one box in the frame of another."""
    turned = of.heading_rad - frame.heading_rad
    cos, sin = np.cos(frame.heading_rad), np.sin(frame.heading_rad)
    dx, dy = of.x_m - frame.x_m, of.y_m - frame.y_m
    centre = np.zeros_like(turned)
    u, v = corners(Box(centre, centre, turned, of.length_m, of.width_m))
    return u + (dx * cos + dy * sin)[..., None], v + (dy * cos - dx * sin)[..., None]


def _beyond(u: FloatArray, v: FloatArray, box: Box) -> tuple[FloatArray, FloatArray]:
    """How far points [..., n] of a box's frame lie beyond its ends and its sides; negative within."""
    return np.abs(u) - 0.5 * box.length_m[..., None], np.abs(v) - 0.5 * box.width_m[..., None]


def _separated(u: FloatArray, v: FloatArray, box: Box) -> BoolArray:
    """Whether an axis of the box separates it from the convex hull of points [..., n] of its frame."""
    half_length, half_width = 0.5 * box.length_m, 0.5 * box.width_m
    return (u.min(-1) > half_length) | (u.max(-1) < -half_length) | (v.min(-1) > half_width) | (v.max(-1) < -half_width)


def box_distance(a: Box, b: Box) -> FloatArray:
    """[...] distance between boxes; 0 where they share a point (separating axis theorem)."""
    nearest, apart = [], []
    for frame, other in ((a, b), (b, a)):
        u, v = _corners_in_frame(other, frame)
        along, across = _beyond(u, v, frame)
        nearest.append(np.hypot(np.maximum(along, 0.0), np.maximum(across, 0.0)).min(-1))
        apart.append(_separated(u, v, frame))
    return np.where(apart[0] | apart[1], np.minimum(*nearest), 0.0)


def time_to_contact(a: Box, b: Box, velocity_x_mps: FloatArray, velocity_y_mps: FloatArray) -> FloatArray:
    """[...] seconds until box b, moving at that velocity relative to a, touches a; inf if never.

    Exact for boxes that keep heading and velocity (separating axes, swept in time): 0 where they touch.
    """
    enter, leave = np.full(np.shape(velocity_x_mps), -np.inf), np.full(np.shape(velocity_x_mps), np.inf)
    for frame, other, sign in ((a, b, 1.0), (b, a, -1.0)):
        cos, sin = np.cos(frame.heading_rad), np.sin(frame.heading_rad)
        rates = (
            sign * (velocity_x_mps * cos + velocity_y_mps * sin),
            sign * (velocity_y_mps * cos - velocity_x_mps * sin),
        )
        halves = (0.5 * frame.length_m, 0.5 * frame.width_m)
        for place, rate, half in zip(_corners_in_frame(other, frame), rates, halves, strict=True):
            first, last = _overlap_interval(place.min(-1) - half, place.max(-1) + half, rate)
            enter, leave = np.maximum(enter, first), np.minimum(leave, last)
    return np.where((enter <= leave) & (leave >= 0.0), np.maximum(enter, 0.0), np.inf)


def _overlap_interval(low: FloatArray, high: FloatArray, rate: FloatArray) -> tuple[FloatArray, FloatArray]:
    """When [low, high] + rate * t contains 0."""
    moving = np.abs(rate) > 1e-9
    safe = np.where(moving, rate, 1.0)
    one, two = -low / safe, -high / safe
    always = (low <= 0.0) & (high >= 0.0)
    still_enter, still_leave = np.where(always, -np.inf, np.inf), np.where(always, np.inf, -np.inf)
    return (
        np.where(moving, np.minimum(one, two), still_enter),
        np.where(moving, np.maximum(one, two), still_leave),
    )


def box_segment_distance(box: Box, segments: FloatArray) -> FloatArray:
    """[...] distance of a box to segments [..., 2, 2] (start and end, x and y); 0 where they touch."""
    cos, sin = np.cos(box.heading_rad), np.sin(box.heading_rad)
    dx, dy = segments[..., 0] - box.x_m[..., None], segments[..., 1] - box.y_m[..., None]
    u, v = dx * cos[..., None] + dy * sin[..., None], dy * cos[..., None] - dx * sin[..., None]
    along, across = _beyond(u, v, box)
    from_ends = np.hypot(np.maximum(along, 0.0), np.maximum(across, 0.0)).min(-1)

    span_u, span_v = u[..., 1] - u[..., 0], v[..., 1] - v[..., 0]
    corner_u = box.length_m[..., None] * _ALONG - u[..., :1]
    corner_v = box.width_m[..., None] * _ACROSS - v[..., :1]
    span2 = np.maximum(span_u * span_u + span_v * span_v, 1e-12)
    share = (corner_u * span_u[..., None] + corner_v * span_v[..., None]) / span2[..., None]
    share = np.minimum(np.maximum(share, 0.0), 1.0)
    from_corners = np.hypot(corner_u - share * span_u[..., None], corner_v - share * span_v[..., None]).min(-1)

    side = corner_u * span_v[..., None] - corner_v * span_u[..., None]
    apart = _separated(u, v, box) | (side.min(-1) > 0.0) | (side.max(-1) < 0.0)
    return np.where(apart, np.minimum(from_ends, from_corners), 0.0)
