"""Whether a collision could have been prevented from the conflict on: another driver takes over a recorded game.

The others repeat their recorded course. The driver takes the ego over in the first step in which its own rule says that
the road user that the ego will touch is a danger, and drives from there, reaction time included. The collision counts
as prevented if the ego touches nothing until `AFTERWARDS_S` after the recorded collision. What the others do after that
collision is not recorded, and has two continuations (`assessment.continuation`). Vehicles that are behind the
ego at that moment are left out: drivers follow a car that brakes, recordings do not.

A human driver would not have followed a course that reacts to nothing either: the verdict is on this course alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import pandas as pd

from harness.assessment.continuation import Continuation
from harness.assessment.recorded_courses import (
    CourseReplay,
    RecordedCourse,
    RecordedCourses,
    course_of,
    start_of,
)
from harness.drivers.protocol import Driver
from harness.drivers.reference_drivers import (
    REFERENCES,
    FullBraking,
    ReferenceDriver,
    reference_driver,
)
from harness.drivers.sumo import SumoDriver
from harness.environments.arena import Arena, Seat
from harness.environments.seats import taken_over
from harness.game.arrays import FloatArray, IntArray
from harness.game.initial_state import InitialState, draw_initial_state
from harness.game.observation import observe
from harness.game.outcome import Outcome
from harness.game.roles import EGO
from harness.game.seeding import parts_of
from harness.road.scene.open_scene import OpenScene

AFTERWARDS_S = 3.0
"""How long the ego must go on without a contact after the time of the recorded collision."""
_GRID_S = 0.5
_GAMES_AT_ONCE = 512  # bounds the memory: a campaign may have thousands of failures
_NEVER = -1


@dataclass(frozen=True, kw_only=True)
class Collision:
    """A recorded game in which the ego touched another road user."""

    episode: int
    course: RecordedCourse


@dataclass(frozen=True, kw_only=True)
class Takeover:
    """How one driver fares in one collision from the conflict on."""

    danger_step: int | None
    """The first step in which its rule says danger; None: it never does."""
    course: FloatArray | None
    """[T, 3] x_m, y_m, heading_rad of the ego from `danger_step` until `AFTERWARDS_S` after the recorded collision;
    None unless it is prevented."""

    @property
    def prevented(self) -> bool:
        return self.course is not None


class _Replays(NamedTuple):
    """Replays in which a driver takes over, [N] each."""

    games: IntArray
    """The collision, by its number."""
    first_steps: IntArray
    drivers: IntArray
    """The driver, by its number."""


@dataclass(frozen=True, kw_only=True)
class Chance:
    """The first and the last step from which full braking prevents a collision; None: it does from no step."""

    first_step: int | None
    last_step: int | None


def collision_of(trace: pd.DataFrame, scene: OpenScene, episode: int, continuation: Continuation) -> Collision | None:
    """The collision that ends the ego's game in a trace; None if it touched no other road user."""
    course = course_of(trace, scene, AFTERWARDS_S, continuation)
    return Collision(episode=episode, course=course) if course.opponent >= 0 else None


class ConflictReplay:
    """Replays of the collisions of one arm and training seed."""

    def __init__(self, scene: OpenScene, collisions: Sequence[Collision], seed: int) -> None:
        self._scene = replace(scene, perception_errors=None)  # reference drivers see what is there
        self._collisions, self._seed = collisions, seed

    def takeovers(self) -> dict[str, list[Takeover]]:
        """How each of `REFERENCES` fares in each collision."""
        if not self._collisions:
            return {name: [] for name in REFERENCES}
        drivers = [reference_driver(name, self._scene.world) for name in REFERENCES]
        observations = self._observed()
        danger_steps = np.array([self._danger_steps(each, observations) for each in drivers])
        of_driver, games = np.nonzero(danger_steps != _NEVER)
        found = self._courses(_Replays(games, danger_steps[of_driver, games], of_driver), drivers)
        courses = dict(zip(zip(of_driver.tolist(), games.tolist(), strict=True), found, strict=True))
        return {
            name: [
                Takeover(danger_step=None if step == _NEVER else step, course=courses.get((driver, game)))
                for game, step in enumerate(danger_steps[driver].tolist())
            ]
            for driver, name in enumerate(REFERENCES)
        }

    def chances(self) -> list[Chance]:
        """The first and last step from which full braking prevents each collision: searched on a grid of `_GRID_S`,
        then by bisection to the step."""
        if not self._collisions:
            return []
        spacing = max(round(_GRID_S / self._scene.world.step_s), 1)
        ends = [each.course.failed_step for each in self._collisions]
        grid = [(game, step) for game, end in enumerate(ends) for step in range(0, end, spacing)]
        avoids = self._prevented(grid)
        good = [[step for step in range(0, end, spacing) if avoids[game, step]] for game, end in enumerate(ends)]
        found = [game for game, steps in enumerate(good) if steps]
        # each search: the collision, a step from which braking prevents it, and one from which it may not
        firsts = [(game, good[game][0], max(good[game][0] - spacing, -1)) for game in found]
        lasts = [(game, good[game][-1], min(good[game][-1] + spacing, ends[game])) for game in found]
        between = [(game, step) for game, a, b in firsts + lasts for step in range(min(a, b) + 1, max(a, b))]
        avoids |= self._prevented(between)
        chances = [Chance(first_step=None, last_step=None)] * len(ends)
        for first, last in zip(firsts, lasts, strict=True):
            chances[first[0]] = Chance(first_step=_boundary(avoids, *first), last_step=_boundary(avoids, *last))
        return chances

    def _prevented(self, braked: Sequence[tuple[int, int]]) -> dict[tuple[int, int], bool]:
        """Whether full braking from a step on prevents a collision, by its number and the step."""
        games, steps = np.array(braked, dtype=np.int64).reshape(-1, 2).T
        courses = self._courses(_Replays(games, steps, np.zeros_like(games)), [FullBraking(self._scene.world)])
        return {key: course is not None for key, course in zip(braked, courses, strict=True)}

    def _danger_steps(self, driver: ReferenceDriver, observations: FloatArray) -> IntArray:
        """[N] the first step in which a driver's rule says danger, given the ego's observations [T, N, SIZE] of its
        opponent alone; _NEVER if it does in none before the collision."""
        steps, games, size = observations.shape
        danger = driver.sees_danger(observations.reshape(-1, size)).reshape(steps, games)
        ends = np.array([each.course.failed_step for each in self._collisions])
        danger &= np.arange(steps)[:, None] < ends
        return np.where(danger.any(axis=0), danger.argmax(axis=0), _NEVER)

    def _observed(self) -> FloatArray:
        """[T, N, SIZE] what the ego sees of its opponent in each step of each collision; T is that of the longest."""
        games = np.arange(len(self._collisions))
        replays = [CourseReplay(course=each.course, only_opponent=True) for each in self._collisions]
        arena = self._taken_over(_Replays(games, np.zeros_like(games), np.zeros_like(games)), replays, [SumoDriver()])
        observations = [arena.observation[:, EGO].copy()]
        for _ in range(max(each.course.failed_step for each in self._collisions)):
            arena.step()
            observations.append(arena.observation[:, EGO].copy())
        return np.array(observations)

    def _courses(self, played: _Replays, drivers: Sequence[Driver]) -> list[FloatArray | None]:
        """The course of the driver in each replay, as `Takeover.course`."""
        courses: list[FloatArray | None] = []
        for first in range(0, len(played.games), _GAMES_AT_ONCE):
            part = slice(first, first + _GAMES_AT_ONCE)
            courses += self._courses_at_once(_Replays(*(column[part] for column in played)), drivers)
        return courses

    def _courses_at_once(self, played: _Replays, drivers: Sequence[Driver]) -> list[FloatArray | None]:
        replays = [
            CourseReplay(course=self._collisions[game].course, first_step=step, without_followers=True)
            for game, step in zip(played.games.tolist(), played.first_steps.tolist(), strict=True)
        ]
        arena = self._taken_over(played, replays, drivers)
        lengths = np.array([len(each.course.players) - 1 - each.first_step for each in replays])
        prevented = np.ones(len(replays), dtype=bool)
        poses = [_poses_of_ego(arena)]
        for step in range(1, int(lengths.max()) + 1):
            arena.step()
            failed = np.isin(arena.state.outcome[:, EGO], (int(Outcome.COLLISION), int(Outcome.RAIL)))
            prevented &= ~(failed & (step <= lengths))
            poses.append(_poses_of_ego(arena))
        driven = np.stack(poses, axis=1)  # [N, T, 3]
        return [driven[row, : lengths[row] + 1] if avoided else None for row, avoided in enumerate(prevented.tolist())]

    def _taken_over(self, played: _Replays, replays: Sequence[CourseReplay], drivers: Sequence[Driver]) -> Arena:
        """An arena at the first step of each replay, with the ego's recorded acceleration and steering. Seats of SUMO
        repeat the recording, also those of pedestrians."""
        people = [(Seat(SumoDriver()),)] * (len(self._scene.world.roles) - 1)
        seats = [tuple(map(Seat, drivers)), *people]
        simulation = RecordedCourses(replays, taken_over(seats))
        arena = Arena(self._scene, len(replays), seats, simulation=simulation)
        rows = zip(played.games.tolist(), replays, played.drivers.tolist(), strict=True)
        arena.reset({row: self._start(*of_row) for row, of_row in enumerate(rows)})
        for row, each in enumerate(replays):
            arena.state.acceleration_mps2[row, EGO] = each.course.ego_acceleration_mps2[each.first_step]
            arena.state.steering_rad[row, EGO] = each.course.ego_steering_rad[each.first_step]
        arena.observation[:] = observe(arena.first_quantities(np.arange(len(replays))))
        return arena

    def _start(self, game: int, replay: CourseReplay, driver: int) -> InitialState:
        """The state in which a replay begins; its road is as slippery as in the recorded game."""
        drawn = draw_initial_state(self._scene.usual_starts, *parts_of(self._seed, self._collisions[game].episode))
        return replace(start_of(replay, drawn), member=(driver, *drawn.member[1:]))


def _boundary(avoids: Mapping[tuple[int, int], bool], game: int, good: int, bad: int) -> int:
    """The step nearest to `bad` from which full braking prevents a collision, by bisection from `good`."""
    while abs(good - bad) > 1:
        middle = (good + bad) // 2
        good, bad = (middle, bad) if avoids[game, middle] else (good, middle)
    return good


def _poses_of_ego(arena: Arena) -> FloatArray:
    """[N, 3] x_m, y_m, heading_rad."""
    state = arena.state
    return np.stack((state.x_m[:, EGO], state.y_m[:, EGO], state.heading_rad[:, EGO]), axis=-1)
