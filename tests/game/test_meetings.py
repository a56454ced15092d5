"""Conflicts of players with bodies by hand: a stream from the south crosses the merge road at x = 100 m.

The players drive east on the line y = -1.6, so their stations are their x. The stream is 3.2 m wide and has its stop
line at y = -10: the place of a body along it is y + 10. The zone is 98.5 to 101.5 m on the route and 7 to 10 m along
the stream. Cars are 4.6 m long.
"""

from __future__ import annotations

import numpy as np
import pytest

from harness.game.junctions import Signal
from harness.game.meetings import Meetings
from harness.game.quantities import Quantities
from harness.game.world import World
from harness.road.scene.open_scene import OpenScene
from tests.support.conflicts import CROSSING, with_conflicts
from tests.support.moments import Moment

NORTH = np.pi / 2.0


@pytest.fixture(scope="module")
def world(merge: OpenScene) -> World:
    return with_conflicts(merge.world, CROSSING)


def ego(x_m: float, speed_mps: float = 10.0, y_m: float = -1.6) -> dict[str, float]:
    return {"x_m": x_m, "y_m": y_m, "speed_mps": speed_mps}


def northbound(y_m: float, speed_mps: float = 10.0, x_m: float = 100.0, **more: float) -> dict[str, float]:
    return {"x_m": x_m, "y_m": y_m, "heading_rad": NORTH, "speed_mps": speed_mps, **more}


FAR = ego(20.0, y_m=-4.8)


def meeting(q: Quantities, body: int = 2, player: int = 0) -> Meetings:
    return Meetings(*(column[0, player, body] for column in q.meetings))


@pytest.mark.parametrize(
    ("own", "other", "expected"),
    [
        # fronts at 72.3 m and y = -37.7; the player's rear leaves the zone after (101.5 - 67.7) / 20 s
        (ego(70.0, 20.0), northbound(-40.0, 5.0), (26.2, 34.7, 1.31, 6.94, 6.94 - 33.8 / 20.0)),
        # behind the body, whose rear leaves the zone after (10 + 2.3) / 10 s
        (ego(50.0), northbound(-10.0), (46.2, 4.7, 4.62, 0.47, 4.62 - 1.23)),
        (ego(70.0), northbound(-30.0), (26.2, 24.7, 2.62, 2.47, 0.0)),  # both in the zone at once
        (ego(70.0), northbound(-20.0, 0.0), (26.2, 14.7, 2.62, np.inf, np.inf)),  # stands before it: does not arrive
        (ego(70.0), northbound(-1.6, 0.0), (26.2, -3.7, 2.62, 0.0, 0.0)),  # stands in it: does not leave it
    ],
)
def test_meetings__distances_and_times_are_those_of_the_front_bumpers_to_the_zone(
    moment: Moment, world: World, own: dict[str, float], other: dict[str, float], expected: tuple[float, ...]
) -> None:
    met = meeting(moment(world, [own, FAR], [other]))
    assert met.conflict == 0
    assert (met.own_m, met.other_m, met.own_s, met.other_s, met.gap_s) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("meaning", "body"),
    [
        ("beside the stream", northbound(-40.0, x_m=101.7)),
        ("turned by more than 45 degrees", northbound(-40.0, heading_rad=0.25 * np.pi - 0.01)),
        ("in the opposite direction", northbound(-40.0, heading_rad=-NORTH)),
        ("in another stream, without a conflict", northbound(-40.0, x_m=130.0)),
        ("beyond the zone", northbound(3.0)),
        ("off the map", northbound(-4000.0)),
        ("not present", northbound(-40.0, present=False)),
    ],
)
def test_meetings__no_conflict_with_a_body(moment: Moment, world: World, meaning: str, body: dict[str, float]) -> None:
    met = meeting(moment(world, [ego(70.0), FAR], [body]))
    assert met.conflict == -1, meaning
    assert (met.own_m, met.other_m, met.own_s, met.other_s, met.gap_s) == (np.inf,) * 5
    assert not met.must_yield


@pytest.mark.parametrize(
    ("x_m", "y_m", "conflict"),
    [
        (70.0, 2.2, 0),  # the zone ends at y = 0: the body's rear leaves it when its centre is at 2.3 m
        (70.0, 2.4, -1),
        (103.7, -40.0, 0),  # and the player's at 103.8 m
        (103.9, -40.0, -1),
    ],
)
def test_meetings__last_until_one_has_left_the_zone(
    moment: Moment, world: World, x_m: float, y_m: float, conflict: int
) -> None:
    assert meeting(moment(world, [ego(x_m), FAR], [northbound(y_m)])).conflict == conflict


def test_meetings__players_meet_each_other(moment: Moment, merge: OpenScene) -> None:
    world = with_conflicts(merge.world, CROSSING)
    q = moment(world, [ego(70.0), {**northbound(-40.0)}])
    assert q.meetings.conflict[0].tolist() == [[-1, 0], [-1, -1]]


def test_meetings__the_first_conflict_on_the_way_counts(moment: Moment, merge: OpenScene) -> None:
    early = {**CROSSING, "begin_m": 95.0, "end_m": 97.0, "zone_m": 4.0}
    world = with_conflicts(merge.world, CROSSING, early)
    met = meeting(moment(world, [ego(70.0), FAR], [northbound(-40.0)]))
    assert (met.conflict, met.own_m) == (0, pytest.approx(95.0 - 72.3))
    met = meeting(moment(world, [ego(100.0), FAR], [northbound(-40.0)]))
    assert met.conflict == 1, "the first zone is passed"


def test_meetings__only_in_the_lane_that_the_stream_conflicts_with(moment: Moment, merge: OpenScene) -> None:
    world = with_conflicts(merge.world, {**CROSSING, "right_m": -np.inf, "left_m": -1.6})
    assert meeting(moment(world, [ego(70.0), FAR], [northbound(-40.0)])).conflict == -1
    assert meeting(moment(world, [ego(70.0, y_m=-4.8), FAR], [northbound(-40.0)])).conflict == 0


def test_meetings__a_body_on_the_players_own_way_is_a_leader_and_no_conflict(moment: Moment, merge: OpenScene) -> None:
    world = with_conflicts(merge.world, {**CROSSING, "from_m": -50.0, "until_m": 8.0})
    for y_m, conflict in ((-61.0, -1), (-59.0, 0), (-2.5, 0), (-1.5, -1)):
        assert meeting(moment(world, [ego(70.0), FAR], [northbound(y_m)])).conflict == conflict


# --- who must yield --------------------------------------------------------------------------------------------------


def must_yield(moment: Moment, world: World, own: int, other: int, x_m: float = 70.0, y_m: float = -40.0) -> bool:
    q = moment(world, [ego(x_m), FAR], [northbound(y_m)])
    q.state.signals = np.array([[own, other]], dtype=np.int8)
    return bool(meeting(q).must_yield)


@pytest.mark.parametrize("yields", [True, False])
def test_must_yield__by_the_signs_without_signals(moment: Moment, merge: OpenScene, yields: bool) -> None:
    unsigned = {**CROSSING, "yields": yields, "own_link": -1, "other_link": -1}
    assert must_yield(moment, with_conflicts(merge.world, unsigned), Signal.RED, Signal.RED) == yields


@pytest.mark.parametrize(
    ("own", "other", "expected"),
    [
        (Signal.OFF, Signal.OFF, True),
        (Signal.GREEN, Signal.RED, False),
        (Signal.GREEN, Signal.GREEN_YIELDING, False),
        (Signal.GREEN_YIELDING, Signal.GREEN, True),
        (Signal.GREEN_YIELDING, Signal.RED, False),
        (Signal.YELLOW, Signal.RED, False),
        (Signal.RED, Signal.GREEN, True),
        (Signal.RED, Signal.YELLOW, True),
        (Signal.RED, Signal.RED, False),
    ],
)
def test_must_yield__by_signals(moment: Moment, world: World, own: Signal, other: Signal, expected: bool) -> None:
    assert must_yield(moment, world, own, other) == expected


def test_must_yield__a_signal_does_not_count_for_a_side_that_has_passed_it(moment: Moment, merge: OpenScene) -> None:
    major = with_conflicts(merge.world, {**CROSSING, "yields": False})
    assert must_yield(moment, major, Signal.RED, Signal.YELLOW)
    assert not must_yield(moment, major, Signal.RED, Signal.YELLOW, x_m=91.0)
    minor = with_conflicts(merge.world, CROSSING)
    assert not must_yield(moment, minor, Signal.YELLOW, Signal.RED, y_m=-13.0)
    assert must_yield(moment, minor, Signal.YELLOW, Signal.RED, y_m=-12.0), "its front is at y = -9.7"


def test_must_yield__to_a_stream_with_green_after_passing_the_own_light(moment: Moment, merge: OpenScene) -> None:
    major = with_conflicts(merge.world, {**CROSSING, "yields": False})
    assert must_yield(moment, major, Signal.RED, Signal.GREEN, x_m=91.0)


def test_must_yield__to_the_first_that_comes_at_an_all_way_stop(moment: Moment, merge: OpenScene) -> None:
    world = with_conflicts(merge.world, {**CROSSING, "first_come": True})
    assert must_yield(moment, world, Signal.OFF, Signal.OFF, x_m=70.0, y_m=-20.0)
    assert not must_yield(moment, world, Signal.OFF, Signal.OFF, x_m=70.0, y_m=-40.0)


# --- for payoffs -----------------------------------------------------------------------------------------------------


def test_gap__counts_zones_that_the_player_reaches_soon(moment: Moment, world: World) -> None:
    near, far = (moment(world, [ego(x_m), FAR], [northbound(-40.0)]) for x_m in (50.0, 40.0))
    assert near.meetings.own_s[0, 0, 2] < 5.0 < far.meetings.own_s[0, 0, 2]
    assert near.gap_s[0].tolist() == [near.meetings.gap_s[0, 0, 2], np.inf]
    assert far.gap_s[0].tolist() == [np.inf, np.inf]


def test_gap__of_a_car_that_moves_up_inside_the_junction_counts_once_it_cannot_stop(
    moment: Moment, merge: OpenScene, world: World
) -> None:
    # braking from 10 m/s at 2 m/s2 takes 25 m; the zone begins at 98.5 m
    turning = with_conflicts(merge.world, {**CROSSING, "wait_m": 94.0})
    for x_m, counts in ((98.5 - 25.1 - 2.3, False), (98.5 - 24.9 - 2.3, True)):
        gap_s = moment(world, [ego(x_m), FAR], [northbound(-40.0)]).gap_s[0, 0]
        assert gap_s < np.inf
        assert moment(turning, [ego(x_m), FAR], [northbound(-40.0)]).gap_s[0, 0] == (gap_s if counts else np.inf)


@pytest.mark.parametrize(
    ("meaning", "x_m", "y_m", "expected"),
    [
        # the zone begins at 98.5 m: the front enters it between 96.1 and 97.1 m of the centre, in a step of 1 m
        ("enters, the other is 10 m from the zone", 96.5, -15.3, 1.0),
        ("enters, the other is inside", 96.5, -4.0, 0.0),
        ("has not entered yet", 96.1, -15.3, np.inf),
        ("has entered before", 97.3, -15.3, np.inf),
    ],
)
def test_entered_before__in_the_step_of_the_entry(
    moment: Moment, world: World, meaning: str, x_m: float, y_m: float, expected: float
) -> None:
    q = moment(world, [ego(x_m), FAR], [northbound(y_m)])
    q.advanced_m = np.array([[1.0, 1.0]])
    assert q.entered_before_s[0].tolist() == pytest.approx([expected, np.inf]), meaning


def test_entered_before__with_priority_it_is_no_offence(moment: Moment, merge: OpenScene) -> None:
    q = moment(with_conflicts(merge.world, {**CROSSING, "yields": False}), [ego(96.5), FAR], [northbound(-15.3)])
    q.advanced_m = np.array([[1.0, 1.0]])
    assert q.entered_before_s[0].tolist() == [np.inf, np.inf]
