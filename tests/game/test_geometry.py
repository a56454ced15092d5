"""Boxes and segments, compared with shapely and with hand calculations."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.game.arrays import FloatArray
from harness.game.geometry import (
    Box,
    box_distance,
    distance_to_nearest_box,
    distance_to_nearest_segment,
    time_to_contact,
    time_to_first_contact,
)
from harness.road.scene.open_obstacles import polygon_of

NUMBER = st.floats(-12.0, 12.0).map(lambda value: round(value, 3))


def box(x: float, y: float, heading: float = 0.0, length: float = 4.6, width: float = 1.8) -> Box:
    return Box(*(float(each) for each in (x, y, heading, length, width)))


BOXES = st.builds(
    box,
    NUMBER,
    NUMBER,
    st.one_of(st.sampled_from([0.0, np.pi / 2, np.pi, -np.pi / 4]), st.floats(-4.0, 4.0)),
    st.floats(0.3, 12.0),
    st.floats(0.3, 3.0),
)


def segment(x1: float, y1: float, x2: float, y2: float) -> FloatArray:
    return np.array([[x1, y1], [x2, y2]])


def touch(a: Box, b: Box) -> bool:
    """Contact as defined in the game: the distance is exactly 0."""
    return box_distance(a, b) == 0.0


@settings(max_examples=300, deadline=None)
@given(BOXES, BOXES)
def test_boxes__distance_and_touch_are_shapelys(a: Box, b: Box) -> None:
    distance = polygon_of(a).distance(polygon_of(b))
    assert box_distance(a, b) == pytest.approx(distance, abs=1e-6)
    assert box_distance(b, a) == pytest.approx(distance, abs=1e-6)
    if distance > 1e-6:
        assert not touch(a, b)
    elif polygon_of(a).intersection(polygon_of(b)).area > 1e-6:
        assert touch(a, b)
    assert touch(a, b) == touch(b, a) or distance < 1e-9


def columns(*boxes: Box) -> Box:
    """Boxes as one row [1, B]."""
    return Box(*(np.array([each]) for each in zip(*boxes, strict=True)))


def players(*boxes: Box) -> Box:
    """Boxes as one row of players: places [1, P], sizes [P]."""
    return Box(*columns(*boxes)[:3], *(each[0] for each in columns(*boxes)[3:]))


@settings(max_examples=100, deadline=None)
@given(st.lists(BOXES, min_size=2, max_size=2), st.lists(BOXES, min_size=1, max_size=5), st.floats(0.5, 15.0))
def test_nearest_box__is_the_least_distance_of_those_marked(own: list[Box], others: list[Box], limit: float) -> None:
    among = np.array([[[(p + b) % 2 == 0 for b in range(len(others))] for p in range(2)]])
    found = distance_to_nearest_box(players(*own), columns(*others), among, limit)
    for p in range(2):
        distances = [polygon_of(own[p]).distance(polygon_of(b)) for k, b in enumerate(others) if among[0, p, k]]
        assert found[0, p] == pytest.approx(min([*distances, limit]), abs=1e-6)


@settings(max_examples=300, deadline=None)
@given(BOXES, st.lists(st.tuples(NUMBER, NUMBER, NUMBER, NUMBER), min_size=1, max_size=6), st.floats(0.5, 15.0))
def test_nearest_segment__is_the_least_distance_of_the_rows(
    a: Box, ends: list[tuple[float, float, float, float]], limit: float
) -> None:
    segments = np.array([segment(*each) for each in ends])
    rows = np.arange(0, len(ends), 2)[None]  # every second segment
    distances = [polygon_of(a).distance(shapely.LineString(segments[k])) for k in rows[0]]
    found = distance_to_nearest_segment(players(a), segments, (rows, np.zeros((1, 1), dtype=np.int64)), limit)
    assert found[0, 0] == pytest.approx(min([*distances, limit]), abs=1e-6)


def test_first_contact__is_the_soonest_of_those_marked() -> None:
    # 20 m ahead at 5 m/s less: 4 s; 10 m behind at 5 m/s more: 2 s; the one that touches is not marked
    others = columns(box(24.6, 0), box(-14.6, 0), box(1, 0))
    speeds = np.array([[10.0]]), np.array([[5.0, 15.0, 10.0]])
    for among, seconds in (([True, True, False], 2.0), ([True, False, False], 4.0), ([False] * 3, np.inf)):
        found = time_to_first_contact(players(box(0, 0)), others, speeds, np.array([[among]]))
        assert found[0, 0] == pytest.approx(seconds)


@pytest.mark.parametrize(
    ("place", "velocity", "seconds"),
    [
        ((24.6, 0.0), (-5.0, 0.0), 4.0),  # centres 24.6 m apart, less 4.6 m of car: 20 m at 5 m/s
        # corner meets corner: along they overlap from (10 - 4.6) / 2 = 2.7 s on, across from (6 - 1.8) / 1 = 4.2 s on
        ((10.0, 6.0), (-2.0, -1.0), 4.2),
        *(((24.6, 0.0), velocity, np.inf) for velocity in ((5.0, 0.0), (-5.0, 3.0), (0.0, 0.0), (0.0, 8.0))),
    ],
)
def test_time_to_contact__by_hand(place: tuple[float, float], velocity: tuple[float, float], seconds: float) -> None:
    assert time_to_contact(box(0, 0), box(*place), *velocity) == pytest.approx(seconds)


@settings(max_examples=60, deadline=None)
@given(BOXES, BOXES, st.floats(-8.0, 8.0), st.floats(-8.0, 8.0))
def test_time_to_contact__agrees_with_moving_the_box_in_small_steps(a: Box, b: Box, vx: float, vy: float) -> None:
    found = time_to_contact(a, b, vx, vy)
    back = time_to_contact(b, a, -vx, -vy)
    assert found == pytest.approx(back, abs=1e-6) or min(found, back) > 1e3
    times = np.arange(0.0, 6.0, 0.02)
    moved = shapely.polygons(shapely.get_coordinates(polygon_of(b)) + times[:, None, None] * np.array([vx, vy]))
    distance = shapely.distance(moved, polygon_of(a))
    graze = 0.02 * np.hypot(vx, vy) + 1e-6  # a contact shorter than this can fall between two steps
    touching = np.flatnonzero(distance <= 0.0)
    if len(touching):
        first = times[touching[0]]
        assert first - 0.02 - 1e-6 <= found <= first + 1e-6
    elif np.isfinite(found) and found < 5.9:
        assert distance.min() <= graze  # a contact between two steps
