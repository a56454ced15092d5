"""Measures of severity, compared with cases computed by hand: boxes at any angle, contacts and near misses.

The road of the merge runs east; its lanes are centred on y = -4.8 and -1.6 m. Cars are 5 m long and 1.8 m wide.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any, get_args

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, seed
from hypothesis import strategies as st

from harness.environments.recorded import kinds_of
from harness.evaluation.measured_game import METRICS_OF_GAMES, measured
from harness.evaluation.recorded_game import BodyKind
from harness.evaluation.severity.contact import impact_angle_rad, needed_braking_mps2, post_encroachment_s
from harness.evaluation.severity.impact import Hit, Side, side_of
from harness.evaluation.severity.injury import risk_of
from harness.evaluation.severity.limits import mass_kg
from harness.game.geometry import Box
from harness.game.sight import Hiding
from harness.game.world import World
from harness.reports.columns_page import columns_page
from harness.road.demand.walks import WALKER_TYPE
from harness.road.scene.open_scene import open_scene
from tests.support.repository import REPOSITORY
from tests.support.traces import along, game, rows

OF_SEVERITY = [each.column.name for each in METRICS_OF_GAMES]
KINDS = {
    "car": BodyKind(),
    "ego_car": BodyKind(length_m=4.6),  # the scene's ego
    "truck": BodyKind(vehicle_class="truck"),
    "foot": BodyKind(length_m=0.5, width_m=0.5, vehicle_class="pedestrian"),
}
NEAR = ("near_miss", "near_miss_ttc", "near_miss_pet", "near_miss_headway")
QUARTER = 0.5 * math.pi


def severity(merge: Any, *players: list[dict]) -> dict[str, Any]:
    return cells_of(merge.world, pd.DataFrame([row for player in players for row in player]))


def cells_of(world: World, trace: pd.DataFrame) -> dict[str, Any]:
    """The cells of severity that are measured."""
    cells = measured(game(world, trace, KINDS))
    return {name: cells[name] for name in OF_SEVERITY if cells[name] is not None}


# --- contacts -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("speed_mps", "other", "expected"),
    [
        # 14 m/s into 4 m/s: both go on at 9 m/s; the gap is 1.5 m at the start and -0.5 m after 2 steps
        (
            14.0,
            rows("non_ego", along(26.5, -1.6, 0.0, 4.0, 3)),
            {
                "mais3_risk_high": 0.1,
                "closing_speed_mps": 10.0,
                "ego_delta_v_mps": 5.0,
                "other_delta_v_mps": 5.0,
                "severity": 305.0,
            },
        ),
        # 70 kg at rest, 1500 kg at 10 m/s: 10 * 1500 / 1570 = 9.554
        (
            10.0,
            rows("walker", along(24.5, -1.6, QUARTER, 0.0, 3), kind="foot"),
            {"other_delta_v_mps": 9.554, "severity": 309.554, "mais3_risk_low": 0.1},  # 36 km/h
        ),
        # ego 12 m/s east, the other 5 m/s north: 13 m/s; it reaches the ego's right side at y = -1.6 - 0.9
        (
            12.0,
            rows("non_ego", along(22.0, -5.9, QUARTER, 5.0, 3)),
            {"closing_speed_mps": 13.0, "ego_delta_v_mps": 6.5, "impact_side": "right"},
        ),
    ],
    ids=["rear end of equal cars", "pedestrian", "crossing car"],
)
def test_contact__by_hand(speed_mps: float, other: list[dict], expected: dict[str, Any], merge: Any) -> None:
    cells = severity(merge, rows("ego", along(20.0, -1.6, 0.0, speed_mps, 3), end="collision"), other)
    assert cells["near_miss"] == 0
    for name, value in expected.items():
        assert cells[name] == (value if isinstance(value, str) else pytest.approx(value, abs=1e-3))


def test_contact__a_player_on_foot_weighs_a_person() -> None:
    """Its vehicle type is the harness's own, and to SUMO a car."""
    kinds = kinds_of(open_scene(REPOSITORY / "networks" / "zebra"))
    assert mass_kg(kinds[WALKER_TYPE].vehicle_class) == 70.0
    assert mass_kg(kinds["ego_car"].vehicle_class) == 1500.0


def test_contact__an_obstacle_does_not_move(merge: Any) -> None:
    ego = rows("ego", along(20.0, -1.6, 0.0, 10.0, 3), end="collision")
    trace = pd.DataFrame([*ego, *rows("obstacle_1", along(26.5, -1.6, 0.0, 0.0, 3))])
    world = replace(merge.world, hiding=Hiding(obstacles=np.array([False])))
    cells = cells_of(world, trace)
    assert (cells["ego_delta_v_mps"], cells["other_delta_v_mps"]) == (pytest.approx(10.0), 0.0)


@pytest.mark.parametrize(
    ("other", "velocity", "side"),
    [
        (Box(4.9, 0.0, 0.0, 5.0, 1.8), (-10.0, 0.0), "front"),
        (Box(-4.9, 0.5, 0.0, 5.0, 1.8), (10.0, 0.0), "rear"),
        (Box(1.0, 1.75, 0.0, 5.0, 1.8), (0.0, -1.0), "left"),
        (Box(4.0, 1.75, 0.0, 5.0, 1.8), (-4.0, -1.0), "left"),  # met sideways 0.05 s ago, lengthways 0.25 s ago
        (Box(4.9, 1.7, 0.0, 5.0, 1.8), (-4.0, -1.0), "front"),  # met lengthways 0.025 s ago, sideways 0.1 s ago
        (Box(0.0, -3.3, QUARTER, 5.0, 1.8), (0.0, 8.0), "right"),
        (Box(0.0, -1.0, 0.0, 5.0, 1.8), (0.0, 0.0), "right"),  # no motion: the axis of least overlap
    ],
)
def test_impact__is_on_the_side_of_the_surfaces_that_met_last(other: Box, velocity: Any, side: str) -> None:
    own = Box(0.0, 0.0, 0.0, 5.0, 1.8)
    assert side_of(impact_angle_rad(own, other, *velocity)) == side


@pytest.mark.parametrize("turned", [0.7, 2.5, -1.9])
def test_impact__is_the_same_in_every_direction_of_the_compass(turned: float) -> None:
    def rotate(x: float, y: float) -> tuple[float, float]:
        return x * math.cos(turned) - y * math.sin(turned), x * math.sin(turned) + y * math.cos(turned)

    own, other = Box(0.0, 0.0, turned, 5.0, 1.8), Box(*rotate(1.0, 1.75), turned + 0.02, 5.0, 1.8)
    assert side_of(impact_angle_rad(own, other, *rotate(0.0, -1.0))) == "left"


# --- without a contact ----------------------------------------------------------------------------------------------


OWN = Box(0.0, 0.0, 0.0, 5.0, 1.8)
OTHER = np.tile([False, True], (60, 1))


def needed(other: Box, velocity_mps: float, speed_mps: float = 10.0) -> float:
    boxes = Box(*(np.array([[own, float(value)]]) for own, value in zip(OWN, other, strict=True)))
    return float(needed_braking_mps2(boxes, np.array([[speed_mps, velocity_mps]]), OTHER[:1], 0, 8.0, 4.0)[0])


@pytest.mark.parametrize(
    ("other", "velocity_mps", "expected"),
    [
        (Box(15.0, 0.0, 0.0, 5.0, 1.8), 0.0, 5.0),  # 10 m behind a standing car: 10**2 / (2 * 10)
        (Box(15.0, 0.0, 0.0, 5.0, 1.8), 4.0, 1.8),  # a car at 4 m/s: (10 - 4)**2 / (2 * 10)
        (Box(8.0, 0.0, 0.0, 5.0, 1.8), 0.0, 8.0),  # 3 m: 16.7 m/s2 are more than the car can do
        (Box(15.0, 0.0, 0.0, 5.0, 1.8), 10.0, 0.0),  # the same speed
        (Box(15.0, 3.0, 0.0, 5.0, 1.8), 0.0, 0.0),  # beside the way
        (Box(-10.0, 0.0, 0.0, 5.0, 1.8), 20.0, 0.0),  # from behind: it would hit the standing ego as well
        (Box(15.0, 0.0, math.pi, 5.0, 1.8), 10.0, 0.0),  # oncoming: the same
        (Box(60.0, 0.0, 0.0, 5.0, 1.8), 0.0, 0.0),  # 5.5 s away
    ],
)
def test_needed_braking__of_one_moment(other: Box, velocity_mps: float, expected: float) -> None:
    assert needed(other, velocity_mps) == pytest.approx(expected, abs=0.01)


def test_needed_braking__lets_a_crossing_car_pass() -> None:
    # its rear is clear of the ego's way (half widths 0.9, half length 2.5, now 6 m to the right) after
    # (6 + 0.9 + 2.5) / 8 = 1.175 s; the ego's front may cover 10 - 0.9 - 2.5 = 6.6 m until then:
    # 10 * 1.175 - b / 2 * 1.175**2 = 6.6, b = 7.460
    assert needed(Box(10.0, -6.0, QUARTER, 5.0, 1.8), 8.0) == pytest.approx(7.460, abs=0.02)


def presence(x: float, y: float, heading: float, speed: float, steps: int = 60) -> Box:
    poses = np.array(along(x, y, heading, speed, steps))
    return Box(poses[:, 0], poses[:, 1], poses[:, 2], np.full(steps, 5.0), np.full(steps, 1.8))


def pet(own: Box, other: Box) -> float:
    boxes = Box(*(np.stack(columns, axis=1) for columns in zip(own, other, strict=True)))
    return float(post_encroachment_s(boxes, OTHER, 0, math.radians(30.0), 0.1, 50))


def test_post_encroachment__at_a_crossing() -> None:
    # the ego's rear leaves the other's way (x = 0.9 to the right of it) at (20 + 2.5 + 0.9) / 10 = 2.34 s, the other's
    # front enters the ego's way at (40 - 2.5 - 0.9) / 10 = 3.66 s: 1.32 s, in steps of 0.1 s
    own, other = presence(-20.0, 0.0, 0.0, 10.0), presence(0.0, -40.0, QUARTER, 10.0)
    assert pet(own, other) == pytest.approx(1.4)
    assert pet(other, own) == pytest.approx(1.4)


def test_post_encroachment__of_paths_that_do_not_cross_is_unmeasured() -> None:
    assert math.isinf(pet(presence(-20.0, 0.0, 0.0, 10.0), presence(-40.0, 0.0, 0.0, 10.0)))  # one behind the other
    assert math.isinf(pet(presence(-20.0, 0.0, 0.0, 10.0), presence(0.0, -90.0, QUARTER, 10.0)))  # 6.3 s later


def test_closeness__of_following_at_a_lower_speed_each_step(merge: Any) -> None:
    # gap 8 m, 16 m/s behind 12 m/s for 10 steps: in step k the gap is 8 - 0.4 k
    ego = rows("ego", along(20.0, -1.6, 0.0, 16.0, 11), kind="ego_car", end="goal")
    cells = severity(merge, ego, rows("non_ego", along(32.8, -1.6, 0.0, 12.0, 11)))
    gaps = [8.0 - 0.4 * k for k in range(1, 11)]
    ttc = [gap / 4.0 for gap in gaps]
    assert cells["min_time_headway_s"] == pytest.approx(4.0 / 16.0)
    assert cells["time_headway_below_1_s"] == pytest.approx(1.0)
    assert cells["time_exposed_ttc_s"] == pytest.approx(0.1 * sum(each <= 1.5 + 1e-9 for each in ttc))
    assert cells["time_integrated_ttc_s2"] == pytest.approx(0.1 * sum(max(1.5 - each, 0.0) for each in ttc))
    assert cells["needed_braking_mps2"] == pytest.approx(4.0**2 / (2.0 * 4.0), abs=0.01)
    assert cells["used_braking_mps2"] == 0.0
    assert [cells[name] for name in NEAR] == [1, 1, 0, 1]
    # TTC 1 s of 1.5 s, headway 0.25 s of 0.5 s: 100 / (1 + 0.5)
    assert cells["severity"] == pytest.approx(100.0 / 1.5)
    assert "closing_speed_mps" not in cells


@pytest.mark.parametrize(("leader_mps", "is_near"), [(16.5, 0), (16.0, 1), (15.9, 1)])
def test_headway__behind_a_faster_car_is_no_near_miss(leader_mps: float, is_near: int, merge: Any) -> None:
    # 3 m at 16 m/s: 0.1875 s; the gap opens, stays, and closes so slowly that the TTC is 3 / 0.1 = 30 s
    ego = rows("ego", along(20.0, -1.6, 0.0, 16.0, 6), kind="ego_car", end="goal")
    cells = severity(merge, ego, rows("non_ego", along(27.8, -1.6, 0.0, leader_mps, 6)))
    assert cells["min_time_headway_s"] == pytest.approx(3.0 / 16.0, abs=0.02)
    assert [cells[name] for name in NEAR] == [is_near, 0, 0, is_near]
    assert (cells["severity"] >= 50.0) == bool(is_near)


def test_near_miss__by_post_encroachment_time_alone(merge: Any) -> None:
    # at 10 m/s the ego's rear leaves x = 50.9 after (50.9 - 20 + 2.3) / 10 = 3.32 s; the other's front, at 10 m/s from
    # the right, enters y = -2.5 at 4.16 s: 0.9 s in steps of 0.1 s. The two never are on a collision course.
    ego = rows("ego", along(20.0, -1.6, 0.0, 10.0, 60), kind="ego_car", end="goal")
    cells = severity(merge, ego, rows("non_ego", along(50.0, -46.6, QUARTER, 10.0, 60)))
    assert cells["min_post_encroachment_time_s"] == pytest.approx(0.9)
    assert [cells[name] for name in NEAR] == [1, 0, 1, 0]


def test_used_braking__counts_from_when_braking_was_needed(merge: Any) -> None:
    speeds = [16.0, 15.5, 15.5, 15.2, 15.2]  # 5 m/s2 while nobody is near, 3 m/s2 when the other is there
    ego = rows("ego", [(20.0 + 1.5 * k, -1.6, 0.0, speed) for k, speed in enumerate(speeds)], end="goal")
    other = [(35.0 + k, -1.6 if k > 1 else -4.8, 0.0, 10.0) for k in range(5)]
    assert severity(merge, ego, rows("non_ego", other))["used_braking_mps2"] == pytest.approx(3.0)


def test_alone__nothing_is_near(merge: Any) -> None:
    cells = severity(merge, rows("ego", along(20.0, -1.6, 0.0, 14.0, 5), end="goal"))
    assert cells["near_miss"] == 0
    assert cells["severity"] == 0.0
    assert "min_time_headway_s" not in cells
    assert "used_braking_mps2" not in cells


def test_ends__rails_and_timeouts_lie_between(merge: Any) -> None:
    rail = severity(merge, rows("ego", along(20.0, -1.6, 0.1, 14.0, 5), end="rail"))
    timeout = severity(merge, rows("ego", along(20.0, -1.6, 0.0, 0.0, 5), end="timeout"))
    assert (rail["severity"], timeout["severity"]) == (pytest.approx(214.0), pytest.approx(100.0))


def test_without_the_ego__the_person_is_judged_by_severity_alone(merge: Any) -> None:
    assert severity(merge, rows("non_ego", along(20.0, -1.6, 0.1, 9.0, 5), end="rail")) == {
        "severity": pytest.approx(209.0)
    }


# --- tables -----------------------------------------------------------------------------------------------------


def test_page__is_the_one_of_the_command() -> None:
    assert (REPOSITORY / "docs" / "columns.md").read_text(encoding="utf-8") == columns_page()


classes = st.sampled_from(["passenger", "pedestrian", "bicycle", "motorcycle", "truck", "scooter", ""])
hits = st.builds(Hit, vehicle_class=classes, side=st.sampled_from(get_args(Side)), delta_v_mps=st.just(1.0))


def hit(vehicle_class: str, side: Side = "front") -> Hit:
    return Hit(vehicle_class=vehicle_class, side=side, delta_v_mps=5.0)


CAR, WALKER = hit("passenger"), hit("pedestrian", "left")
AT_MOST, AT_LEAST, UNKNOWN = (0.0, 0.1), (0.1, 1.0), (0.0, 1.0)


@pytest.mark.parametrize(
    ("own", "other", "closing_kmh", "bounds"),
    [
        (CAR, WALKER, 28.9, AT_MOST),
        (CAR, WALKER, 31.0, UNKNOWN),  # GIDAS says more than 10 %, TARGET less
        (CAR, WALKER, 34.1, AT_LEAST),
        (WALKER, CAR, 34.1, AT_LEAST),
        (CAR, hit("bicycle", "rear"), 43.0, AT_MOST),
        (CAR, hit("motorcycle"), 49.5, AT_LEAST),
        (CAR, CAR, 98.0, AT_MOST),
        (CAR, hit("passenger", "right"), 74.0, AT_LEAST),  # the near side of the other car
        (CAR, hit("passenger", "rear"), 98.0, AT_MOST),
        (CAR, hit("passenger", "rear"), 120.0, AT_LEAST),  # those in front of 112 km/h
        (hit("passenger", "left"), WALKER, 60.0, None),
        (CAR, hit("truck"), 60.0, None),
        (CAR, hit(""), 60.0, None),
        (WALKER, hit("bicycle"), 60.0, None),
    ],
)
def test_risk__has_the_bounds_of_the_points(
    own: Hit, other: Hit, closing_kmh: float, bounds: tuple[float, float] | None
) -> None:
    assert risk_of(own, other, closing_kmh / 3.6) == bounds


@seed(1)
@given(own=hits, other=hits, speeds=st.lists(st.floats(0.0, 80.0), min_size=2, max_size=6))
def test_risk__grows_with_the_closing_speed_and_is_that_of_both(own: Hit, other: Hit, speeds: list[float]) -> None:
    found = [risk_of(own, other, speed_mps) for speed_mps in sorted(speeds)]
    assert found == [risk_of(other, own, speed_mps) for speed_mps in sorted(speeds)]
    assert len({risk is None for risk in found}) == 1  # whether there is a point does not depend on the speed
    known = [risk for risk in found if risk is not None]
    assert all(0.0 <= risk.low <= risk.high <= 1.0 for risk in known)
    assert all(slow.low <= fast.low and slow.high <= fast.high for slow, fast in pairwise(known))
