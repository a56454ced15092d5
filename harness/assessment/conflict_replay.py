"""Whether a collision could have been prevented from the conflict on: another driver takes over a recorded game.

The others repeat their recorded course. The driver takes the ego over in the first step in which its own rule says that
the road user that the ego will touch is a danger, and drives from there, reaction time included. The collision counts
as prevented if the ego touches nothing until `AFTERWARDS_S` after the recorded collision. What the others do after that
collision is not recorded, and has two continuations (`assessment.continuation`). Vehicles that are behind the
ego at that moment are left out: drivers follow a car that brakes, recordings do not.

A human driver would not have followed a course that reacts to nothing either: the verdict is on this course alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

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
from harness.drivers.car import Car, car_of
from harness.drivers.protocol import Driver
from harness.drivers.reference_drivers import REFERENCES, FullBraking, lane_width_of, reference_driver
from harness.drivers.sumo import SumoDriver
from harness.environments.arena import Arena, Seat
from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.human_factors import HumanFactors
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
        self._car: Car = car_of(scene.world, EGO)
        self._lane_width_m = lane_width_of(scene.world)

    def takeovers(self) -> dict[str, list[Takeover]]:
        """How each of `REFERENCES` fares in each collision."""
        if not self._collisions:
            return {name: [] for name in REFERENCES}
        observations = self._observed()
        return {name: self._takeovers_of(name, observations) for name in REFERENCES}

    def chances(self) -> list[Chance]:
        """The first and last step from which full braking prevents each collision: searched on a grid of `_GRID_S`,
        then by bisection to the step."""
        if not self._collisions:
            return []
        spacing = max(round(_GRID_S / self._scene.world.step_s), 1)
        grids = [list(range(0, each.course.failed_step, spacing)) for each in self._collisions]
        games = np.repeat(np.arange(len(grids)), [len(grid) for grid in grids])
        steps = np.concatenate([np.array(grid, dtype=np.int64) for grid in grids])
        avoids = self._prevented(games, steps)
        found = np.unique(games[avoids])
        good = [steps[(games == game) & avoids] for game in found]
        first, last = (np.array([end(each) for each in good], dtype=np.int64) for end in (np.min, np.max))
        ends = np.array([self._collisions[game].course.failed_step for game in found], dtype=np.int64)
        first_steps = self._boundary(found, good=first, bad=np.maximum(first - spacing, -1))
        last_steps = self._boundary(found, good=last, bad=np.minimum(last + spacing, ends))
        chances = [Chance(first_step=None, last_step=None)] * len(grids)
        for game, begin, end in zip(found.tolist(), first_steps.tolist(), last_steps.tolist(), strict=True):
            chances[game] = Chance(first_step=begin, last_step=end)
        return chances

    def _boundary(self, games: IntArray, good: IntArray, bad: IntArray) -> IntArray:
        """[N] the step nearest to `bad` from which full braking prevents the collision, by bisection from `good`."""
        good, bad = good.copy(), bad.copy()
        while len(open_ := np.flatnonzero(np.abs(good - bad) > 1)):
            middle = (good[open_] + bad[open_]) // 2
            avoids = self._prevented(games[open_], middle)
            good[open_[avoids]], bad[open_[~avoids]] = middle[avoids], middle[~avoids]
        return good

    def _takeovers_of(self, name: str, observations: FloatArray) -> list[Takeover]:
        """How one reference driver fares, given the ego's observations [T, N, SIZE] of its opponent alone."""
        driver = reference_driver(name, self._car, self._lane_width_m)
        steps, games, size = observations.shape
        danger = driver.sees_danger(observations.reshape(-1, size)).reshape(steps, games)
        ends = np.array([each.course.failed_step for each in self._collisions])
        danger &= np.arange(steps)[:, None] < ends
        first = np.where(danger.any(axis=0), danger.argmax(axis=0), _NEVER)
        taken = np.flatnonzero(first != _NEVER)
        courses = dict(zip(taken.tolist(), self._courses(taken, first[taken], driver), strict=True))
        return [
            Takeover(danger_step=None if step == _NEVER else step, course=courses.get(game))
            for game, step in enumerate(first.tolist())
        ]

    def _observed(self) -> FloatArray:
        """[T, N, SIZE] what the ego sees of its opponent in each step of each collision; T is that of the longest."""
        replays = [CourseReplay(course=each.course, only_opponent=True) for each in self._collisions]
        arena = self._taken_over(range(len(replays)), replays, [SumoDriver()] * len(self._scene.world.roles))
        observations = [arena.observation[:, EGO].copy()]
        for _ in range(max(each.course.failed_step for each in self._collisions)):
            arena.step()
            observations.append(arena.observation[:, EGO].copy())
        return np.array(observations)

    def _prevented(self, games: IntArray, steps: IntArray) -> BoolArray:
        """[N] whether full braking from `steps` [N] on prevents the collisions `games` [N]."""
        courses = self._courses(games, steps, FullBraking(self._car))
        return np.array([course is not None for course in courses], dtype=bool)

    def _courses(self, games: IntArray, steps: IntArray, driver: Driver) -> list[FloatArray | None]:
        """The course of a driver that takes over in each of the collisions `games` [N] in `steps` [N], as
        `Takeover.course`."""
        courses: list[FloatArray | None] = []
        for first in range(0, len(games), _GAMES_AT_ONCE):
            part = slice(first, first + _GAMES_AT_ONCE)
            courses += self._courses_at_once(games[part], steps[part], driver)
        return courses

    def _courses_at_once(self, games: IntArray, steps: IntArray, driver: Driver) -> list[FloatArray | None]:
        replays = [
            CourseReplay(course=self._collisions[game].course, first_step=step, without_followers=True)
            for game, step in zip(games.tolist(), steps.tolist(), strict=True)
        ]
        people = len(self._scene.world.roles) - 1
        arena = self._taken_over(games.tolist(), replays, [driver, *[SumoDriver()] * people])
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

    def _taken_over(self, games: Sequence[int], replays: Sequence[CourseReplay], drivers: Sequence[Driver]) -> Arena:
        """An arena at the first step of each replay of the collisions `games` [N], with the ego's recorded acceleration
        and steering. Seats of SUMO repeat the recording, also those of pedestrians."""
        simulation = RecordedCourses(replays, [each.takes_over for each in drivers])
        arena = Arena(self._scene, len(replays), [Seat(each) for each in drivers], simulation=simulation)
        arena.reset(
            {row: self._start(game, replay) for row, (game, replay) in enumerate(zip(games, replays, strict=True))}
        )
        for row, each in enumerate(replays):
            arena.state.acceleration_mps2[row, EGO] = each.course.ego_acceleration_mps2[each.first_step]
            arena.state.steering_rad[row, EGO] = each.course.ego_steering_rad[each.first_step]
        arena.observation[:] = observe(arena.first_quantities(np.arange(len(replays))))
        return arena

    def _start(self, game: int, replay: CourseReplay) -> InitialState:
        """The state in which a replay begins; its road is as slippery as in the recorded game."""
        present = [1.0] * len(self._scene.world.roles)
        distribution = self._scene.start_distribution([HumanFactors()] * len(present), present)
        drawn = draw_initial_state(distribution, *parts_of(self._seed, self._collisions[game].episode))
        return start_of(replay, drawn)


def _poses_of_ego(arena: Arena) -> FloatArray:
    """[N, 3] x_m, y_m, heading_rad."""
    state = arena.state
    return np.stack((state.x_m[:, EGO], state.y_m[:, EGO], state.heading_rad[:, EGO]), axis=-1)
