"""Encounters at a conflict made by hand (`tests.support.conflicts`): who is in the zone when, and what is named.

Steps of 0.1 s, cars of 4.6 m by 1.8 m. The ego drives east at 10 m/s and is in the zone (98.5 to 101.5 m) from 2.85 s
after its centre is at 67.7 m until its rear leaves it, 0.76 s later. The other drives north at 10 m/s and is in the
zone (y = -3 to 0) for 0.76 s as well.
"""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from harness.evaluation.encounters import Encounter
from harness.evaluation.metrics import accepted_gap_s
from harness.evaluation.recorded_game import BodyKind
from harness.evaluation.rule_book.course import Course
from harness.evaluation.rule_book.named_manoeuvres import find_manoeuvres
from harness.game.arrays import FloatArray
from harness.game.junctions import Control
from harness.game.world import World
from harness.road.scene.open_scene import OpenScene
from tests.support.conflicts import CROSSING, with_conflicts
from tests.support.traces import game, rows

STEPS = 60
KINDS = {"car": BodyKind(length_m=4.6)}
EAST, NORTH = 0.0, np.pi / 2.0


def driving(
    name: str, x_m: float, y_m: float, heading_rad: float, speed_mps: float | FloatArray = 10.0, signals: str = ""
) -> pd.DataFrame:
    """A car's rows: straight on from a place, at a speed or the speeds of every step."""
    speeds = np.broadcast_to(np.asarray(speed_mps, dtype=float), STEPS)
    way_m = np.concatenate(([0.0], np.cumsum(speeds[1:]) * 0.1))
    poses = [
        (x_m + way * np.cos(heading_rad), y_m + way * np.sin(heading_rad), heading_rad, speed)
        for way, speed in zip(way_m, speeds, strict=True)
    ]
    return pd.DataFrame(rows(name, poses)).assign(signals=signals)


def ego(x_m: float = 67.7, **more: Any) -> pd.DataFrame:
    return driving("ego", x_m, -1.6, EAST, **more)


def northbound(y_m: float, name: str = "non_ego", **more: Any) -> pd.DataFrame:
    return driving(name, 100.0, y_m, NORTH, **more)


def trace_of(*cars: pd.DataFrame) -> pd.DataFrame:
    return pd.concat(cars).sort_values(["step", "player"], ignore_index=True)


def met(world: World, *cars: pd.DataFrame) -> list[Encounter]:
    return list(game(world, trace_of(*cars), KINDS).encounters[0])


def named(world: World, *cars: pd.DataFrame) -> list[dict[str, Any]]:
    new = ("fails_to_yield", "turns_across", "runs_red", "rolls_through", "wrong_way")
    return [
        each for each in find_manoeuvres(Course(game=game(world, trace_of(*cars), KINDS))) if each["manoeuvre"] in new
    ]


@pytest.fixture(scope="module")
def world(merge: OpenScene) -> World:
    return with_conflicts(merge.world, CROSSING)


def series(encounters: list[Encounter]) -> Any:
    """A drive with these encounters."""
    return SimpleNamespace(encounters=tuple(encounters))


# --- passages --------------------------------------------------------------------------------------------------------


def test_encounter__passages_of_both_sides(world: World) -> None:
    (found,) = met(world, ego(), northbound(-44.3))
    assert found.own == pytest.approx(((98.5 - 70.0) / 10.0, (101.5 + 2.3 - 67.7) / 10.0))
    assert found.other == pytest.approx(((-3.0 - (-42.0)) / 10.0, (44.3 + 2.3) / 10.0))


@pytest.mark.parametrize(
    ("cars", "times_s"),
    [
        ([ego(60.0), northbound(-10.0)], [(98.5 - 62.3) / 10.0 - 1.23]),  # the other is first
        ([ego(), northbound(-34.0)], [0.0]),  # both are inside at once
        ([ego(), driving("non_ego", 130.0, -44.0, NORTH)], []),  # the other crosses elsewhere
        ([ego(20.0, speed_mps=5.0), northbound(-44.3)], []),  # the ego does not get there
    ],
)
def test_encounter__time_between_the_passages(cars: list[pd.DataFrame], times_s: list[float], world: World) -> None:
    found = [sorted((each.own, each.other)) for each in met(world, *cars)]
    assert [max(second.enters_s - first.leaves_s, 0.0) for first, second in found] == pytest.approx(times_s)


def test_encounter__a_body_that_stops_before_the_zone_is_not_passed(world: World) -> None:
    speeds = np.where(np.arange(STEPS) < 20, 10.0, 0.0)
    (found,) = met(world, ego(), northbound(-34.0, speed_mps=np.maximum(speeds, 0.5)))
    assert found.other is None


def test_encounter__none_with_a_body_that_leaves_the_stream_before_the_zone(world: World) -> None:
    turning = northbound(-44.3)
    away = turning["step"] >= 36  # its front is 3 m before the zone
    turning.loc[away, "x_m"] += 3.0
    assert met(world, ego(), turning) == []


def test_encounter__with_background_traffic(world: World) -> None:
    (found,) = met(world, ego(), driving("non_ego", 20.0, -1.6, EAST), northbound(-44.3, name="car"))
    assert found.body == 2


# --- priority and the accepted gap -----------------------------------------------------------------------------------


def test_metrics__priority_and_accepted_gap(world: World, merge: OpenScene) -> None:
    drive = series(met(world, ego(), northbound(-44.3)))
    assert [each.must_yield for each in drive.encounters] == [True]
    # the ego enters in 2.85 s; in the first step after that, 2.9 s, the other's front is 10 m before the zone
    assert accepted_gap_s(drive) == pytest.approx(1.0)
    major = with_conflicts(merge.world, {**CROSSING, "yields": False})
    drive = series(met(major, ego(), northbound(-44.3)))
    assert [each.must_yield for each in drive.encounters] == [False]
    assert accepted_gap_s(drive) is None


@pytest.mark.parametrize(
    ("lights", "must_yield"),
    # the ego's link is the first of the light, the other's the second
    [("light=Gr", False), ("light=rG", True), ("light=gG", True), ("light=yr", False), ("light=OO", True), ("", True)],
)
def test_priority__by_the_signals_of_the_trace(world: World, lights: str, must_yield: bool) -> None:
    (found,) = met(world, ego(signals=lights), northbound(-44.3, signals=lights))
    assert found.must_yield == must_yield


# --- manoeuvres ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("conflict", "y_m", "names"),
    [
        ({}, -64.3, ["fails_to_yield"]),  # 3.0 s away
        ({}, -65.3, []),
        ({"yields": False}, -44.3, []),
        ({"across": True}, -75.3, ["turns_across"]),  # 4.1 s away
        ({"across": True}, -76.3, []),
    ],
)
def test_gap__that_is_too_short_is_named(
    conflict: dict[str, Any], y_m: float, names: list[str], merge: OpenScene
) -> None:
    world = with_conflicts(merge.world, {**CROSSING, **conflict})
    assert [each["manoeuvre"] for each in named(world, ego(), northbound(y_m))] == names


def test_fails_to_yield__has_its_gap_begin_and_end(world: World) -> None:
    (found,) = named(world, ego(), northbound(-44.3))
    assert found["text"] == "does not yield to traffic, 1.0 s away"
    assert (found["time_s"], found["until_s"]) == (pytest.approx(2.9), pytest.approx(3.6))


def lines(merge: OpenScene, control: Control) -> World:
    return with_conflicts(merge.world, CROSSING, stop_lines=[(0, 90.0, control, 0)])


@pytest.mark.parametrize(("letters", "count"), [("rG", 1), ("uG", 1), ("yG", 0), ("Gr", 0), ("gG", 0), ("OO", 0)])
def test_runs_red__passes_the_line_on_red(merge: OpenScene, letters: str, count: int) -> None:
    found = named(lines(merge, Control.SIGNAL), ego(signals=f"light={letters}"))
    assert [each["manoeuvre"] for each in found] == ["runs_red"] * count


def test_runs_red__states_the_time_since_the_onset(merge: OpenScene) -> None:
    drive = ego()  # its front is at 90 m after 2 s
    drive["signals"] = np.where(drive["step"] < 12, "light=yr", "light=rG")
    (found,) = named(lines(merge, Control.SIGNAL), drive)
    assert found["text"] == "passes a red light, 1.0 s after its onset"


def slowing(to_mps: float) -> FloatArray:
    """Speeds from 10 m/s down to `to_mps` after 2 s, with 19 m driven, and up again."""
    return np.interp(np.arange(STEPS) * 0.1, [0.0, 1.8, 2.0, 2.2, 3.0], [10.0, 10.0, to_mps, to_mps, 10.0])


@pytest.mark.parametrize(
    ("control", "least_mps", "names"),
    [
        (Control.STOP, 0.4, []),
        (Control.STOP, 0.6, ["rolls_through"]),
        (Control.ALL_WAY_STOP, 0.4, []),
        (Control.ALL_WAY_STOP, 0.6, ["rolls_through"]),
        (Control.GIVE_WAY, 10.0, []),
    ],
)
def test_rolls_through__a_stop_sign(control: Control, least_mps: float, names: list[str], merge: OpenScene) -> None:
    found = named(lines(merge, control), ego(speed_mps=slowing(least_mps)))
    assert [each["manoeuvre"] for each in found] == names


@pytest.mark.parametrize(("speed_mps", "seconds"), [(10.0, 2.0), (25.0, 0.8)])
def test_wrong_way__among_oncoming_lanes_for_a_second(merge: OpenScene, speed_mps: float, seconds: float) -> None:
    road, routes = merge.world.road, merge.world.road.routes
    there = (routes.x_m > 80.0) & (routes.x_m < 100.0)  # the ego's line is beyond its own lanes
    oncoming = replace(road, routes=routes._replace(own_left_m=np.where(there, -0.1, routes.own_left_m)))
    found = named(replace(merge.world, road=oncoming), ego(speed_mps=speed_mps))
    assert [each["manoeuvre"] for each in found] == (["wrong_way"] if seconds >= 1.0 else [])
