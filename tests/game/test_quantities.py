"""The quantities of one moment by hand, on the merge road and on a road with a bend.

On the merge road lane 1 (y = -1.6) continues and lane 0 (y = -4.8) ends at 100 m. Cars are 4.6 m by 1.8 m.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from harness.game.outcome import Outcome
from harness.game.quantities import REACH_M
from harness.game.rails import Rails
from harness.game.road import MARGIN_M, SPACING_M, Road, Routes
from harness.game.world import World
from tests.support.moments import Moment, car
from tests.support.roads import route

LANE_0_M, LANE_1_M = -4.8, -1.6


def turning(world: World, radius_m: float, turned_rad: float) -> World:
    """The same cars on a road of 20 m to the east from the origin, a left bend, and a straight."""
    at = np.arange(-MARGIN_M, 150.0 + MARGIN_M, SPACING_M)
    turned = np.clip((at - 20.0) / radius_m, 0.0, turned_rad)
    beyond = np.maximum(at - 20.0 - radius_m * turned_rad, 0.0)
    x = np.minimum(at, 20.0) + radius_m * np.sin(turned) + beyond * np.cos(turned_rad)
    y = radius_m * (1.0 - np.cos(turned)) + beyond * np.sin(turned_rad)
    bent = route(x, y, turned, 150.0)
    rails = Rails.of(np.zeros((0, 2, 2)), 20.0)
    return replace(world, road=Road(rails, Routes.of([bent, bent])))


@pytest.fixture(scope="module")
def bend(world: World) -> World:
    """A bend of 15 m radius to the north."""
    return turning(world, 15.0, np.pi / 2.0)


@pytest.fixture(scope="module")
def hairpin(world: World) -> World:
    """A hairpin of 4 m radius: the road returns 8 m to the north."""
    return turning(world, 4.0, np.pi)


GONE = {"present": False, "outcome": Outcome.GOAL}


# --- the leader ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("other", "gap_m"),
    [
        (car(40.0, LANE_0_M), np.inf),  # in the next lane
        (car(40.0, -3.3), 15.4),  # partly in the lane: 1.7 m aside, less than 0.9 + 0.9 m of half widths
        (car(40.0, -3.5), np.inf),
        (car(40.0, heading_rad=np.pi / 2), 20.0 - 2.3 - 0.9),  # across the lane
        (car(80.5), np.inf),  # beyond sight
        (car(22.0), 0.0),  # never negative
    ],
)
def test_leader_gap__is_that_to_a_car_in_the_way(
    moment: Moment, world: World, other: dict[str, float], gap_m: float
) -> None:
    assert moment(world, [car(20.0), other]).leader_gap_m[0, 0] == pytest.approx(gap_m)


def test_leader_gap__follows_the_bend(moment: Moment, bend: World) -> None:
    # the leader stands 20 + 15 * pi / 2 + 5 = 48.56 m along the road, 28.56 m ahead, at right angles
    q = moment(bend, [car(20.0, 0.0), car(35.0, 20.0, heading_rad=np.pi / 2)])
    assert q.leader_gap_m[0, 0] == pytest.approx(15.0 * np.pi / 2 + 5.0 - 4.6, abs=0.5)


def test_leader_gap__a_car_ahead_is_the_leader_where_the_road_returns_beside_it(moment: Moment, hairpin: World) -> None:
    # 50 m ahead of the player the road has returned to (10.57, 8), beside the leader at (10.6, 0)
    q = moment(hairpin, [car(-8.0, 0.0), car(10.6, 0.0)])
    assert q.leader_gap_m[0, 0] == pytest.approx(18.6 - 4.6, abs=0.01)


def test_leader_gap__an_oncoming_car_beside_is_no_leader(moment: Moment, hairpin: World) -> None:
    q = moment(hairpin, [car(-8.0, 0.0), car(10.6, 8.0, heading_rad=np.pi)], [car(5.0, 4.0)])
    assert q.leader_gap_m[0, 0] == pytest.approx(50.0 - 4.6, abs=0.1)  # 50 m ahead, where the road has returned


def test_time_gap__is_the_gap_over_own_speed(moment: Moment, world: World) -> None:
    for speed_mps, gap_s in ((12.7, 2.0), (0.0, 254.0)):  # 25.4 / 12.7; of a car that stands as at 0.1 m/s
        q = moment(world, [car(20.0, speed_mps=speed_mps), car(50.0, speed_mps=3.0)])
        assert q.time_gap_s[0] == pytest.approx([gap_s, np.inf])


# --- contact ---------------------------------------------------------------------------------------------------------


def test_time_to_collision__of_a_car_cutting_in(moment: Moment, world: World) -> None:
    # 3.2 m between the centres, both as fast ahead. Turned by asin 0.1, at 10 m/s, it comes nearer by 1 m/s;
    # its front corner reaches out by 2.3 sin + 0.9 cos = 0.23 + 0.8955 = 1.1255 m, the ego's flank by 0.9 m
    turned = np.arcsin(0.1)
    q = moment(world, [car(50.0, speed_mps=10.0 * np.cos(turned)), car(50.0, LANE_0_M, heading_rad=turned)])
    assert q.time_to_collision_s[0, 0] == pytest.approx(3.2 - 0.9 - (0.23 + 0.9 * np.cos(turned)), abs=1e-6)


def test_clearance__at_the_taper(moment: Moment, world: World) -> None:
    # the taper goes from (100, -6.4) to (130, -3.2); the front right corner of a car at (107.7, -4.8) is (110, -5.7);
    # at x = 110 the rail is at -6.4 + 10 * 3.2 / 30 = -5.3333, so the car is through it
    q = moment(world, [car(107.7, LANE_0_M), car(94.7, LANE_0_M)])
    assert (q.rail_clearance_m[0] <= 0.0).tolist() == [True, False]
    # with the corner at (97, -5.7) the nearest of the rail is straight below, 0.7 m
    assert q.rail_clearance_m[0, 1] == pytest.approx(0.7, abs=0.02)


# --- visibility ------------------------------------------------------------------------------------------------------


def test_visible__excludes_the_player_itself_and_bodies_that_are_not_present(moment: Moment, world: World) -> None:
    assert moment(world, [car(20.0), car(50.0)]).visible[0].tolist() == [[False, True], [True, False]]
    q = moment(world, [car(20.0), car(30.0, **GONE)], [car(60.0), car(40.0, present=False)])
    assert q.visible[0].tolist() == [[False, False, True, False], [False] * 4]
    assert q.leader_gap_m[0].tolist() == pytest.approx([35.4, np.inf])
    assert q.vehicle_clearance_m[0, 0] == REACH_M


# --- route -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("y", "offset", "lane_end"),
    [(-1.6, 0.0, np.inf), (-2.1, 0.5, np.inf), (-4.8, 0.0, 40.0), (-3.7, 1.1, 40.0), (-5.5, 0.7, 40.0)],
)
def test_lane__offset_and_end_are_of_the_nearest(
    moment: Moment, world: World, y: float, offset: float, lane_end: float
) -> None:
    q = moment(world, [car(60.0, y), car(10.0)])
    assert q.lane_offset_m[0, 0] == pytest.approx(offset, abs=1e-6)
    assert q.lane_end_m[0, 0] == pytest.approx(lane_end, abs=1e-6)


def test_path__looks_along_the_bend(moment: Moment, bend: World) -> None:
    q = moment(bend, [car(0.0, 0.0), car(5.0, 0.0)])
    # 0, 5, 10, 20 m ahead are straight; 30 m ahead is 10 m into a bend of 15 m radius; 50 m ahead is beyond it
    assert q.path_heading_rad[0, 0, 2:] == pytest.approx([0.0, 0.0, 0.0, 0.0, 10.0 / 15.0, np.pi / 2], abs=0.02)


def test_leader_gap__does_not_depend_on_the_route_stations(moment: Moment, world: World) -> None:
    # bumper to bumper: 20 m between centres less a car of 4.6 m, everywhere on the road (stations are 0.5 m apart)
    for x in (50.0, 50.1, 50.25, 50.3, 50.49):
        assert moment(world, [car(x), car(x + 20.0)]).leader_gap_m[0, 0] == pytest.approx(15.4, abs=1e-9)
