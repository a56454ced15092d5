"""Contacts of two oriented boxes at any angle: the side that is hit, and the braking that avoids a contact."""

from __future__ import annotations

from math import atan2, cos, hypot, inf, pi, sin

import numpy as np

from harness.game.arrays import BoolArray, FloatArray
from harness.game.geometry import Box, box_distance, other_box, time_to_contact
from harness.game.jit import compiled

_HORIZON_S = 10.0  # a contact that would be later is avoided
_SUBSTEP_S = 0.1  # the motion of a braking car is linear in between
_HALVINGS = 12


@compiled
def impact_angle_rad(a: Box, b: Box, velocity_x_mps: float, velocity_y_mps: float) -> float:
    """The direction from which box b hits box a, in a's frame: 0 from ahead, counter-clockwise, in (-pi, pi].

    The boxes touch or overlap, and b moves at a velocity relative to a. The direction is the normal of the two surfaces
    that met last: the boxes overlap on every other separating axis before. Without relative motion it is the axis of
    least overlap.
    """
    best_x, best_y, latest, least = 0.0, 0.0, -inf, inf
    dx, dy = b.x_m - a.x_m, b.y_m - a.y_m
    for frame, other in ((a, b), (b, a)):
        turned = other.heading_rad - frame.heading_rad
        for k in range(2):
            axis = frame.heading_rad + 0.5 * pi * k
            x, y = cos(axis), sin(axis)
            own = 0.5 * (frame.length_m if k == 0 else frame.width_m)
            along, across = abs(cos(turned)), abs(sin(turned))
            if k == 1:
                along, across = across, along
            reach = own + 0.5 * (other.length_m * along + other.width_m * across)
            place, rate = dx * x + dy * y, velocity_x_mps * x + velocity_y_mps * y
            sign = 1.0 if place >= 0.0 else -1.0
            overlap = reach - abs(place)
            closing = -sign * rate
            met = -overlap / closing if closing > 1e-9 else -inf  # seconds from now
            if met > latest or (latest == -inf and overlap < least):
                latest, least = max(met, latest), overlap
                best_x, best_y = sign * x, sign * y
    angle = atan2(best_y, best_x) - a.heading_rad
    return pi - (pi - angle) % (2.0 * pi)


@compiled
def needed_braking_mps2(
    boxes: Box, speed_mps: FloatArray, among: BoolArray, player: int, most_mps2: float, within_s: float
) -> FloatArray:
    """[T] the least constant braking (m/s^2), from each moment on, that avoids contact with every other box that the
    player's would touch within `within_s` at constant headings and speeds; 0 where there is none.

    Boxes and speeds [T, B], the player's among them; among [T, B] are the others. The others keep their velocities.
    `most_mps2` where no braking up to it avoids the contact. An other box that would also touch the player's if it
    stood still is left out: braking is no remedy against it.
    """
    needed = np.zeros(len(among))
    for t, b in np.ndindex(among.shape):
        if not among[t, b]:
            continue
        a, other, speed = other_box(boxes, t, player), other_box(boxes, t, b), speed_mps[t, player]
        velocity_x, velocity_y = speed_mps[t, b] * cos(other.heading_rad), speed_mps[t, b] * sin(other.heading_rad)
        contact_s = time_to_contact(
            a, other, velocity_x - speed * cos(a.heading_rad), velocity_y - speed * sin(a.heading_rad)
        )
        if contact_s <= 0.0 or contact_s > within_s or time_to_contact(a, other, velocity_x, velocity_y) < inf:
            continue
        low, high = needed[t], most_mps2
        if low >= most_mps2 or (low > 0.0 and _avoids(low, a, speed, other, velocity_x, velocity_y)):
            continue
        if _avoids(high, a, speed, other, velocity_x, velocity_y):
            for _ in range(_HALVINGS):
                middle = 0.5 * (low + high)
                if _avoids(middle, a, speed, other, velocity_x, velocity_y):
                    high = middle
                else:
                    low = middle
        needed[t] = high
    return needed


@compiled
def _avoids(
    braking_mps2: float, a: Box, speed_mps: float, other: Box, velocity_x_mps: float, velocity_y_mps: float
) -> bool:
    """Whether box a, which brakes from a speed to a standstill, does not touch another of constant velocity within
    `_HORIZON_S`."""
    cosine, sine = cos(a.heading_rad), sin(a.heading_rad)
    time_s = 0.0
    while time_s < _HORIZON_S:
        now_mps = max(speed_mps - braking_mps2 * time_s, 0.0)
        rest_s = now_mps / braking_mps2
        step_s = min(_SUBSTEP_S, rest_s) if rest_s > 0.0 else _HORIZON_S
        mean_mps = now_mps - 0.5 * braking_mps2 * step_s if rest_s > 0.0 else 0.0
        stopped_s = min(time_s, speed_mps / braking_mps2)
        driven_m = (speed_mps - 0.5 * braking_mps2 * stopped_s) * stopped_s
        own = Box(a.x_m + driven_m * cosine, a.y_m + driven_m * sine, a.heading_rad, a.length_m, a.width_m)
        there_x, there_y = other.x_m + velocity_x_mps * time_s, other.y_m + velocity_y_mps * time_s
        there = Box(there_x, there_y, other.heading_rad, other.length_m, other.width_m)
        contact_s = time_to_contact(own, there, velocity_x_mps - mean_mps * cosine, velocity_y_mps - mean_mps * sine)
        if contact_s <= step_s:
            return False
        time_s += step_s
    return True


@compiled
def post_encroachment_s(
    boxes: Box, among: BoolArray, player: int, crossing_rad: float, step_s: float, most: int
) -> float:
    """Least time (s) between the presence of the player's box and of another at one place, whichever is first, if their
    headings there differ by at least `crossing_rad`; inf if it is more than `most` steps.

    Boxes [T, B], the player's among them; among [T, B] whether each is another that is there.
    """
    least = most + 1
    steps = len(among)
    for b in range(among.shape[1]):
        for t in range(steps):
            a = other_box(boxes, t, player)
            for u in range(max(t - least + 1, 0), min(t + least, steps)):
                if not among[u, b]:
                    continue
                other = other_box(boxes, u, b)
                if cos(a.heading_rad - other.heading_rad) > cos(crossing_rad) or abs(t - u) >= least:
                    continue
                if _touch(a, other):
                    least = abs(t - u)
    return least * step_s if least <= most else inf


@compiled
def comes_to_touch(
    boxes: Box, present: BoolArray, judged: BoolArray, partners: BoolArray, on_foot: BoolArray
) -> BoolArray:
    """[B] which of the judged bodies come to touch a partner that they did not touch one step before.

    Boxes and present [T, B]; judged, partners and on_foot [B]. Bodies that touch when the second of them appears do not
    count until they were apart, and two bodies on foot never do.
    """
    found = np.zeros(len(judged), dtype=np.bool_)
    for a, b in np.ndindex(len(judged), len(judged)):
        if a == b or found[a] or not judged[a] or not partners[b] or (on_foot[a] and on_foot[b]):
            continue
        apart = False
        for t in range(len(present)):
            if not (present[t, a] and present[t, b]):
                apart = False
                continue
            touch = _touch(other_box(boxes, t, a), other_box(boxes, t, b))
            if touch and apart:
                found[a] = True
                break
            apart = not touch
    return found


@compiled
def _touch(a: Box, b: Box) -> bool:
    """Whether two boxes share a point."""
    reach_m = 0.5 * (hypot(a.length_m, a.width_m) + hypot(b.length_m, b.width_m))
    return hypot(a.x_m - b.x_m, a.y_m - b.y_m) <= reach_m and box_distance(a, b) <= 0.0
