"""Location of players on their routes, and look-up of rails near a point."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.game.arrays import FloatArray
from harness.game.rails import Rails
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


def locate(routes: Routes, points: list[tuple[float, float]], before: list[float]) -> tuple[FloatArray, FloatArray]:
    x, y = np.array([points]).transpose(2, 0, 1)
    station, offset = routes.locate(x, y, np.array([before]))
    return station[0], offset[0]


@pytest.mark.parametrize("heading", [0.0, 0.7, np.pi / 2, -2.5])
def test_locate__on_a_straight_road(heading: float) -> None:
    # 31.37 m along, 1.2 m to the left
    x = 31.37 * np.cos(heading) - 1.2 * np.sin(heading)
    y = 31.37 * np.sin(heading) + 1.2 * np.cos(heading)
    station, offset = locate(Routes.of([straight(heading)]), [(x, y)], [29.0])
    assert station[0] == pytest.approx(31.37, abs=1e-9)
    assert offset[0] == pytest.approx(1.2, abs=1e-9)


def test_locate__works_before_the_start_and_beyond_the_end() -> None:
    station, offset = locate(Routes.of([straight(0.0), straight(0.0)]), [(-7.3, 0.4), (103.1, -2.0)], [-5.0, 100.0])
    assert station == pytest.approx([-7.3, 103.1])
    assert offset == pytest.approx([0.4, -2.0])


@settings(max_examples=100, deadline=None)
@given(
    radius=st.sampled_from([8.0, -8.0, 12.0, 25.0, -60.0, 300.0]),
    station=st.floats(5.0, 55.0),
    inside=st.floats(-0.9, 0.6),
    moved=st.floats(-1.0, 3.0),
)
def test_locate__on_a_curve_is_exact_to_a_centimetre(
    radius: float, station: float, inside: float, moved: float
) -> None:
    offset = np.sign(radius) * min(abs(radius), 10.0) * inside  # up to 9 m to the outside, 6 m to the inside
    point = on_arc(radius, station, float(offset))
    found, found_offset = locate(Routes.of([arc(radius)]), [point], [station - moved])
    assert found[0] == pytest.approx(station, abs=0.01)
    assert found_offset[0] == pytest.approx(offset, abs=0.01)


def test_locate__every_player_has_its_own_route() -> None:
    routes = Routes.of([straight(0.0, 40.0), arc(20.0), straight(np.pi / 2, 90.0, lanes=3)])
    station, offset = locate(routes, [(12.0, 1.0), on_arc(20.0, 30.0, -2.0), (-0.5, 70.2)], [11.0, 29.0, 69.0])
    assert station == pytest.approx([12.0, 30.0, 70.2], abs=0.01)
    assert offset == pytest.approx([1.0, -2.0, 0.5], abs=0.01)
    assert routes.goal_m.tolist() == [35.0, 55.0, 85.0]
    assert routes.lane_offset_m.shape[1] == 3
    assert np.isnan(routes.lane_offset_m[routes.first_row[0], 1:]).all()  # the first route has one lane


def test_locate__follows_a_car_round_a_hairpin() -> None:
    routes, station = Routes.of([arc(6.0, 18.0)]), 0.0
    for true in np.arange(0.0, 18.0, 0.8):
        found, _ = locate(routes, [on_arc(6.0, true, -3.0)], [station])
        station = float(found[0])
        assert station == pytest.approx(true, abs=0.02)


def test_rows__stay_within_a_players_own_route() -> None:
    routes = Routes.of([straight(0.0), straight(0.0)])
    rows = routes.rows(np.array([[1e4, -1e4]]))
    assert rows[0, 0] == routes.last_row[0]
    assert rows[0, 1] == routes.first_row[1]


POINT = st.tuples(st.floats(-150.0, 150.0), st.floats(-80.0, 80.0))
SEGMENTS = st.lists(st.tuples(POINT, POINT), min_size=1, max_size=12)


@settings(max_examples=60, deadline=None)
@given(segments=SEGMENTS, points=st.lists(POINT, min_size=1, max_size=8), reach=st.sampled_from([5.0, 20.0]))
def test_rails__all_segments_within_reach_are_found(
    segments: list[tuple[tuple[float, float], tuple[float, float]]],
    points: list[tuple[float, float]],
    reach: float,
) -> None:
    rails = Rails.of(np.array(segments), reach)
    x, y = np.array(points).T[:, :, None]
    found = rails.segments[rails.near(x, y)[:, 0]]
    for k, point in enumerate(points):
        known = {tuple(each.ravel()) for each in found[k]}
        for each in segments:
            if distance(np.array(point), np.array(each)) <= reach:
                assert tuple(np.ravel(each)) in known


def distance(point: FloatArray, segment: FloatArray) -> float:
    start, span = segment[0], segment[1] - segment[0]
    share = np.clip((point - start) @ span / max(span @ span, 1e-12), 0.0, 1.0)
    return float(np.linalg.norm(point - start - share * span))


def test_rails__may_be_empty() -> None:
    rails = Rails.of(np.zeros((0, 2, 2)), 20.0)
    near = rails.near(np.array([[0.0, 500.0]]), np.array([[0.0, -500.0]]))
    assert (np.abs(rails.segments[near]) > 1e5).all()  # only the padding


def test_rails__a_point_far_away_is_no_error() -> None:
    rails = Rails.of(np.array([[[0.0, 0.0], [10.0, 0.0]]]), 20.0)
    for place in (1e4, -1e4, np.inf, np.nan):
        assert rails.near(np.array([[place]]), np.array([[place]])).shape[:2] == (1, 1)
