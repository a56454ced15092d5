"""Causes of failures: a game drawn by hand for each rule.

The road of the merge runs east, with lanes of 3.2 m centred on y = -1.6 (left) and -4.8 m; the mark between them is at
-3.2 m. Cars are 5 m long and 1.8 m wide, so that a car's side touches the mark with its centre 0.9 m beside it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import pandas as pd
import pytest

from harness.evaluation.recorded_game import BodyKind
from harness.evaluation.rule_book.causes import cause_lines, cause_of
from harness.evaluation.rule_book.course import Course
from harness.evaluation.tables import table_of
from harness.game.sight import Hiding
from harness.game.world import World
from tests.support.traces import Pose, along, game, rows

KINDS = {
    "car": BodyKind(),
    "van": BodyKind(length_m=6.5, width_m=2.2, vehicle_class="delivery"),
    "foot": BodyKind(length_m=0.5, width_m=0.5, vehicle_class="pedestrian"),
}
STEPS = 21
NORTH = 1.5707963


def course(world: World, *players: list[dict[str, Any]]) -> Course:
    return Course(game=game(world, pd.DataFrame([row for player in players for row in player]), KINDS))


def cause(merge: Any, *players: list[dict[str, Any]]) -> dict[str, Any]:
    found = cause_of(course(merge.world, *players))
    assert found is not None
    return found


def ego(
    end: str = "collision", poses: Sequence[Pose] | None = None, lapsed: Sequence[int] = ()
) -> list[dict[str, Any]]:
    """The ego in the right lane at 10 m/s for 2 s."""
    return rows("ego", poses or along(20.0, -4.8, 0.0, 10.0, STEPS), end=end, lapsed=lapsed)


def sideways(x: float, from_y: float, to_y: float, speed: float = 8.0) -> list[Pose]:
    """A car that moves across from step 5 to step 20 while it drives east."""
    shares = [min(max((k - 5) / 15, 0.0), 1.0) for k in range(STEPS)]
    return [(x + 0.1 * speed * k, from_y + (to_y - from_y) * share, 0.0, speed) for k, share in enumerate(shares)]


def test_cut_in__begins_when_the_body_crosses_the_lane_mark(merge: Any) -> None:
    # from y = -1.6 to -4.1 m in 15 steps: its right side, 0.9 m beside the centre, is at -3.2 m when the centre is at
    # -2.3 m: 0.7 / 2.5 * 15 = 4.2 steps after step 5; the first step beyond it is step 10, 1.0 s before the end
    found = cause(merge, ego(), rows("non_ego", sideways(25.0, -1.6, -4.1)))
    assert (found["other"], found["deed"]) == ("non_ego", "cuts in from the left")
    assert (found["time_s"], found["time_left_s"]) == (1.0, 1.0)
    assert (found["ego_saw"], found["reaction"], found["braking_mps2"]) == ("yes", "no reaction", 0.0)


def test_drift__is_a_body_that_crosses_the_mark_in_a_lapse(merge: Any) -> None:
    found = cause(merge, ego(), rows("non_ego", sideways(25.0, -1.6, -4.1), lapsed=range(4, STEPS)))
    assert found["deed"] == "drifts into the ego's lane from the left, inattentive"


@pytest.mark.parametrize(
    ("lapsed", "saw"), [(range(STEPS), False), (range(10, STEPS), False), (range(10, STEPS - 1), True), ((), True)]
)
def test_ego__saw_it_if_it_was_attentive_in_some_step(merge: Any, lapsed: Sequence[int], saw: bool) -> None:
    found = cause(merge, ego(lapsed=lapsed), rows("non_ego", sideways(25.0, -1.6, -4.1)))
    assert found["ego_saw"] == ("yes" if saw else "no")


def test_reaction__braking_is_one(merge: Any) -> None:
    speeds = [10.0] * 15 + [9.7, 9.4, 9.1, 8.8, 8.5, 8.2]
    poses = [(20.0 + k, -4.8, 0.0, speed) for k, speed in enumerate(speeds)]
    found = cause(merge, ego(poses=poses), rows("non_ego", sideways(25.0, -1.6, -4.1)))
    assert (found["reaction"], found["braking_mps2"]) == ("brakes", pytest.approx(3.0))


def test_reaction__braking_earlier_is_none(merge: Any) -> None:
    speeds = [14.0] * 3 + [12.0] + [10.0] * 31  # 20 m/s2 until 0.4 s; the mark is crossed at 2.4 s
    poses = [(10.0 + k, -4.8, 0.0, speed) for k, speed in enumerate(speeds)]
    other = [(14.0 + 0.8 * k, -1.6, 0.0, 8.0) for k in range(14)] + sideways(25.2, -1.6, -4.1)
    assert cause(merge, ego(poses=poses), rows("non_ego", other))["reaction"] == "no reaction"


NORTHBOUND = along(40.0, -9.8, NORTH, 2.0, STEPS)
BRAKING = [(41.0 + 0.2 * k, -4.8, 0.0, 2.0 if k < 10 else 1.0) for k in range(STEPS)]


@pytest.mark.parametrize(
    ("other", "deed"),
    [
        (rows("non_ego", NORTHBOUND), "crosses the ego's way from the right"),
        (rows("walker", NORTHBOUND, "foot"), "background traffic: walks into the ego's lane from the right"),
        (rows("non_ego", along(65.0, -4.8, 2 * NORTH, 10.0, STEPS)), "comes towards the ego in its lane"),
        (rows("non_ego", along(41.0, -4.8, 0.0, 2.0, STEPS)), "drives ahead of the ego"),
        (rows("non_ego", along(39.0, -4.8, 0.0, 1.0, STEPS), "foot"), "walks ahead of the ego"),
        (rows("non_ego", BRAKING), "brakes ahead of the ego"),
        (rows("non_ego", along(44.0, -4.8, 0.0, 0.0, STEPS)), "stands in the ego's lane"),
        (rows("non_ego", along(-4.0, -4.8, 0.0, 20.0, STEPS)), "hits the ego from behind"),
    ],
)
def test_deed__of_the_other_road_user(other: list[dict[str, Any]], deed: str, merge: Any) -> None:
    assert cause(merge, ego(), other)["deed"] == deed


STANDING = along(74.0, -4.8, 0.0, 0.0, 61)
SLOWING = [*along(52.0, -4.8, 0.0, 4.0, 55), *along(74.0, -4.8, 0.0, 0.0, 6)]


@pytest.mark.parametrize(
    ("poses", "ended", "deed"),
    [
        (STANDING, 5, "stands at the edge of the road, which it touched before"),
        (SLOWING, 55, "stands in the ego's lane"),  # 0.5 s before contact, when the ego was in danger already
    ],
)
def test_stands__a_person_that_touched_the_edge_before_the_danger(
    poses: list[Pose], ended: int, deed: str, merge: Any
) -> None:
    person = [row | {"outcome": "rail" if k >= ended else ""} for k, row in enumerate(rows("non_ego", poses))]
    assert cause(merge, ego(poses=along(10.0, -4.8, 0.0, 10.0, 61)), person)["deed"] == deed


def test_oncoming__the_danger_lasts_from_the_start(merge: Any) -> None:
    # the centres are 45 m apart and close at 20 m/s: 40 m between the bumpers, so danger in all 2 s
    oncoming = rows("non_ego", along(65.0, -4.8, 2 * NORTH, 10.0, STEPS))
    assert cause(merge, ego(), oncoming)["time_left_s"] == 2.0


def test_hidden__behind_a_van_until_it_is_past_it(merge: Any) -> None:
    # a standing van, 2.2 m wide, on the left lane, hides a walker that comes from behind it at 2 m/s
    van = rows("van", along(36.0, -2.4, 0.0, 0.0, STEPS), "van")
    walker = rows("non_ego", along(40.2, -1.6, -NORTH, 2.0, STEPS), "foot")
    world = replace(merge.world, hiding=Hiding(vehicles=True))
    found = cause_of(course(world, ego(), van, walker))
    assert found is not None
    assert found["ego_saw"] == "yes"
    assert 0.0 < found["hidden_until_s"] < found["time_left_s"]


def test_ego__that_changes_into_the_other_s_lane(merge: Any) -> None:
    found = cause(merge, ego(poses=sideways(20.0, -1.6, -4.1)), rows("non_ego", along(22.0, -5.2, 0.0, 8.0, STEPS)))
    assert found["deed"] == "the ego changes into its lane, to the right"


def test_rail__with_and_without_a_road_user_near(merge: Any) -> None:
    alone = cause(merge, ego("rail"))
    assert alone["deed"] == "the ego leaves the road with no road user near"
    assert not {"other", "ego_saw"} & alone.keys()
    near = cause(merge, ego("rail"), rows("non_ego", along(41.0, -4.8, 0.0, 2.0, STEPS)))
    assert (near["other"], near["deed"]) == ("non_ego", "drives ahead of the ego")


def test_goal__has_no_cause(merge: Any) -> None:
    assert cause_of(course(merge.world, ego("goal"))) is None
    person = rows("non_ego", along(20.0, -4.8, 0.0, 9.0, 5), end="rail")
    assert cause_of(course(merge.world, person)) is None


# --- sentences ----------------------------------------------------------------------------------------------------


def table(*causes: dict[str, Any]) -> pd.DataFrame:
    usual = {"arm": "a", "persona": "p", "seed": 1, "ego_outcome": "collision", "other": "non_ego", "time_s": 1.0}
    usual |= {"event": "cut_in", "deed": "cuts in from the left", "time_left_s": 0.4, "ego_saw": "yes"}
    usual |= {"reaction": "no reaction", "braking_mps2": 0.3, "ego_broke": "", "hidden_until_s": math.nan}
    return table_of("causes", [{**usual, **each, "episode": k} for k, each in enumerate(causes)])


@pytest.mark.parametrize(
    ("causes", "words"),
    [
        ([{}, {"time_left_s": 0.9}], ["2 of 2: cuts in from the left", "0.4 to 0.9 s", "the ego sees it, no reaction"]),
        ([{"ego_saw": "no"}], ["does not see it"]),
        ([{}, {"braking_mps2": 0.7}], ["braking up to 0.7 m/s²"]),
        ([{}, {}, {"reaction": "brakes", "ego_saw": "no"}], ["sees it in 2", "no reaction in 2", "brakes in 1"]),
        ([{"ego_broke": "runs a red light"}], ["the ego runs a red light"]),
        ([{"hidden_until_s": 0.8}, {"hidden_until_s": 0.6}, {}], ["hidden", "until 0.6 to 0.8 s before", "(in 2)"]),
    ],
)
def test_lines__say_how_many_what_how_long_and_what_the_ego_did(causes: list[dict[str, Any]], words: list[str]) -> None:
    (line,) = cause_lines(table(*causes))
    assert [each for each in words if each not in line] == []


def test_lines__of_many_kinds_the_rest_is_counted() -> None:
    games = table({}, *({"deed": f"deed {k}"} for k in range(4)), {})
    lines = cause_lines(games)
    assert [line.split(":")[0] for line in lines] == ["2 of 6", "1 of 6", "1 of 6", "2 of 6"]
    assert lines[-1] == "2 of 6: other causes"
    assert cause_lines(table()) == []
