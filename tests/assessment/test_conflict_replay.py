"""Replays of collisions: cut-ins built by hand, and a collision that SUMO's arena recorded.

The cut-ins are those of `tests/drivers/test_emergency_braking.py`: the smallest gap from which each reference driver
avoids the collision is that of the public programme of the EU Joint Research Centre (github.com/ec-jrc/JRC-FSM). Here
the whole replay decides: positions, contact of boxes, observation, and the driver's car.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from harness.assessment.conflict_replay import AFTERWARDS_S, Collision, ConflictReplay, collision_of
from harness.assessment.continuation import Continuation
from harness.assessment.recorded_courses import RecordedCourse, course_of
from harness.drivers.reference_drivers import PERSONS, REFERENCES
from harness.game.arrays import FloatArray
from harness.game.roles import EGO
from harness.road.scene.open_scene import OpenScene
from tests.support.rollouts import Steady, arm, play, trace
from tests.support.scenes import build_scene

KMH = 1.0 / 3.6
LENGTH_M, WIDTH_M, LANE_M = 4.3, 1.9, 3.5  # of the cars and the lanes in the programme
START_X_M, STEP_S = 50.0, 0.1

# Driver, lateral speed (m/s), own speed and the other's (km/h), largest gap (m) from which the programme's driver
# crashes. The rows of careful_and_competent are without emergency braking for a car wholly ahead.
PUBLISHED = [
    ("careful_and_competent", 1.8, 60, 20, 25),
    ("careful_and_competent", 1.8, 40, 20, 10),
    ("rss", 1.2, 60, 20, 20),
    ("rss", 1.2, 60, 40, 8),
    ("rss", 1.2, 90, 50, 20),
    ("fuzzy", 1.2, 60, 20, 21),
    ("fuzzy", 0.6, 60, 40, 7),
    ("fuzzy", 1.2, 90, 50, 21),
]


@pytest.fixture(scope="module")
def straight(tmp_path_factory: pytest.TempPathFactory) -> OpenScene:
    """A straight road of two lanes with the sizes of the programme."""
    scene = build_scene(
        tmp_path_factory.mktemp("scenes") / "straight",
        '<node id="a" x="0" y="0"/><node id="b" x="900" y="0"/>',
        f'<edge id="road" from="a" to="b" numLanes="2" speed="40" width="{LANE_M}" spreadType="right"/>',
        {"ego": ("road", "road_1"), "non_ego": ("road", "road_0"), "goal": "road"},
        goal_m=850.0,
        time_limit_s=60.0,
    )
    sizes = {"length_m": np.full(2, LENGTH_M), "width_m": np.full(2, WIDTH_M)}
    return replace(scene, world=replace(scene.world, **sizes))


def cut_in(scene: OpenScene, *, gap_m: float, own_kmh: float, other_kmh: float, approach_mps: float) -> RecordedCourse:
    """The course of a cut-in: both keep their speeds, and the other moves over until it is in the ego's lane."""
    own, other = own_kmh * KMH, other_kmh * KMH
    time = np.arange(0.0, 60.0, STEP_S)
    offset = np.maximum(LANE_M - approach_mps * time, 0.0)
    ahead = gap_m + LENGTH_M + (other - own) * time
    touching = np.flatnonzero((ahead < LENGTH_M) & (offset < WIDTH_M))
    failed = int(touching[0])
    steps = failed + round(AFTERWARDS_S / STEP_S) + 1
    lane_y = -0.5 * LANE_M  # the centre of the left lane, in which the ego starts
    players = np.zeros((steps, 2, 4))
    players[:, EGO] = np.stack(poses(START_X_M + own * time, np.full_like(time, lane_y), own), axis=1)[:steps]
    players[:, 1] = np.stack(poses(START_X_M + own * time + ahead, lane_y - offset, other), axis=1)[:steps]
    return RecordedCourse(
        failed_step=failed,
        players=players,
        players_present=np.ones((steps, 2), dtype=bool),
        ego_acceleration_mps2=np.zeros(steps),
        ego_steering_rad=np.zeros(steps),
        station_m=players[:, :, 0],
        others=np.zeros((steps, 0, 4)),
        others_present=np.zeros((steps, 0), dtype=bool),
        others_size_m=np.zeros((0, 2)),
        signals=np.zeros((steps, 0), dtype=np.int8),
        opponent=1,
    )


def poses(x: FloatArray, y: FloatArray, speed: float) -> tuple[FloatArray, ...]:
    moving = np.gradient(y, x)
    return x, y, np.arctan(moving), np.full_like(x, speed)


@pytest.mark.parametrize(("driver", "approach_mps", "own_kmh", "other_kmh", "last_crash_m"), PUBLISHED)
def test_takeovers__smallest_avoidable_gap_is_that_of_the_published_programme(
    straight: OpenScene, driver: str, approach_mps: float, own_kmh: int, other_kmh: int, last_crash_m: int
) -> None:
    gaps_m = np.arange(max(last_crash_m - 6, 1), last_crash_m + 7)
    motion = {"own_kmh": own_kmh, "other_kmh": other_kmh, "approach_mps": approach_mps}
    collisions = [
        Collision(episode=place, course=cut_in(straight, gap_m=float(gap), **motion))
        for place, gap in enumerate(gaps_m)
    ]
    takeovers = ConflictReplay(straight, collisions, seed=1).takeovers()[driver]
    crashed = [gap for gap, each in zip(gaps_m.tolist(), takeovers, strict=True) if not each.prevented]
    assert abs(max(crashed) - last_crash_m) <= 2, "a step is 1.1 m at a closing speed of 40 km/h"


def test_takeovers__the_upper_bound_prevents_what_a_person_prevents(straight: OpenScene) -> None:
    courses = [
        cut_in(straight, gap_m=gap, own_kmh=60, other_kmh=20, approach_mps=1.2) for gap in (4.0, 12.0, 18.0, 24.0, 40.0)
    ]
    collisions = [Collision(episode=place, course=course) for place, course in enumerate(courses)]
    found = ConflictReplay(straight, collisions, seed=1).takeovers()
    prevented = {name: [each.prevented for each in takeovers] for name, takeovers in found.items()}
    assert list(prevented) == list(REFERENCES)
    assert prevented["upper_bound"] == [False, True, True, True, True]
    for name in PERSONS:
        assert (np.array(prevented[name]) <= np.array(prevented["upper_bound"])).all()


def test_takeovers__the_course_of_a_prevented_collision_begins_at_the_danger_and_stays_behind_the_other(
    straight: OpenScene,
) -> None:
    courses = [cut_in(straight, gap_m=gap, own_kmh=60, other_kmh=20, approach_mps=1.2) for gap in (4.0, 40.0)]
    collisions = [Collision(episode=place, course=course) for place, course in enumerate(courses)]
    too_late, prevented = ConflictReplay(straight, collisions, seed=1).takeovers()["careful_and_competent"]
    assert (too_late.prevented, too_late.course) == (False, None)
    assert prevented.course is not None
    assert prevented.danger_step is not None
    recorded = courses[1].players[prevented.danger_step :]
    assert len(prevented.course) == len(recorded)
    assert prevented.course[0] == pytest.approx(recorded[0, EGO, :3])
    at_collision = courses[1].failed_step - prevented.danger_step
    assert prevented.course[at_collision, 0] < recorded[at_collision, EGO, 0]
    assert (recorded[:, 1, 0] - prevented.course[:, 0] > LENGTH_M).all()


def test_chances__last_moment_is_that_of_the_braking_distance(straight: OpenScene) -> None:
    """Closing at 11.11 m/s, braking at 0.8 g = 7.85 m/s^2 needs 11.11^2 / 15.7 = 7.86 m, and the brakes build it up
    with a jerk of 12.65 m/s^3 and a lag of 0.2 s: closing speeds of 10.98, 10.73, 10.35, 9.84, 9.22, 8.53, 7.80, 7.04,
    6.26 and 5.48 m/s after each step, 8.6 m, and 5.48^2 / 15.7 = 1.9 m: 10.5 m."""
    course = cut_in(straight, gap_m=40.0, own_kmh=60, other_kmh=20, approach_mps=1.8)
    (chance,) = ConflictReplay(straight, [Collision(episode=0, course=course)], seed=1).chances()
    assert chance.first_step == 0
    assert chance.last_step is not None
    closing = 40.0 * KMH
    gap_m = 40.0 - closing * chance.last_step * STEP_S
    assert gap_m == pytest.approx(10.5, abs=closing * STEP_S)


def test_chances__are_the_same_when_a_person_has_reached_its_goal_before_the_collision(straight: OpenScene) -> None:
    """The ego hits a bystander. A person reaches its goal a second after the start, and is gone in the next step."""
    alone = cut_in(straight, gap_m=20.0, own_kmh=60, other_kmh=20, approach_mps=1.2)
    steps, leaves, speed_mps = len(alone.players), 10, 20.0
    there = np.arange(steps) <= leaves
    players, present = alone.players.copy(), alone.players_present.copy()
    x_m = 850.5 + speed_mps * STEP_S * (np.arange(steps) - leaves)
    players[:, 1] = np.stack(poses(x_m, np.full(steps, -1.5 * LANE_M), speed_mps), axis=1) * there[:, None]
    present[:, 1] = there
    hit = replace(
        alone,
        players=players,
        players_present=present,
        station_m=players[:, :, 0],
        others=alone.players[:, 1:],
        others_present=alone.players_present[:, 1:],
        others_size_m=np.array([[LENGTH_M, WIDTH_M]]),
        opponent=2,
    )
    expected, found = (
        ConflictReplay(straight, [Collision(episode=0, course=course)], seed=1).chances() for course in (alone, hit)
    )
    assert expected[0].first_step == 0
    assert found == expected


def test_collision_of__knows_the_opponent_of_a_recorded_game(merge: OpenScene) -> None:
    """Both keep their pedals still on the merge: the lanes end in each other, and some of the games collide."""
    games = play(arm(merge, Steady(), Steady()), 6)
    for episode, game in enumerate(games):
        collision = collision_of(trace(game), merge, episode, Continuation.IN_ITS_PLACE)
        assert (collision is not None) == (game.record["ego_outcome"] == "collision")
        if collision is not None:
            assert collision.course.opponent == 1
            assert collision.course.failed_step * merge.world.step_s <= game.record["duration_s"] + 1e-9


def test_course_of__goes_on_in_its_place_or_into_the_egos_line(merge: OpenScene) -> None:
    """The other steers into the ego. Afterwards it stays beside the ego's line, or moves on into it."""
    games = play(arm(merge, Steady(), Steady(wheel=0.05)), 20)
    hits = [trace(game) for game in games if game.record["ego_outcome"] == "collision"]
    assert hits
    for hit in hits:
        stays, moves = (course_of(hit, merge, AFTERWARDS_S, continuation) for continuation in Continuation)
        failed = stays.failed_step
        assert (stays.players[: failed + 1] == moves.players[: failed + 1]).all()
        assert stays.players[:, EGO] == pytest.approx(moves.players[:, EGO])
        across_m = np.abs(moves.players[failed:, 1, 1] - moves.players[failed, EGO, 1])  # the road runs along x
        nearer_m = np.abs(stays.players[failed, 1, 1] - stays.players[failed - 5, 1, 1]) / 5
        expected_m = np.maximum(across_m[0] - nearer_m * np.arange(len(across_m)), 0.0)
        assert across_m == pytest.approx(expected_m, abs=1e-3)
        assert np.ptp(stays.players[failed:, 1, 1]) == pytest.approx(0.0, abs=1e-3)
