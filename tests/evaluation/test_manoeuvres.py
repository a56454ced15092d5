"""Manoeuvres in made-up games: each rule just above and just below its threshold."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from harness.evaluation.recorded_game import BodyKind
from harness.evaluation.rule_book import thresholds
from harness.evaluation.rule_book.causes import cause_of, event_words
from harness.evaluation.rule_book.course import Course
from harness.evaluation.rule_book.named_manoeuvres import NAMES, find_manoeuvres
from harness.game.arrays import FloatArray, IntArray
from harness.road.scene.open_scene import OpenScene
from tests.support.rollouts import Steady, arm, play
from tests.support.scenes import LEFT_Y, RIGHT_Y, STRAIGHT, STRAIGHT_NODES, build_scene
from tests.support.tiny import PAPER_DISTRACTED
from tests.support.traces import game, rows

STEP_S = 0.1
LENGTH_M, WIDTH_M, WHEELBASE_M = 4.6, 1.8, 2.7
ENDING_Y, THROUGH_Y = -4.8, -1.6  # lanes of the merge; the right one ends at x 100
KINDS = {"car": BodyKind(length_m=LENGTH_M), "van": BodyKind(length_m=6.0, width_m=2.0)}


def car(
    name: str,
    x_m: float,
    y_m: float | FloatArray = THROUGH_Y,
    speed_mps: float | FloatArray = 12.0,
    steps: int = 60,
    *,
    heading_rad: float | FloatArray | None = None,
    steering_rad: float | FloatArray = 0.0,
    lapsed: tuple[int, int] = (0, 0),
    outcome: str = "",
    kind: str = "car",
) -> pd.DataFrame:
    """A car's rows: start at `x_m`, `y_m` in every step, heading along its path; the last row has `outcome`."""
    speed, y = (np.broadcast_to(np.asarray(each, dtype=float), steps) for each in (speed_mps, y_m))
    x = x_m + np.concatenate(([0.0], np.cumsum(speed[1:]) * STEP_S))
    headings = np.arctan2(np.gradient(y), np.maximum(np.gradient(x), 1e-6)) if heading_rad is None else heading_rad
    poses = list(zip(x, y, np.broadcast_to(headings, steps), speed, strict=True))
    return pd.DataFrame(rows(name, poses, kind, outcome, range(*lapsed))).assign(steering_rad=steering_rad)


def across(begin_m: float, end_m: float, first: int, last: int, steps: int = 60) -> FloatArray:
    """[T] y that changes linearly from one value to the other between two steps."""
    return np.interp(np.arange(steps), [first, last], [begin_m, end_m])


def named(scene: OpenScene, *cars: pd.DataFrame) -> list[dict[str, Any]]:
    trace = pd.concat(cars).sort_values(["step", "player"], ignore_index=True)
    driven = trace.loc[trace["steering_rad"] != 0.0, "player"].unique()
    return find_manoeuvres(Course(game=game(scene.world, trace, KINDS, steers=trace["player"].isin(driven))))


def only(found: Sequence[dict[str, Any]], player: str, name: str) -> list[dict[str, Any]]:
    return [each for each in found if (each["player"], each["manoeuvre"]) == (player, name)]


def names(found: Sequence[dict[str, Any]], player: str) -> list[str]:
    return [each["manoeuvre"] for each in found if each["player"] == player]


# --- cut_in -----------------------------------------------------------------------------------------------------------


def cutting_in(gap_m: float, speed_mps: float = 12.0, **changes: Any) -> list[pd.DataFrame]:
    """The non-ego moves into the ego's lane with this gap, bumper to bumper, where it enters the ego's path (step 24);
    the ego drives at 12 m/s."""
    ahead = gap_m + LENGTH_M - (speed_mps - 12.0) * 24 * STEP_S
    return [
        car("ego", 5.0),
        car("non_ego", 5.0 + ahead, across(ENDING_Y, THROUGH_Y, 15, 35), speed_mps, heading_rad=0.0, **changes),
    ]


def test_cut_in__has_its_time_gap_and_time_to_collision(merge: OpenScene) -> None:
    (found,) = only(named(merge, *cutting_in(10.0, 8.0)), "non_ego", "cut_in")
    assert found["time_s"] == 2.0  # its centre is 0.8 m from the mark, and half of its width is 0.9 m
    assert found["gap_m"] == pytest.approx(10.0 + 0.4 * 4.0, abs=0.3)  # 0.4 s before their bodies begin to overlap
    assert found["ttc_s"] == pytest.approx(found["gap_m"] / 4.0)
    assert found["until_s"] == 3.2  # within half a metre of the ego's path
    assert (
        found["text"] == f"cuts in from the right, {found['gap_m']:.1f} m ahead of the ego, TTC {found['ttc_s']:.1f} s"
    )


@pytest.mark.parametrize(
    ("gap_m", "speed_mps", "cuts_in"),
    [
        (17.5, 12.0, True),  # 1.5 s at 12 m/s are 18 m
        (18.5, 12.0, False),
        (28.5, 4.0, True),  # 8 m/s slower: 31.7 m and 3.96 s when it crosses the mark, in step 20
        (29.2, 4.0, False),  # 32.4 m and 4.05 s
    ],
)
def test_cut_in__only_within_the_stated_gap_or_time_to_collision(
    gap_m: float, speed_mps: float, cuts_in: bool, merge: OpenScene
) -> None:
    assert bool(only(named(merge, *cutting_in(gap_m, speed_mps)), "non_ego", "cut_in")) == cuts_in


@pytest.mark.parametrize(
    "cars",
    [
        [car("ego", 5.0, across(ENDING_Y, THROUGH_Y, 15, 35)), car("non_ego", 18.0)],  # the ego enters behind
        [car("ego", 5.0), car("non_ego", 5.0 + LENGTH_M + 0.5)],  # in the path from the start
        [car("ego", 5.0), car("non_ego", 5.0 + LENGTH_M + 30.0)],
    ],
)
def test_cut_in__not_by_a_leader(cars: list[pd.DataFrame], merge: OpenScene) -> None:
    assert "cut_in" not in [each["manoeuvre"] for each in named(merge, *cars)]


# --- hard_brake -------------------------------------------------------------------------------------------------------


def braking(deceleration_mps2: float, first: int, last: int, steps: int = 60) -> FloatArray:
    slowed = np.clip(np.arange(steps) - first, 0, last - first) * STEP_S * deceleration_mps2
    return np.maximum(14.0 - slowed, 0.0)


@pytest.mark.parametrize(
    ("deceleration_mps2", "steps", "expected"),
    [(4.0, 3, 1), (3.9, 10, 0), (4.5, 2, 0), (8.0, 10, 1)],
)
def test_hard_brake__by_deceleration_and_duration(
    deceleration_mps2: float, steps: int, expected: int, straight: OpenScene
) -> None:
    speed = braking(deceleration_mps2, 20, 20 + steps)
    found = only(named(straight, car("ego", 20.0, RIGHT_Y, speed)), "ego", "hard_brake")
    assert len(found) == expected
    if found:
        assert (found[0]["time_s"], found[0]["until_s"]) == (pytest.approx(2.1), pytest.approx(2.0 + steps * STEP_S))
        assert np.isnan([found[0]["gap_m"], found[0]["ttc_s"]]).all()


def test_hard_brake__a_short_pause_does_not_split_it(straight: OpenScene) -> None:
    speed = 14.0 - 0.5 * np.cumsum(np.isin(np.arange(60), [10, 11, 12, 16, 17, 18, 40, 41, 42]))
    found = only(named(straight, car("ego", 20.0, RIGHT_Y, speed)), "ego", "hard_brake")
    assert [(each["time_s"], each["until_s"]) for each in found] == [(1.0, 1.8), (4.0, 4.2)]


# --- swerve -----------------------------------------------------------------------------------------------------------


def swerving(lateral_mps2: float, turned_deg: float, steps: int = 60, side: float = 1.0) -> pd.DataFrame:
    """Steers for half a second from step 20 on, and has then turned by this angle."""
    steering = np.arctan(WHEELBASE_M * lateral_mps2 / 12.0**2)
    wheel = np.where((np.arange(steps) >= 20) & (np.arange(steps) < 25), side * steering, 0.0)
    heading = side * np.radians(turned_deg) * np.clip((np.arange(steps) - 19) / 5, 0, 1)
    return car("ego", 20.0, RIGHT_Y, heading_rad=heading, steering_rad=wheel)


@pytest.mark.parametrize(
    ("lateral_mps2", "turned_deg", "swerves"),
    [(2.1, 3.1, True), (1.9, 6.0, False), (2.1, 2.9, False), (5.0, 8.0, True)],
)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_swerve__by_lateral_acceleration_and_heading(
    lateral_mps2: float, turned_deg: float, side: float, swerves: bool, straight: OpenScene
) -> None:
    found = only(named(straight, swerving(lateral_mps2, turned_deg, side=side)), "ego", "swerve")
    assert len(found) == swerves
    if found:
        assert (found[0]["time_s"], found[0]["until_s"]) == (2.0, 2.4)
        assert ("left" if side > 0 else "right") in found[0]["text"]


def test_swerve__following_a_bend_is_not_one(tmp_path: Path) -> None:
    """A quarter circle of radius 30 m at 10 m/s takes 3.3 m/s2."""
    angles = np.linspace(0.0, 0.5 * np.pi, 30)
    points = [(0.0, 0.0), *zip(150 + 30 * np.sin(angles), 30 - 30 * np.cos(angles), strict=True), (180.0, 180.0)]
    shape = " ".join(f"{x:.3f},{y:.3f}" for x, y in points)
    scene = build_scene(
        tmp_path / "bend",
        STRAIGHT_NODES.replace('x="300" y="0"', 'x="180" y="180"'),
        f'<edge id="road" from="a" to="b" numLanes="2" speed="13.89" spreadType="center" shape="{shape}"/>',
        STRAIGHT,
    )
    routes = scene.world.road.routes
    station = 60.0 + np.arange(150)  # through the bend, 1 m a step, on the line of its route
    rows = routes.first_row[0] + np.rint((station + 100.0) / 0.5).astype(int)
    steering = np.where((station > 148.0) & (station < 198.0), np.arctan(WHEELBASE_M / 30.0), 0.0)
    drawn = car("ego", 0.0, 0.0, 10.0, 150, heading_rad=routes.heading_rad[rows], steering_rad=steering)
    drawn = drawn.assign(x_m=routes.x_m[rows], y_m=routes.y_m[rows])
    assert not only(named(scene, drawn), "ego", "swerve")
    turned = np.where(station > 100.0, np.radians(10.0), 0.0)  # the same steering on a straight road
    astray = drawn.assign(heading_rad=drawn["heading_rad"] + turned, steering_rad=np.roll(steering, -45))
    assert only(named(scene, astray), "ego", "swerve")


# --- drift ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("begin_m", "moved_m", "drifts"),
    [
        (0.0, 0.52, True),
        (0.0, 0.48, False),
        (0.0, 0.0, False),
        (0.0, -0.52, True),
        (1.2, 1.2, True),  # over into the next lane; 1.6 m is half way
    ],
)
def test_drift__a_lapse_in_which_the_car_moves_sideways(
    begin_m: float, moved_m: float, drifts: bool, straight: OpenScene
) -> None:
    y = across(RIGHT_Y + begin_m, RIGHT_Y + begin_m + moved_m, 9, 40)
    found = only(named(straight, car("non_ego", 20.0, y, lapsed=(10, 41))), "non_ego", "drift")
    assert len(found) == drifts
    if found:
        assert (found[0]["time_s"], found[0]["until_s"]) == (1.0, 4.0)
        assert f"{abs(moved_m):.1f} m to the {'left' if moved_m > 0 else 'right'}" in found[0]["text"]


def test_drift__steered_movement_is_not_one(straight: OpenScene) -> None:
    wheel = 0.01 * np.sin(np.arange(60))
    y = across(RIGHT_Y, LEFT_Y, 10, 40)
    assert not only(named(straight, car("non_ego", 20.0, y, steering_rad=wheel)), "non_ego", "drift")


@pytest.mark.parametrize(
    ("still_steps", "begin_m", "moved_m", "drifts"),
    [
        (21, 0.2, 0.6, True),  # 0.8 m from the middle of the lane
        (18, 0.2, 0.6, False),  # for less than 2 s
        (21, 0.0, 0.6, False),  # still within the lane
        (21, 0.6, 0.4, False),  # hardly moves
    ],
)
def test_drift__a_still_wheel_out_of_the_lane(
    still_steps: int, begin_m: float, moved_m: float, drifts: bool, straight: OpenScene
) -> None:
    wheel = 0.01 * np.sin(np.arange(60))
    wheel[10 : 10 + still_steps] = wheel[9]
    y = across(RIGHT_Y + begin_m, RIGHT_Y + begin_m + moved_m, 9, 9 + still_steps)
    y[10 + still_steps :] = RIGHT_Y
    found = only(named(straight, car("non_ego", 20.0, y, steering_rad=wheel)), "non_ego", "drift")
    assert len(found) == drifts


def test_drift__a_lane_change_by_sumo_is_not_one(straight: OpenScene) -> None:
    """SUMO has no steering: its drivers' steering is recorded as 0."""
    assert named(straight, car("non_ego", 20.0, across(RIGHT_Y, LEFT_Y, 10, 40))) == []


# --- overtake ---------------------------------------------------------------------------------------------------------


def overtaking(behind_m: float, ahead_m: float, steps: int = 50) -> list[pd.DataFrame]:
    """From a distance behind the ego's centre to a distance ahead of it, in the lane beside it."""
    gains = (behind_m + ahead_m) / ((steps - 1) * STEP_S)
    ego = car("ego", 20.0, THROUGH_Y, 10.0, steps)
    return [ego, car("non_ego", 20.0 - behind_m, ENDING_Y, 10.0 + gains, steps)]


@pytest.mark.parametrize(
    ("behind_m", "ahead_m", "overtakes"),
    [
        (6.0, 6.0, True),
        (2.1, 4.7, True),
        (1.9, 6.0, False),  # was beside it from the start
        (6.0, 4.5, False),  # not completely past
        (6.0, -0.5, False),
    ],
)
def test_overtake__from_behind_until_completely_ahead(
    behind_m: float, ahead_m: float, overtakes: bool, merge: OpenScene
) -> None:
    found = only(named(merge, *overtaking(behind_m, ahead_m)), "non_ego", "overtake")
    assert len(found) == overtakes
    if found:
        gain_mps = (behind_m + ahead_m) / 4.9
        assert found[0]["time_s"] == pytest.approx(max(behind_m - LENGTH_M, 0.0) / gain_mps, abs=0.11)
        assert found[0]["until_s"] == pytest.approx((behind_m + LENGTH_M) / gain_mps, abs=0.11)
        assert found[0]["text"].startswith("overtakes on the lane that ends, ")


def test_overtake__only_on_a_lane_that_ends(straight: OpenScene, merge: OpenScene) -> None:
    ego, non_ego = overtaking(6.0, 6.0)
    assert "overtake" not in names(named(straight, ego, non_ego), "non_ego")
    on_the_lane_that_goes_on = [ego.assign(y_m=ENDING_Y), non_ego.assign(y_m=THROUGH_Y)]
    assert "overtake" not in names(named(merge, *on_the_lane_that_goes_on), "non_ego")


# --- tailgate ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("time_gap_s", "speed_mps", "steps", "tailgates"),
    [(0.95, 12.0, 21, True), (1.05, 12.0, 60, False), (0.5, 12.0, 19, False), (0.5, 4.9, 60, False)],
)
def test_tailgate__by_time_gap_duration_and_speed(
    time_gap_s: float, speed_mps: float, steps: int, tailgates: bool, straight: OpenScene
) -> None:
    gap_m = time_gap_s * speed_mps
    cars = [
        car("ego", 20.0 + LENGTH_M + gap_m, RIGHT_Y, speed_mps, steps),
        car("non_ego", 20.0, RIGHT_Y, speed_mps, steps),
    ]
    found = only(named(straight, *cars), "non_ego", "tailgate")
    assert len(found) == tailgates
    if found:
        assert found[0]["gap_m"] == pytest.approx(gap_m, abs=0.3)


# --- forced_stop ------------------------------------------------------------------------------------------------------


def stopping(at_x_m: float, to_mps: float = 1.0, steps: int = 60) -> tuple[float, FloatArray]:
    """The start, and speeds that fall from 12 m/s by 3 m/s2 to `to_mps` at this place, and stay constant."""
    speed = np.maximum(12.0 - 0.3 * np.arange(steps), to_mps)
    slow = int(np.flatnonzero(speed <= 2.2)[0])
    return at_x_m - speed[1 : slow + 1].sum() * STEP_S, np.where(np.arange(steps) <= slow + 3, speed, 0.0)


@pytest.mark.parametrize(("before_m", "forced"), [(14.0, True), (17.0, False)])
def test_forced_stop__at_the_end_of_the_lane(before_m: float, forced: bool, merge: OpenScene) -> None:
    x, speed = stopping(100.0 - before_m)
    found = only(named(merge, car("non_ego", x, ENDING_Y, speed)), "non_ego", "forced_stop")
    assert len(found) == forced
    if found:
        assert "before its lane ends" in found[0]["text"]


@pytest.mark.parametrize(("gap_m", "forced"), [(9.0, True), (12.0, False)])
def test_forced_stop__behind_another(gap_m: float, forced: bool, straight: OpenScene) -> None:
    x, speed = stopping(100.0)
    cars = [car("ego", x, RIGHT_Y, speed), car("non_ego", 100.0 + LENGTH_M + gap_m, RIGHT_Y, 0.0)]
    found = only(named(straight, *cars), "ego", "forced_stop")
    assert len(found) == forced
    if found:
        assert found[0]["text"].endswith("m behind another")
        assert found[0]["gap_m"] <= 9.1


def test_forced_stop__not_on_an_open_road_nor_slowly_nor_without_earlier_speed(straight: OpenScene) -> None:
    x, speed = stopping(100.0)
    assert named(straight, car("ego", x, RIGHT_Y, speed)) == []
    ahead = car("non_ego", 108.0, RIGHT_Y, 0.0)
    assert not only(named(straight, car("ego", x, RIGHT_Y, np.maximum(speed, 2.3)), ahead), "ego", "forced_stop")
    assert not only(named(straight, car("ego", 100.0, RIGHT_Y, 2.0, 20), ahead), "ego", "forced_stop")


# --- what is looked at ------------------------------------------------------------------------------------------------


def test_find__ends_with_the_egos_game(straight: OpenScene) -> None:
    speed = braking(5.0, 40, 50)
    brakes = car("non_ego", 20.0, LEFT_Y, speed)
    assert names(named(straight, brakes), "non_ego") == ["hard_brake"]
    fails = car("ego", 60.0, RIGHT_Y, steps=30, outcome="rail")
    assert named(straight, brakes, fails) == []


# --- the paper's figure 4, played -------------------------------------------------------------------------------------


class Scripted(Steady):
    """Steers by a script, step by step, with constant speed."""

    def __init__(self, wheel: Sequence[float]) -> None:
        super().__init__()
        self._wheel, self._left = wheel, list(wheel)

    def reset(self, games: IntArray) -> None:
        self._left = list(self._wheel)

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        self._action = (0.0, self._left.pop(0) if len(self._left) > 1 else self._left[0])
        return super().decide(games, observation, noise)


def test_paper__a_distracted_drift_an_egos_swerve_and_the_rail(merge: OpenScene, tmp_path: Path) -> None:
    """Figure 4: the non-ego "enters a distracted state as their vehicle is drifting sideways"; the ego "swerves away
    and collides with the guard rail"."""
    drivers = Scripted([0.0] * 30 + [0.9] * 10), Steady()
    text, bumps = PAPER_DISTRACTED.read_text(encoding="utf-8"), "bump_steering_sd_rad = "
    assert f"{bumps}0.0005" in text
    bumpy = tmp_path / "bumpy.toml"
    bumpy.write_text(text.replace(f"{bumps}0.0005", f"{bumps}0.006"), encoding="utf-8")
    stories = set()
    for played in play(arm(merge, *drivers, persona=bumpy), episodes=12):
        assert played.recorded is not None
        cause = cause_of(Course(game=played.recorded))
        if cause is not None:
            stories.add(f"{event_words(cause['event'])} -> {cause['reaction']} -> {played.record['ego_outcome']}")
    assert "drift -> swerves -> rail" in stories


# --- the page about them ----------------------------------------------------------------------------------------------


def test_docs__state_every_rule_and_number(repository: Path) -> None:
    rules, table = ((repository / "docs" / f"manoeuvre{name}.md").read_text("utf-8") for name in ("s", "-numbers"))
    stated = {name: float(value) for name, value in re.findall(r"^\| `([A-Z_0-9]+)` \| ([0-9.]+) \|", table, re.M)}
    numbers = {name: value for name, value in vars(thresholds).items() if name.isupper()}
    assert stated == {name: pytest.approx(value, rel=5e-3) for name, value in numbers.items()}
    assert re.findall(r"^\| `([a-z_]+)` \|", rules, re.M) == list(NAMES)
