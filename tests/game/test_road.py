"""Location of players on their routes, and look-up of rails near a point."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.game.arrays import FloatArray
from harness.game.bicycle import curvature_per_m, requests
from harness.game.rails import Rails
from harness.game.road import MARGIN_M, SPACING_M, Along, Routes, along, steering_of_bend_rad
from tests.support.bicycle import actuators, advance, state_of
from tests.support.roads import arc, on_arc, straight


def locate(routes: Routes, points: list[tuple[float, float]], before: list[float]) -> tuple[FloatArray, FloatArray]:
    x, y = np.array([points]).transpose(2, 0, 1)
    station, offset = routes.locate(x, y, np.array([before]))
    return station[0], offset[0]


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


def test_rows__stay_within_a_players_own_route() -> None:
    routes = Routes.of([straight(0.0), straight(0.0)])
    rows = routes.rows(np.array([[1e4, -1e4]]))
    assert rows[0, 0] == routes.last_row[0]
    assert rows[0, 1] == routes.first_row[1]


# --- the wheel that follows the road ---------------------------------------------------------------------------------


def road_steering_rad(
    routes: Routes, station_m: FloatArray, speed_mps: FloatArray, wheelbase_m: FloatArray
) -> FloatArray:
    """The steering angles that follow the routes, [G, P], of cars on their lines."""
    on_line, limits = np.zeros_like(station_m), np.ones(len(station_m))
    no_lag_s = np.zeros_like(wheelbase_m)
    found = along((station_m, on_line, speed_mps), limits, (wheelbase_m, no_lag_s), tuple(routes))
    return Along(*found).road_steering_rad


@pytest.mark.parametrize("radius", [15.0, -15.0, 25.0, -60.0])
@pytest.mark.parametrize("speed", [4.0, 8.0])
def test_road_steering__a_wheel_of_0_follows_a_quarter_circle(radius: float, speed: float) -> None:
    """From the straight into the bend, through a quarter circle and out of it, without any correction."""
    routes = Routes.of([arc(radius, length=abs(radius) * np.pi / 2.0)])
    state, car = state_of(speed), actuators()
    state.x_m[:] = -10.0
    state.station_m, offset = routes.locate(state.x_m, state.y_m, np.full((1, 1), -10.0))
    offsets = []
    while state.station_m[0, 0] < abs(radius) * np.pi / 2.0 + 5.0:
        bend = road_steering_rad(routes, state.station_m, state.speed_mps, car.wheelbase_m)
        acceleration, steering = requests(np.zeros((1, 1, 2)), state.speed_mps, bend, car)
        advance(state, float(acceleration[0, 0]), float(steering[0, 0]), car)
        state.station_m, offset = routes.locate(state.x_m, state.y_m, state.station_m)
        offsets.append(offset[0, 0])
    assert np.abs(offsets).max() < 0.1
    assert state.heading_rad[0, 0] == pytest.approx(np.sign(radius) * np.pi / 2.0, abs=0.02)


@pytest.mark.parametrize(
    ("station", "speed", "bend"),
    [
        (-20.0, 5.0, 0.0),  # straight
        (-1.15, 10.0, 0.0),  # the rear axle is 1.35 m behind, in 0.05 s at -2 m: the 4 m around it are straight
        (0.85, 10.0, 0.5),  # at 0 m: the bend begins half-way through the 4 m
        (2.85, 10.0, 1.0),  # at 2 m: all of them
        (0.35, 0.0, 0.25),  # at -1 m
        (31.35, 0.0, 1.0),
    ],
)
def test_road_steering__is_that_of_the_bend_at_the_rear_axle(station: float, speed: float, bend: float) -> None:
    routes = Routes.of([arc(20.0)])
    found = road_steering_rad(routes, np.array([[station]]), np.array([[speed]]), np.array([2.7]))
    # a bend of 20 m: tan = 2.7 / 20 / sqrt(1 - (2.7 / 20 / 2)^2)
    turn = bend * 2.7 / 20.0
    assert found[0, 0] == pytest.approx(np.arctan(turn / np.sqrt(1.0 - 0.25 * turn**2)), abs=1e-9)


@settings(max_examples=100, deadline=None)
@given(radius=st.floats(2.7, 1e4), sign=st.sampled_from([-1.0, 1.0]))
def test_steering_of_bend__drives_the_bend(radius: float, sign: float) -> None:
    steering = steering_of_bend_rad(sign / radius, 2.7)
    assert curvature_per_m(np.array(steering), np.array(2.7)) == pytest.approx(sign / radius, rel=1e-9)


# --- limits ahead ----------------------------------------------------------------------------------------------------


def test_approach__comfortable_braking_reaches_a_lower_limit_ahead() -> None:
    slow_from = 40.0
    road = straight(0.0)
    stations = np.arange(len(road.x_m)) * SPACING_M - MARGIN_M
    routes = Routes.of([replace(road, speed_limit_mps=np.where(stations >= slow_from, 5.0, 13.0))])
    rows = routes.rows(np.array([[slow_from], [slow_from - 6.0], [slow_from - 36.0], [slow_from - 40.0]]))[:, 0]
    # 25 + 2 * 2 * 6 = 49; 25 + 2 * 2 * 36 = 169
    assert routes.approach_mps[rows] == pytest.approx([5.0, 7.0, 13.0, 13.0])


# --- rails -----------------------------------------------------------------------------------------------------------


def to_mm(limit_m: float) -> st.SearchStrategy[float]:
    return st.integers(round(-1000 * limit_m), round(1000 * limit_m)).map(lambda mm: mm / 1000)


POINT = st.tuples(to_mm(150.0), to_mm(80.0))
SEGMENTS = st.lists(st.tuples(POINT, POINT).filter(lambda ends: ends[0] != ends[1]), min_size=1, max_size=12)


@settings(max_examples=60, deadline=None)
@given(segments=SEGMENTS, points=st.lists(POINT, min_size=1, max_size=8), reach=st.sampled_from([5.0, 20.0]))
def test_rails__all_segments_within_reach_are_found(
    segments: list[tuple[tuple[float, float], tuple[float, float]]],
    points: list[tuple[float, float]],
    reach: float,
) -> None:
    rails = Rails.of(np.array(segments), reach)
    x, y = np.array(points).T[:, :, None]
    rows, of_point = rails.lists(x, y)
    found = rails.segments[rows[of_point[:, 0]]]
    for k, point in enumerate(points):
        known = {tuple(each.ravel()) for each in found[k]}
        for each in segments:
            if shapely.LineString(each).distance(shapely.Point(point)) <= reach:
                assert tuple(np.ravel(each)) in known


def test_rails__a_point_far_away_is_no_error() -> None:
    rails = Rails.of(np.array([[[0.0, 0.0], [10.0, 0.0]]]), 20.0)
    for place in (1e4, -1e4, np.inf, np.nan):
        rows, of_point = rails.lists(np.array([[place]]), np.array([[place]]))
        assert 0 <= of_point.item() < len(rows)
