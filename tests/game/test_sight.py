"""Sight: which bodies are hidden behind others, and that an unseen body changes nothing that a player observes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from harness.game.geometry import Box
from harness.game.observation import observe
from harness.game.observation_layout import LAYOUT
from harness.game.sight import NOTHING_HIDES, Hiding, box_cuts
from harness.game.world import World
from harness.road.scene.open_scene import open_scene
from tests.support.moments import Moment, car

VAN = {"length_m": 6.5, "width_m": 2.16, "speed_mps": 0.0}
WALKER = {"length_m": 0.5, "width_m": 0.5, "speed_mps": 1.5, "heading_rad": np.pi / 2}
AN_OBSTACLE = Hiding(obstacles=np.array([True]))
A_LOW_OBSTACLE = Hiding(obstacles=np.array([False]))
TALL_VEHICLES = Hiding(vehicles=True)
EGO = {"x_m": 60.0, "y_m": -1.6, "speed_mps": 10.0}
AWAY = {"x_m": 10.0, "y_m": 1.6, "speed_mps": 0.0}


@pytest.fixture(scope="module")
def crossing(repository: Any) -> World:
    return open_scene(repository / "networks/priority_crossing").world


@pytest.mark.parametrize(
    ("line", "cut"),
    [
        ((0.0, 0.0, 10.0, 0.0), True),
        ((0.0, 0.0, 3.9, 0.0), False),  # it ends before the box
        ((0.0, 0.0, 4.1, 0.0), True),
        ((0.0, 1.0, 10.0, 1.0), False),  # along its edge
        ((0.0, 0.99, 10.0, 0.99), True),
        ((6.1, 0.0, 10.0, 0.0), False),  # it begins behind the box
        ((5.0, -5.0, 5.0, 5.0), True),
        ((4.0, -5.0, 4.0, 5.0), False),  # along its end
        ((0.0, 0.0, 10.0, 2.6), False),  # above the corner at 4, 1: 1.04
        ((0.0, 0.0, 10.0, 2.4), True),  # below it: 0.96
    ],
)
def test_line__is_cut_by_the_inside_of_a_box(line: tuple[float, float, float, float], cut: bool) -> None:
    assert box_cuts(Box(5.0, 0.0, 0.0, 2.0, 2.0), line[:2], line[2:]) == cut


def test_line__is_cut_by_a_turned_box() -> None:
    """A square of 2 m on its corner reaches 1.414 m from its centre."""
    box = Box(5.0, 0.0, np.pi / 4, 2.0, 2.0)
    assert box_cuts(box, (0.0, 1.40), (10.0, 1.40))
    assert not box_cuts(box, (0.0, 1.42), (10.0, 1.42))


@pytest.mark.parametrize(
    ("left_m", "hidden"), [(0.0, True), (1.34, True), (1.37, False), (-1.34, True), (-1.37, False)]
)
def test_shadow__of_a_van_widens_with_the_distance(moment: Moment, world: World, left_m: float, hidden: bool) -> None:
    """The van's near corners are 20 m ahead and 1.08 m beside: its shadow is 1.6065 m wide where the walker's nearer
    corner, 0.25 m beside its centre, is 29.75 m ahead."""
    walker = car(90.0, -1.6 + left_m, **{**WALKER, "heading_rad": 0.0})
    others = [walker, car(83.25, -1.6, **VAN)]
    q = moment(replace(world, hiding=AN_OBSTACLE), [EGO, AWAY], others)
    assert q.hidden[0, 0].tolist() == [False, False, hidden, False]


@pytest.mark.parametrize(
    ("hiding", "van", "hidden"),
    [
        (AN_OBSTACLE, {}, True),
        (A_LOW_OBSTACLE, {}, False),
        (NOTHING_HIDES, {}, False),
        (TALL_VEHICLES, {}, True),
        (TALL_VEHICLES, {"width_m": 2.0}, False),  # as wide as a car
        (AN_OBSTACLE, {"present": False}, False),
        (AN_OBSTACLE, {"x_m": 95.0}, False),  # behind the walker
        (AN_OBSTACLE, {"y_m": 1.6}, False),  # in the other lane
    ],
)
def test_body__is_hidden_by_what_is_higher_than_eyes(
    moment: Moment, world: World, hiding: Hiding, van: dict[str, Any], hidden: bool
) -> None:
    q = moment(
        replace(world, hiding=hiding), [EGO, AWAY], [car(90.0, -1.6, **WALKER), {**car(83.25, -1.6, **VAN), **van}]
    )
    assert q.hidden[0, 0, 2] == hidden


def test_body__is_seen_if_one_of_its_corners_is(moment: Moment, world: World) -> None:
    """A car of 4.6 m across the road reaches 2.3 m to each side: its ends stand out of the shadow, 1.6 m wide."""
    across = car(90.0, -1.6, heading_rad=np.pi / 2)
    assert not moment(replace(world, hiding=AN_OBSTACLE), [EGO, AWAY], [across, car(83.25, -1.6, **VAN)]).hidden.any()


def test_wall__hides(moment: Moment, world: World) -> None:
    walls = np.array([[[75.0, -8.0], [75.0, 8.0]]])
    q = moment(replace(world, hiding=Hiding(walls=walls)), [EGO, AWAY], [car(90.0, -1.6), car(70.0, -1.6)])
    assert q.hidden[0].tolist() == [[False, False, True, False], [False, False, True, False]]


def test_sight__is_mutual_between_players(moment: Moment, world: World) -> None:
    q = moment(replace(world, hiding=AN_OBSTACLE), [EGO, car(90.0, -1.6)], [car(75.0, -1.6, **VAN)])
    assert q.hidden[0].tolist() == [[False, True, False], [True, False, False]]


@settings(max_examples=200, deadline=None)
@given(
    x_m=st.floats(70.0, 140.0),
    y_m=st.floats(-9.0, 9.0),
    heading_rad=st.floats(-np.pi, np.pi),
    speed_mps=st.floats(0.0, 20.0),
    length_m=st.floats(0.3, 5.0),
    width_m=st.floats(0.3, 2.0),
)
def test_unseen_body__changes_no_bit_of_the_observation(moment: Moment, world: World, **body: float) -> None:
    hiding = replace(world, hiding=AN_OBSTACLE)
    van = car(68.0, -1.6, **VAN)
    q = moment(hiding, [EGO, AWAY], [body, van])
    assume(q.hidden[0, 0, 2])
    without = moment(hiding, [EGO, AWAY], [{**body, "present": False}, van])
    assert observe(q)[0, 0].tobytes() == observe(without)[0, 0].tobytes()


@settings(max_examples=100, deadline=None)
@given(back_m=st.floats(5.0, 40.0), speed_mps=st.floats(0.0, 20.0))
def test_unseen_body__leaks_no_conflict_at_a_junction(
    moment: Moment, crossing: World, back_m: float, speed_mps: float
) -> None:
    """A car on the person's route, before the zone where its way crosses the ego's, behind a wall beside the ego."""
    routes = crossing.road.routes
    ego, person = (_on_route(crossing, player, back) for player, back in ((0, 30.0), (1, back_m)))
    hidden_car = {**person, "speed_mps": speed_mps}
    x, y = 0.5 * (ego["x_m"] + person["x_m"]), 0.5 * (ego["y_m"] + person["y_m"])
    across = np.array([-(person["y_m"] - ego["y_m"]), person["x_m"] - ego["x_m"]])
    across *= 40.0 / np.hypot(*across)
    walls = np.array([[[x - across[0], y - across[1]], [x + across[0], y + across[1]]]])
    open_sight, behind_wall = crossing, replace(crossing, hiding=Hiding(walls=walls))
    assert len(routes.goal_m) == 2
    conflicts = [LAYOUT.index(f"other0_{name}") for name in ("seen", "own_to_conflict_m", "has_priority")]
    q = moment(behind_wall, [ego, hidden_car])
    assert q.hidden[0, 0, 1]
    assert (observe(moment(open_sight, [ego, hidden_car]))[0, 0, conflicts] != 0.0).all()
    alone = moment(behind_wall, [ego, {**hidden_car, "present": False}])
    assert observe(q)[0, 0].tobytes() == observe(alone)[0, 0].tobytes()


def _on_route(world: World, player: int, before_m: float) -> dict[str, float]:
    """A car this far before the middle of the player's first zone of conflict, on its route."""
    routes, conflicts = world.road.routes, world.right_of_way.conflicts
    begin_m = min(
        float(begin) for owner, begin in zip(conflicts.player, conflicts.begin_m, strict=True) if owner == player
    )
    row = int(routes.rows(np.full((1, 2), begin_m - before_m))[0, player])
    return {"x_m": routes.x_m[row], "y_m": routes.y_m[row], "heading_rad": routes.heading_rad[row], "speed_mps": 10.0}


@pytest.mark.parametrize(("x_m", "is_seen"), [(89.0, True), (91.0, False)])
def test_visibility__is_how_far_road_users_and_obstacles_are_seen(
    merge: Any, moment: Moment, x_m: float, is_seen: bool
) -> None:
    """30 m from the ego at 60 m; the obstacle, the last body, as the car."""
    for world in (merge.world, replace(merge.world, hiding=A_LOW_OBSTACLE)):
        q = moment(world, [EGO, AWAY], [car(x_m)])
        q.state.visibility_m[:] = 30.0
        others = [observe(q)[0, 0, LAYOUT.index(f"other{k}_ahead_m")] > 0.5 for k in range(2)]
        assert any(others) is is_seen
