"""Observations: always in [-1, 1], independent of place and heading, and only what a driver can see."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from harness.game.arrays import FloatArray
from harness.game.observation import observe
from harness.game.observation_layout import LAYOUT, OF_OTHERS, OTHERS, SIZE
from harness.game.outcome import Outcome
from harness.game.quantities import Quantities
from harness.game.rails import Rails
from harness.game.road import AHEAD_M, Road, Routes
from harness.game.world import World
from harness.road.scene.open_scene import OpenScene
from tests.support.moments import Moment, car
from tests.support.roads import straight


def seen(q: Quantities) -> Mapping[str, float]:
    return dict(zip(LAYOUT, observe(q)[0, 0].tolist(), strict=True))


def test_layout__names_every_entry_once() -> None:
    assert len(set(LAYOUT)) == len(LAYOUT) == SIZE
    assert SIZE == 98
    assert OF_OTHERS.sum() == OTHERS * 13 + 3  # and the leader


def test_observation__of_a_car_on_the_merge_road(moment: Moment, world: World) -> None:
    q = moment(
        world, [car(60.0, -4.8, speed_mps=12.0, acceleration_mps2=-2.0, steering_rad=0.06), car(84.0, speed_mps=9.0)]
    )
    entries = seen(q)
    expected = {
        "speed_mps": 12.0 / 30.0,
        "speed_limit_mps": 13.89 / 30.0,
        "speed_over_limit": 12.0 / 13.89 - 1.0,
        "acceleration_mps2": -0.2,
        "steering_rad": 0.1,  # of 0.6
        "road_steering_rad": 0.0,
        "lane_end_m": 0.4,  # 40 of 100 m
        "goal_m": 115.0 / 200.0,
        "own_side_left_m": 1.0,  # a one-way road
        "own_side_right_m": -1.0,
        "path_turned_rad@0m": 0.0,
        "path_left_m": 0.4,  # the route is 3.2 of 8 m to the left
        "free_left_m@0m": 4.8 / 8.0,
        "free_right_m@0m": -1.6 / 8.0,
        "free_left_m@20m": (3.2 - 0.9) / 8.0,  # the other car is there
        "free_right_m@20m": -1.6 / 8.0,
        "free_right_m@50m": -0.5333 / 8.0,  # at x = 110 the taper is at y = -6.4 + 10 * 3.2 / 30 = -5.3333
        "other0_seen": 1.0,
        "stop_line_m": 37.7 / (37.7 + 20.0),  # the junction at 100 m; no sign and no signal
        "leader_gap_m": 0.0,  # none: the other car is in the other lane
        "leader_mps": 0.0,
        "other0_ahead_m": 24.0 / (24.0 + 20.0),
        "other0_left_m": 3.2 / (3.2 + 8.0),
        "other0_ahead_mps": -3.0 / (3.0 + 10.0),  # 3 m/s slower
        "other0_left_mps": 0.0,
        "other0_turned_sin": 0.0,
        "other0_turned_cos": 1.0,
        "other0_length_m": 4.6 / 20.0,
        "other0_width_m": 1.8 / 4.0,
        "other1_seen": 0.0,
    }
    for name, value in expected.items():
        assert entries[name] == pytest.approx(value, abs=2e-3), name


COORDINATE = st.floats(-400.0, 400.0)
CAR = st.fixed_dictionaries(
    {
        "x_m": COORDINATE,
        "y_m": st.one_of(COORDINATE, st.floats(-6.4, 0.0)),
        "heading_rad": st.floats(-np.pi, np.pi),
        "speed_mps": st.floats(0.0, 60.0),
    }
)
PLAYER = st.builds(
    lambda body, more: {**body, **more},
    CAR,
    st.fixed_dictionaries(
        {
            "acceleration_mps2": st.floats(-15.0, 15.0),
            "steering_rad": st.floats(-1.2, 1.2),
            "present": st.booleans(),
            "outcome": st.sampled_from([int(each) for each in Outcome]),
        }
    ),
)


@settings(max_examples=80, deadline=None)
@given(players=st.lists(PLAYER, min_size=2, max_size=2), others=st.lists(CAR, max_size=5))
def test_observation__is_finite_and_within_bounds_for_all_states(
    moment: Moment, merge: OpenScene, players: list[dict[str, Any]], others: list[dict[str, Any]]
) -> None:
    entries = observe(moment(merge.world, players, others))
    assert entries.shape == (1, 2, SIZE)
    assert entries.dtype == np.float32
    assert np.isfinite(entries).all()
    assert np.abs(entries).max() <= 1.0
    for p in range(2):
        if not players[p]["present"]:
            assert not entries[0, p].any()


@pytest.mark.parametrize(("y", "side", "free"), [(-4.8, "right", -2.3), (-1.6, "left", 2.3)])
def test_free_width__is_narrowed_by_a_car_alongside_on_its_side(
    moment: Moment, world: World, y: float, side: str, free: float
) -> None:
    # lanes are 3.2 m apart: from the centre of the one to the flank of a car in the other are 3.2 - 0.9 = 2.3 m
    own = car(50.0, -6.4 - y)
    alone, beside = (seen(moment(world, [own, car(50.5, y, present=there)])) for there in (False, True))
    other = {"left": "right", "right": "left"}[side]
    assert beside[f"free_{side}_m@0m"] == pytest.approx(free / 8.0, abs=1e-3)
    assert abs(beside[f"free_{side}_m@0m"]) < abs(alone[f"free_{side}_m@0m"])
    for distance in AHEAD_M:
        assert beside[f"free_{other}_m@{distance:g}m"] == alone[f"free_{other}_m@{distance:g}m"]
    assert beside[f"free_{side}_m@30m"] == alone[f"free_{side}_m@30m"]


def test_others__are_sorted_by_distance(moment: Moment, world: World) -> None:
    others = [car(90.0), car(62.0), car(40.0), car(75.0)]
    entries = seen(moment(world, [car(50.0), car(56.0, -4.8)], others))
    ahead = [entries[f"other{k}_ahead_m"] for k in range(OTHERS)]
    # 6, 10, 12 and 25 m away; the car 40 m ahead is the fifth
    assert ahead == pytest.approx([6.0 / 26.0, -10.0 / 30.0, 12.0 / 32.0, 25.0 / 45.0], abs=1e-6)


def test_others__beyond_120_m_are_not_seen(moment: Moment, world: World) -> None:
    assert seen(moment(world, [car(10.0), car(131.0)]))["other0_seen"] == 0.0
    assert seen(moment(world, [car(10.0), car(129.0)]))["other0_seen"] == 1.0


def test_leader__is_the_nearest_car_ahead_in_the_own_lane(moment: Moment, world: World) -> None:
    others = [car(60.0, -4.8), car(80.0, speed_mps=4.0), car(75.0, speed_mps=7.0)]
    entries = seen(moment(world, [car(50.0, speed_mps=12.0), car(20.0)], others))
    # from bumper to bumper 25 - 4.6 = 20.4 m; 5 m/s slower
    assert entries["leader_gap_m"] == pytest.approx(20.4 / 40.4)
    assert entries["leader_mps"] == pytest.approx(-5.0 / 15.0)


# --- symmetries ------------------------------------------------------------------------------------------------------


def road(world: World, heading: float, x0: float, y0: float, left: float, right: float, lanes: list[float]) -> World:
    """A straight road of 200 m with any start and heading."""
    table = straight(heading, 200.0, len(lanes), x0, y0)
    n, ends = len(table.x_m), np.where(np.array(lanes) == 0.0, np.inf, 150.0)
    columns = {"left_edge_m": left, "right_edge_m": right, "own_left_m": left - 1.0, "own_right_m": right + 1.0}
    table = replace(
        table,
        **{name: np.full(n, value) for name, value in columns.items()},
        lane_offset_m=np.tile(lanes, (n, 1)),
        lane_end_m=np.tile(ends, (n, 1)),
    )

    def line(offset: float) -> FloatArray:
        x, y = table.x_m - offset * np.sin(heading), table.y_m + offset * np.cos(heading)
        return np.stack((x, y), axis=1)

    rails = np.concatenate([np.stack((line(side)[:-1:20], line(side)[1::20]), axis=1) for side in (left, right)])
    return replace(world, road=Road(Rails.of(rails, 20.0), Routes.of([table, table])))


def placed(each: dict[str, Any], heading: float, x0: float, y0: float) -> dict[str, Any]:
    along, left = each["x_m"], each["y_m"]
    return {
        **each,
        "x_m": x0 + along * np.cos(heading) - left * np.sin(heading),
        "y_m": y0 + along * np.sin(heading) + left * np.cos(heading),
        "heading_rad": each["heading_rad"] + heading,
    }


def mirrored(each: dict[str, Any]) -> dict[str, Any]:
    turned = {name: -each[name] for name in ("y_m", "heading_rad", "steering_rad") if name in each}
    return {**each, **turned}


ON_ROAD = st.fixed_dictionaries(
    {
        "x_m": st.floats(20.0, 120.0),
        "y_m": st.floats(-4.0, 4.0),
        "heading_rad": st.floats(-0.5, 0.5),
        "speed_mps": st.floats(0.0, 30.0),
    }
)


def assume_no_ties(cars: list[dict[str, Any]]) -> None:
    """A vehicle exactly ahead has no side, and one exactly beside is neither ahead nor behind."""
    assume(all(min(np.diff(sorted(each[name] for each in cars))) > 0.01 for name in ("x_m", "y_m")))


DRIVEN = st.builds(lambda body, wheel: {**body, "steering_rad": wheel}, ON_ROAD, st.floats(-0.5, 0.5))


@settings(max_examples=40, deadline=None)
@given(
    players=st.lists(DRIVEN, min_size=2, max_size=2),
    others=st.lists(ON_ROAD, max_size=3),
    heading=st.floats(-3.0, 3.0),
    x0=st.floats(-300.0, 300.0),
    y0=st.floats(-300.0, 300.0),
)
def test_observation__does_not_depend_on_the_place_of_the_road(
    moment: Moment,
    merge: OpenScene,
    players: list[dict[str, Any]],
    others: list[dict[str, Any]],
    heading: float,
    x0: float,
    y0: float,
) -> None:
    assume_no_ties([*players, *others])
    here = road(merge.world, 0.0, 0.0, 0.0, 1.6, -4.8, [0.0, -3.2])
    there = road(merge.world, heading, x0, y0, 1.6, -4.8, [0.0, -3.2])
    one = observe(moment(here, players, others))
    moved = [[placed(each, heading, x0, y0) for each in some] for some in (players, others)]
    two = observe(moment(there, *moved))
    assert close_but_for_ties(one, two)


@settings(max_examples=40, deadline=None)
@given(players=st.lists(DRIVEN, min_size=2, max_size=2), others=st.lists(ON_ROAD, max_size=3))
def test_observation__of_the_mirror_image_is_the_mirror_image(
    moment: Moment, merge: OpenScene, players: list[dict[str, Any]], others: list[dict[str, Any]]
) -> None:
    assume_no_ties([*players, *others])
    one = observe(moment(road(merge.world, 0.0, 0.0, 0.0, 1.6, -4.8, [0.0, -3.2]), players, others))
    image = road(merge.world, 0.0, 0.0, 0.0, 4.8, -1.6, [0.0, 3.2])
    two = observe(moment(image, [mirrored(each) for each in players], [mirrored(each) for each in others]))
    names = {name: k for k, name in enumerate(LAYOUT)}
    back = np.empty_like(two)
    for name, k in names.items():
        swapped = name
        for side in ("free", "own_side"):
            swapped = swapped.replace(f"{side}_left", "?").replace(f"{side}_right", f"{side}_left")
            swapped = swapped.replace("?", f"{side}_right")
        odd = any(part in name for part in ("left", "right", "turned_rad", "turned_sin", "steering", "bend"))
        back[..., k] = two[..., names[swapped]] * (-1.0 if odd else 1.0)
    assert close_but_for_ties(one, back)


def close_but_for_ties(one: FloatArray, two: FloatArray) -> bool:
    """Whether observations agree, except for a few entries that jump when a car enters a bin of the road."""
    return bool((np.abs(one - two) > 1e-3).mean() <= 0.02)


# --- only what a driver can see --------------------------------------------------------------------------------------


def test_observation__does_not_show_controls_or_lapses_of_others(moment: Moment, world: World) -> None:
    plain = moment(world, [car(50.0), car(56.0, -4.8)])
    busy = moment(world, [car(50.0), car(56.0, -4.8, steering_rad=0.3, acceleration_mps2=2.0, lapsed=True)])
    assert (observe(plain)[0, 0] == observe(busy)[0, 0]).all()


@pytest.mark.parametrize(
    ("ahead_m", "right_m", "is_seen"),
    [
        (0.5, 3.2, True),  # ahead of the eyes
        (-0.5, 3.2, False),  # beside: 2.3 m from the flank, which is 0.9 m from the centre
        (-5.2, 3.2, False),  # 2.9 m behind the rear, which is 2.3 m behind the centre
        (-5.4, 3.2, True),  # 3.1 m behind it: in the mirrors
        (-1.0, 4.0, True),  # 3.1 m from the flank: in the mirrors, two lanes away
        (-4.0, 0.5, True),  # behind: in the inside mirror
    ],
)
def test_observation__without_a_shoulder_glance_vehicles_in_the_blind_spot_are_missing(
    moment: Moment, world: World, ahead_m: float, right_m: float, is_seen: bool
) -> None:
    other = car(50.0 + ahead_m, -1.6 - right_m)
    unchecked = moment(world, [car(50.0, sight_cosine=0.0, shoulder_glance=False), other])
    checked = moment(world, [car(50.0, sight_cosine=0.0), other])
    assert seen(unchecked)["other0_seen"] == is_seen
    assert seen(checked)["other0_seen"] == 1.0
    assert unchecked.vehicle_clearance_m[0, 0] == checked.vehicle_clearance_m[0, 0]  # contact does not depend on sight
