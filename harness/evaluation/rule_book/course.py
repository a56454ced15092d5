"""One recorded game as the rules use it: the quantities of every step, and the relative positions of road users."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from harness.evaluation.encounters import Encounter
from harness.evaluation.recorded_game import RecordedGame
from harness.evaluation.rule_book import thresholds as at
from harness.game.arrays import BoolArray, FloatArray
from harness.game.geometry import time_to_contact
from harness.game.outcome import Outcome
from harness.game.quantities import Quantities
from harness.game.roles import EGO
from harness.game.route_coordinates import PATH_M

_HERE = int(np.flatnonzero(PATH_M == 0.0)[0])
_NEARBY_M = 10.0  # of road, behind and ahead
_LARGEST_STEP_M = 1.0  # sideways in a step; more means that another lane is now the nearest
_ROUNDING_S = 1e-9
SLACK = 1e-9
"""Of rounding: a number equal to its threshold counts."""

Stretch = tuple[int, int]  # its first and last step


@dataclass(frozen=True, kw_only=True)
class Span:
    """One manoeuvre: its first and last step, gap and time to collision (inf: none), and a description."""

    first: int
    last: int
    gap_m: float
    ttc_s: float
    text: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Course:
    """T steps of one game; arrays are [T], or [T, P] in `quantities`: its games' axis is the steps' axis."""

    game: RecordedGame

    @property
    def quantities(self) -> Quantities:
        """Of the players among all road users."""
        return self.game.quantities

    @cached_property
    def drove(self) -> BoolArray:
        """[T, P] whether each player was driving; in a game with an ego, only until the ego's game ends."""
        drove, last = self.game.drove.copy(), self.game.last_step(EGO)
        if last is not None:
            drove[last + 1 :] = False
        return drove

    def span(self, player: int, first: int, last: int, text: str) -> Span:
        """A span with the player's least trailing distance and time to collision during it."""
        gap = self.quantities.leader_gap_m[first : last + 1, player].min()
        ttc = self.quantities.time_to_collision_s[first : last + 1, player].min()
        return Span(first=first, last=last, gap_m=float(gap), ttc_s=float(ttc), text=text)

    @cached_property
    def involved(self) -> int | None:
        """The road user that the ego touches. Where it leaves the road, the player with which it was on a collision
        course last, if that was within `SINCE_S` of the end. None if there is none."""
        last = self.game.last_step(EGO)
        if last is None or self.game.outcomes[EGO] not in (Outcome.COLLISION, Outcome.RAIL):
            return None
        if self.game.outcomes[EGO] is Outcome.COLLISION:
            return self.game.nearest(last, EGO)
        for step in range(last, max(last - self.steps(at.SINCE_S), 0) - 1, -1):
            players = [body for body in range(1, self.drove.shape[1]) if self.quantities.bodies.present[step, body]]
            soonest = min(players, key=lambda body: self.ttc_s(step, body, EGO), default=None)
            if soonest is not None and self.ttc_s(step, soonest, EGO) <= at.DANGER_TTC_S:
                return soonest
        return None

    def leads_to_failure(self, step: int, body: int, of: int) -> bool:
        """Whether what a body did to the ego in a step is in time to be the cause of the ego's failure."""
        last = self.game.last_step(EGO)
        return of == EGO and body == self.involved and last is not None and last - step < self.steps(at.SINCE_S)

    @property
    def step_s(self) -> float:
        return self.quantities.world.step_s

    def steps(self, seconds: float) -> int:
        """The least number of steps that cover a time."""
        return int(np.ceil(seconds / self.step_s - _ROUNDING_S))

    def stretches(self, mask: BoolArray, least_s: float, parted: BoolArray | None = None) -> Iterator[Stretch]:
        """The stretches over which `mask` [T] holds for at least `least_s` in total. A pause of up to `SAME_WITHIN_S`
        is ignored, unless `parted` [T] holds in it."""
        joined: list[list[Stretch]] = []
        for first, last in runs(mask):
            end = joined[-1][-1][1] + 1 if joined else first
            apart = first - end > self.steps(at.SAME_WITHIN_S) or (parted is not None and parted[end:first].any())
            if apart or not joined:
                joined.append([])
            joined[-1].append((first, last))
        for parts in joined:
            if sum(last - first + 1 for first, last in parts) >= self.steps(least_s):
                yield parts[0][0], parts[-1][1]

    def encounters(self, player: int) -> list[Encounter]:
        """The player's encounters with other road users at junctions, until the end of the ego's game."""
        steps = np.flatnonzero(self.drove[:, player])
        end_s = float(steps[-1]) * self.step_s if len(steps) else -np.inf
        return [each for each in self.game.encounters[player] if each.own.enters_s <= end_s]

    @cached_property
    def _from_lane_m(self) -> FloatArray:
        """[T, P] to the left of the centre of the nearest lane."""
        return self.quantities.lateral_offset_m - self.game.lane_centre_m

    @cached_property
    def sideways_m(self) -> FloatArray:
        """[T, P] displacement to the left, relative to the direction of the lane, since the start."""
        moved = np.diff(self._from_lane_m, axis=0, prepend=self._from_lane_m[:1])
        return np.where(np.abs(moved) < _LARGEST_STEP_M, moved, 0.0).cumsum(0)

    @cached_property
    def turned_rad(self) -> FloatArray:
        """[T, P] heading to the left of the road's."""
        turned = self.quantities.state.heading_rad - self.quantities.path_heading_rad[..., _HERE]
        return (turned + np.pi) % (2.0 * np.pi) - np.pi

    def swerving_mps2(self, player: int, side: float) -> FloatArray:
        """[T] lateral acceleration to a side (1 left, -1 right), minus that of the tightest curve of the road nearby.

        Roads are polylines: their curvature is measured over lengths of 5 m and more.
        """
        near = np.flatnonzero(np.abs(PATH_M) <= _NEARBY_M)
        headings = np.unwrap(self.quantities.path_heading_rad[:, player, near], axis=-1)
        curve = (side * np.diff(headings, axis=-1) / np.diff(PATH_M[near])).max(-1)
        own = side * self.quantities.lateral_acceleration_mps2[:, player]
        return own - np.maximum(curve, 0.0) * self.quantities.speed_mps[:, player] ** 2

    def ahead_m(self, body: int, of: int) -> FloatArray:
        """[T] how far the centre of a body is ahead of that of player `of`, along the player's route."""
        return self.quantities.on_path.ahead_m[:, of, body]

    def gap_m(self, body: int, of: int) -> FloatArray:
        """[T] from the front of player `of` to the rear of a body; negative where they are side by side."""
        own = 0.5 * self.quantities.world.length_m[of]
        return self.ahead_m(body, of) - self.quantities.on_path.half_length_m[:, of, body] - own

    def in_way(self, body: int, of: int) -> BoolArray:
        """[T] whether the two overlap across the road: the body is in the path of player `of`."""
        on_path = self.quantities.on_path
        half_width = on_path.half_width_m[:, of, body] + 0.5 * self.quantities.world.width_m[of]
        return np.abs(on_path.left_m[:, of, body]) < half_width

    def angle_rad(self, step: int, body: int, of: int) -> float:
        """The angle between the headings of two, from 0 to pi."""
        turned = self.game.bodies.heading_rad[step, body] - self.game.bodies.heading_rad[step, of]
        return float(abs((turned + np.pi) % (2.0 * np.pi) - np.pi))

    def ttc_s(self, step: int, body: int, of: int) -> float:
        """Time to collision of two boxes; inf if they are on no collision course."""
        relative = self.game.velocity_mps(step, body) - self.game.velocity_mps(step, of)
        return float(time_to_contact(self.game.box(step, of), self.game.box(step, body), *relative.tolist()))

    def ttc_along_s(self, step: int, body: int, of: int) -> float:
        """Time to collision along the road of a body ahead: gap over closing speed, as UN R157 has it for cut-ins,
        where the two do not yet overlap across the road."""
        speed = self.game.bodies.speed_mps[step]
        closing = speed[of] - speed[body] * np.cos(self.angle_rad(step, body, of))
        gap = max(float(self.gap_m(body, of)[step]), 0.0)
        return float(gap / closing) if closing > 0.0 else np.inf


def runs(mask: BoolArray) -> Iterator[Stretch]:
    """The stretches over which `mask` [T] holds without interruption."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], mask.astype(np.int8), [0]))))
    for first, end in edges.reshape(-1, 2).tolist():
        yield first, end - 1


def end_of_run(mask: BoolArray, step: int) -> int:
    """The last step of the stretch of `mask` [T] that `step` is in."""
    ends = np.flatnonzero(~mask[step:])
    return step + int(ends[0]) - 1 if len(ends) else len(mask) - 1
