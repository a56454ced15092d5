"""Signals, signs and sides of the road by hand, on the merge road with a stop line at 90 m.
The players drive east on the line y = -1.6, so their stations are their x. Cars are 4.6 m long: the front bumper is
2.3 m ahead. The limit is 13.89 m/s. Comfortable braking is 2 m/s2.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from harness.game.junctions import NO_JUNCTIONS, Control, Signal, StopLines
from harness.game.quantities import Quantities
from harness.game.world import World
from harness.road.scene.open_scene import OpenScene
from tests.support.conflicts import CROSSING, with_conflicts
from tests.support.moments import FAR, Moment, seen, value_of

LINE_M, LIMIT_MPS, HALF_M = 90.0, 13.89, 2.3
SIGNS = ("signal_green", "signal_yellow", "signal_red", "give_way", "stop_sign")


def world_of(merge: OpenScene, control: Control, link: int = -1) -> World:
    """The merge road with a stop line of the ego."""
    links = (("light", 0), ("light", 1)) if link >= 0 else ()
    lines = StopLines.of([(0, LINE_M, control, link)])
    return replace(merge.world, right_of_way=NO_JUNCTIONS._replace(stop_lines=lines, signal_links=links))


def at(
    moment: Moment,
    world: World,
    front_m: float,
    speed_mps: float = 10.0,
    signal: tuple[int, float] = (0, 0.0),
    advanced_m: float = 1.0,
    others: Any = (),
) -> Quantities:
    """The ego with its front bumper at a station, after a step in which it advanced; the signal of link 1 and the
    seconds since it changed."""
    ego = {"x_m": front_m - HALF_M, "y_m": -1.6, "speed_mps": speed_mps}
    q = moment(world, [ego, FAR], others)
    q.state.signals = np.array([[Signal.OFF, signal[0]]], dtype=np.int8)
    q.state.signal_s = np.array([[0.0, signal[1]]])
    q.advanced_m = np.array([[advanced_m, 1.0]])
    return q


@pytest.fixture(scope="module")
def light(merge: OpenScene) -> World:
    return world_of(merge, Control.SIGNAL, link=1)


# --- stop lines ------------------------------------------------------------------------------------------------------


def test_next_stop_line__is_the_first_that_the_front_has_not_passed(moment: Moment, merge: OpenScene) -> None:
    lines = [(0, 40.0, Control.NONE, -1), (0, LINE_M, Control.STOP, -1), (1, 60.0, Control.STOP, -1)]
    world = replace(merge.world, right_of_way=NO_JUNCTIONS._replace(stop_lines=StopLines.of(lines)))
    expected = [(39.9, 0), (40.0, 0), (40.1, 1), (90.0, 1), (90.1, -1)]
    found = [int(at(moment, world, front_m).rules.next_line[0, 0]) for front_m, _ in expected]
    assert found == [line for _, line in expected]
    assert at(moment, world, 39.9).rules.next_line[0, 1] == -1, "the other player is past its only line"


@pytest.mark.parametrize(
    ("front_m", "signal", "passed_s"),
    [
        (90.4, Signal.RED, 3.0),  # from 89.4 m to 90.4 m in this step
        (90.4, Signal.GREEN, -1.0),
        (90.4, Signal.GREEN_YIELDING, -1.0),
        (90.4, Signal.YELLOW, -1.0),
        (90.4, Signal.OFF, -1.0),
        (89.9, Signal.RED, -1.0),  # not yet
        (90.0, Signal.RED, -1.0),  # on the line
        (91.0, Signal.RED, 3.0),  # from the line on
        (91.1, Signal.RED, -1.0),  # in the step before
    ],
)
def test_passed_red__in_the_step_in_which_the_front_passes(
    moment: Moment, light: World, front_m: float, signal: Signal, passed_s: float
) -> None:
    assert at(moment, light, front_m, signal=(signal, 3.0)).passed_red_s[0].tolist() == [passed_s, -1.0]


def test_passed_stop_sign__at_the_speed_of_that_step(moment: Moment, merge: OpenScene) -> None:
    for control in Control:
        world, stops = world_of(merge, control), control in (Control.STOP, Control.ALL_WAY_STOP)
        for front_m, passed in ((89.9, -1.0), (90.4, 4.0 if stops else -1.0), (91.1, -1.0)):
            assert at(moment, world, front_m, speed_mps=4.0).rules.passed_stop_sign_mps[0].tolist() == [passed, -1.0]


# --- permitted speed -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("front_m", "signal", "permitted_mps"),
    [
        (74.0, Signal.RED, 8.0),  # sqrt(2 * 2 * 16)
        (89.0, Signal.RED, 2.0),
        (90.0, Signal.RED, 0.0),
        (90.1, Signal.RED, LIMIT_MPS),  # past the line
        (40.0, Signal.RED, LIMIT_MPS),  # sqrt(2 * 2 * 50) = 14.1
        (74.0, Signal.GREEN, LIMIT_MPS),
        (74.0, Signal.GREEN_YIELDING, LIMIT_MPS),
        (74.0, Signal.OFF, LIMIT_MPS),
    ],
)
def test_permitted__before_a_red_light(
    moment: Moment, light: World, front_m: float, signal: Signal, permitted_mps: float
) -> None:
    q = at(moment, light, front_m, signal=(signal, 1.0))
    assert q.rules.permitted_mps[0, 0] == pytest.approx(permitted_mps)
    assert q.rules.permitted_mps[0, 1] == pytest.approx(LIMIT_MPS)


@pytest.mark.parametrize(
    ("speed_mps", "room_m", "stops"),
    [
        (10.0, 17.0, True),  # 100 / (2 * 17) = 2.9 m/s2
        (10.0, 16.0, False),  # 3.1 m/s2: more than 3 m/s2
        (12.0, 25.0, True),  # 2.88
        (12.0, 23.0, False),  # 3.13
        (0.0, 1.0, True),
    ],
)
def test_permitted__yellow_means_stop_if_moderate_braking_is_enough(
    moment: Moment, light: World, speed_mps: float, room_m: float, stops: bool
) -> None:
    q = at(moment, light, LINE_M - room_m, speed_mps=speed_mps, signal=(Signal.YELLOW, 0.5))
    assert q.rules.permitted_mps[0, 0] == pytest.approx(min(np.sqrt(4.0 * room_m), LIMIT_MPS) if stops else LIMIT_MPS)


def test_permitted__before_a_stop_sign_ends_at_a_rolling_half_metre_per_second(
    moment: Moment, merge: OpenScene
) -> None:
    for control in (Control.STOP, Control.ALL_WAY_STOP):
        # sqrt(2 * 2 * 16 + 0.5^2) = sqrt(64.25)
        for front_m, permitted in ((74.0, np.sqrt(64.25)), (90.0, 0.5), (90.1, LIMIT_MPS)):
            found = at(moment, world_of(merge, control), front_m).rules.permitted_mps[0, 0]
            assert found == pytest.approx(permitted)


def crossed(merge: OpenScene, yields: bool = True, wait_m: float = LINE_M) -> World:
    """The merge road, crossed at 100 m by a stream from the south with its stop line at y = -10."""
    row = {**CROSSING, "yields": yields, "wait_m": wait_m, "own_link": -1, "other_link": -1}
    return with_conflicts(merge.world, row, stop_lines=[(0, LINE_M, Control.GIVE_WAY, -1)])


def from_the_south(arrives_s: float, speed_mps: float = 10.0) -> dict[str, float]:
    """A car that reaches the zone after this time: its front is at y = -3 then."""
    y_m = -3.0 - HALF_M - arrives_s * speed_mps
    return {"x_m": 100.0, "y_m": y_m, "heading_rad": np.pi / 2.0, "speed_mps": speed_mps}


@pytest.mark.parametrize(
    ("front_m", "arrives_s", "permitted_mps"),
    [
        (74.0, 3.9, 8.0),  # stop at the line: sqrt(2 * 2 * 16)
        (74.0, 4.1, LIMIT_MPS),  # it arrives late enough
        (90.0, 1.0, 0.0),
        (92.25, 1.0, 5.0),  # past the line: stop before the zone, sqrt(2 * 2 * 6.25)
        (99.0, 1.0, LIMIT_MPS),  # in the zone: clear it
    ],
)
def test_permitted__waits_for_a_car_with_priority(
    moment: Moment, merge: OpenScene, front_m: float, arrives_s: float, permitted_mps: float
) -> None:
    q = at(moment, crossed(merge), front_m, others=[from_the_south(arrives_s)])
    assert q.meetings.other_s[0, 0, 2] == pytest.approx(arrives_s)
    assert q.rules.permitted_mps[0, 0] == pytest.approx(permitted_mps)
    with_priority = at(moment, crossed(merge, yields=False), front_m, others=[from_the_south(arrives_s)])
    assert with_priority.rules.permitted_mps[0, 0] == pytest.approx(LIMIT_MPS)


@pytest.mark.parametrize(
    ("front_m", "permitted_mps", "due_mps"),
    [
        (85.0, 6.0, 6.0),  # sqrt(2 * 2 * 9): drive on past the line, and be late standing here
        (91.2, np.sqrt(11.2), 0.0),  # within 3 m of the place it waits
        (94.0, 0.0, 0.0),
        (96.25, 3.0, 0.0),  # past the place: stop before the zone, sqrt(2 * 2 * 2.25)
    ],
)
def test_permitted__a_car_that_turns_waits_inside_the_junction(
    moment: Moment, merge: OpenScene, front_m: float, permitted_mps: float, due_mps: float
) -> None:
    q = at(moment, crossed(merge, wait_m=94.0), front_m, others=[from_the_south(1.0)])
    assert q.rules.permitted_mps[0, 0] == pytest.approx(permitted_mps)
    assert q.rules.due_mps[0, 0] == pytest.approx(due_mps)


def test_posted__knows_signals_and_signs_and_no_other_cars(moment: Moment, merge: OpenScene, light: World) -> None:
    q = at(moment, crossed(merge), 74.0, others=[from_the_south(3.9)])
    assert (q.rules.permitted_mps[0, 0], q.rules.posted_mps[0, 0]) == (pytest.approx(8.0), pytest.approx(LIMIT_MPS))
    q = at(moment, light, 74.0, speed_mps=11.0, signal=(Signal.RED, 1.0))
    assert seen(q)["over_posted_mps"] == pytest.approx(3.0, abs=1e-5)  # 11 m/s; 8 m/s are permitted


@pytest.mark.parametrize(
    ("front_m", "speed_mps", "over_mps"),
    [
        (74.0, 0.0, -8.0),  # 16 m before the line: late
        (80.1, 0.0, 0.0),  # within 10 m: it waits
        (80.1, 6.0, 0.0),  # or moves up: sqrt(2 * 2 * 9.9) = 6.3
        (89.0, 2.5, 0.5),
        (74.0, 10.0, 2.0),
        (74.0, 6.0, -2.0),
    ],
)
def test_speed_over_permitted__is_a_share_of_the_limit_and_a_car_that_waits_is_not_late(
    moment: Moment, light: World, front_m: float, speed_mps: float, over_mps: float
) -> None:
    q = at(moment, light, front_m, speed_mps=speed_mps, signal=(Signal.RED, 1.0))
    assert q.speed_over_permitted[0, 0] == pytest.approx(over_mps / LIMIT_MPS)
    assert value_of(q, "speed_over_limit", None) == pytest.approx(-0.1 * max(over_mps, 0.0) / LIMIT_MPS)
    assert value_of(q, "speed_under_limit", None) == pytest.approx(0.1 * min(over_mps, 0.0) / LIMIT_MPS)
    assert q.speed_over_limit[0, 0] == pytest.approx(speed_mps / LIMIT_MPS - 1.0), "the limit itself is the same"


# --- what is observed of them ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("signal", "name"),
    [
        (Signal.GREEN, "signal_green"),
        (Signal.GREEN_YIELDING, "signal_green"),
        (Signal.YELLOW, "signal_yellow"),
        (Signal.RED, "signal_red"),
        (Signal.OFF, ""),
    ],
)
def test_observation__of_a_signal(moment: Moment, light: World, signal: Signal, name: str) -> None:
    entries = seen(at(moment, light, 74.0, signal=(signal, 4.5)))
    assert entries["stop_line_m"] == pytest.approx(16.0, rel=1e-5)
    assert entries["signal_s"] == pytest.approx(4.5, rel=1e-5)
    for each in SIGNS:
        assert entries[each] == (1.0 if each == name else 0.0)


def test_observation__of_a_sign(moment: Moment, merge: OpenScene) -> None:
    signs = {Control.STOP: "stop_sign", Control.ALL_WAY_STOP: "stop_sign", Control.GIVE_WAY: "give_way"}
    for control in (*signs, Control.NONE):
        name = signs.get(control)
        world = world_of(merge, control)
        entries, beyond = seen(at(moment, world, 74.0)), seen(at(moment, world, 91.0))
        for each in SIGNS:
            assert entries[each] == (1.0 if each == name else 0.0)
        assert beyond["stop_line_m"] > 1e6, "no line ahead"
        assert beyond["stop_sign"] == beyond["give_way"] == 0.0


@pytest.mark.parametrize(("yields", "priority"), [(True, 1.0), (False, -1.0)])
def test_observation__of_a_crossing_car(moment: Moment, merge: OpenScene, yields: bool, priority: float) -> None:
    # the ego's front is 24.5 m before the zone at 10 m/s: 2.45 s; the other arrives after 3 s at 8 m/s
    q = at(moment, crossed(merge, yields=yields), 74.0, others=[from_the_south(3.0, 8.0)])
    entries = seen(q)
    expected = {
        "own_to_conflict_m": 24.5,
        "other_to_conflict_m": 24.0,
        "arrives_later_s": 0.55,
        "has_priority": priority,
        "left_mps": 8.0,
        "ahead_mps": -10.0,
    }
    for name, value in expected.items():
        assert entries[f"other0_{name}"] == pytest.approx(value, rel=1e-4), name


def test_observation__a_car_in_conflict_is_more_urgent_than_nearer_ones(moment: Moment, merge: OpenScene) -> None:
    # by distance over 10 m/s: 2.4, 2.7, 3.0 and 3.4 s; the crossing car is 54 m away, in conflict within 2.5 s
    queue = [{"x_m": 71.7 - back, "y_m": -4.8, "speed_mps": 0.0} for back in (24.0, 27.0, 30.0, 34.0)]
    others = [*queue, from_the_south(2.4, 18.0)]
    crossing = seen(at(moment, crossed(merge), 74.0, others=others))
    assert [crossing[f"other{k}_has_priority"] for k in range(4)] == [0.0, 1.0, 0.0, 0.0]
    assert crossing["other1_left_mps"] == pytest.approx(18.0, rel=1e-4)


# --- the side of the road --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("marks_m", "offset_m", "wrong"),
    [
        ((1.6, -np.inf), 1.5, 0.0),  # traffic keeps to the right: oncoming lanes are on the left
        ((1.6, -np.inf), 1.7, 1.0),
        ((1.6, -np.inf), -30.0, 0.0),
        ((np.inf, -1.6), -1.5, 0.0),  # traffic keeps to the left
        ((np.inf, -1.6), -1.7, 1.0),
        ((np.inf, -1.6), 30.0, 0.0),
        ((np.inf, -np.inf), 30.0, 0.0),  # a one-way road
    ],
)
def test_wrong_way__is_beyond_the_mark_to_the_oncoming_lanes(
    moment: Moment, merge: OpenScene, marks_m: tuple[float, float], offset_m: float, wrong: float
) -> None:
    road = merge.world.road
    left, right = (np.full(len(road.routes.x_m), mark) for mark in marks_m)
    world = replace(merge.world, road=replace(road, routes=road.routes._replace(own_left_m=left, own_right_m=right)))
    q = moment(world, [{"x_m": 60.0, "y_m": -1.6 + offset_m}, FAR])
    assert q.wrong_way[0].tolist() == [wrong, 0.0]
    assert value_of(q, "wrong_way", None) == pytest.approx(-0.1 * wrong)
