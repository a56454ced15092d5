"""The object list of the ego: the road users and obstacles that its perception gives it, with all errors.

In each step the perception makes a list: it has the objects in its range and field of view that nothing hides and that
it has not lost, at their places and speeds with errors. The ego knows the list of `latency_s` ago; of itself, the road
and the signals it knows what is. Ghosts are added to the list that it knows.

`ObjectLists.seen` turns the list into what `observe` takes. `ObjectLists.listed` is the list itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.field_of_view import Seen
from harness.game.jit import compiled
from harness.game.meetings import Meetings, no_meetings
from harness.game.memory import Perceived
from harness.game.perception_errors import (
    LOSS,
    MOST_GHOSTS,
    SPEED,
    Ghost,
    PerceptionErrors,
    X,
    Y,
    draw_ghosts,
    draw_object,
)
from harness.game.quantities import Quantities
from harness.game.roles import EGO
from harness.game.state import Bodies, sight_cosine

_ROOM = 8  # initial number of objects per game
_NO_LOSSES = ((0.0, 0.0, 1.0),)


class _Sensing(NamedTuple):
    """The parameters in steps and cosines, for compiled code."""

    range_m: float
    cosine: float
    latency_steps: int
    losses: FloatArray  # [n, 3]
    position: tuple[float, float]
    speed: tuple[float, float]
    step_s: float


class ObjectLists:
    """The object lists of the ego in G games."""

    def __init__(self, errors: PerceptionErrors, games: int, steps: int, step_s: float) -> None:
        self._errors, self._steps = errors, steps
        self._sensing = _Sensing(
            range_m=errors.range_m,
            cosine=sight_cosine(errors.field_of_view_rad),
            latency_steps=round(errors.latency_s / step_s),
            losses=np.array(errors.losses or _NO_LOSSES),
            position=(errors.position.sd, errors.position.sd_per_m),
            speed=(errors.speed.sd, errors.speed.sd_per_m),
            step_s=step_s,
        )
        kept = self._sensing.latency_steps + 1
        self._draws = np.zeros((games, _ROOM, steps, 4))
        self._lost: BoolArray = np.zeros((games, _ROOM), dtype=bool)
        self._missed: BoolArray = np.zeros((games, _ROOM), dtype=bool)  # lost, and else in the list
        self._known: BoolArray = np.zeros((games, _ROOM), dtype=bool)
        self._motion = np.zeros((kept, 4, games, _ROOM))
        self._listed: BoolArray = np.zeros((kept, games, _ROOM), dtype=bool)
        self._names = [dict[str, int]() for _ in range(games)]
        self._parts = [tuple[str | int, ...]() for _ in range(games)]
        self._drawn_ghosts = [dict[int, list[Ghost]]() for _ in range(games)]  # by the step in which they appear
        self._ghost: FloatArray = np.zeros((games, MOST_GHOSTS, 5))
        """x_m, y_m, heading_rad, speed_mps, and the step in which it goes."""

    def reset(self, game: int, parts: tuple[str | int, ...]) -> None:
        """Begin a game whose random numbers these parts name."""
        self._names[game].clear()
        self._parts[game] = parts
        self._known[game] = self._lost[game] = self._missed[game] = False
        self._listed[:, game] = False
        self._ghost[game] = 0.0
        if self._errors.ghosts is not None:
            self._drawn_ghosts[game] = draw_ghosts(self._errors.ghosts, self._steps, self._sensing.step_s, *parts)

    def advance(self, q: Quantities, names: Sequence[Sequence[str]], games: IntArray) -> None:
        """Objects of games [N] are lost and found, and ghosts appear. Once per step. `names` [N][B] are those of the
        bodies, empty where none is present."""
        numbers = self._numbers(names, games)
        ego = (q.state.x_m[:, EGO], q.state.y_m[:, EGO])
        of_game = (games, np.minimum(q.state.step, self._steps - 1))
        memory = (self._draws, self._lost, self._known)
        _lose_and_find(self._sensing, tuple(q.bodies), numbers, (ego, of_game), memory)
        if self._errors.ghosts is not None:
            self._haunt(q, games)

    def seen(self, q: Quantities, perceived: Perceived, names: Sequence[Sequence[str]], games: IntArray) -> Seen:
        """What the players of games [N] take the bodies to be: the ego by its list, the others as in `perceived`."""
        numbers, perceived, hidden = self._numbers(names, games), perceived.copy(), q.hidden.copy()
        state = q.state
        ego = (state.x_m[:, EGO], state.y_m[:, EGO], state.heading_rad[:, EGO])
        when = (games, state.step, np.minimum(state.step, self._steps - 1), state.visibility_m)
        memory = (self._draws, (self._lost, self._missed), self._motion, self._listed)
        _sense(self._sensing, tuple(q.bodies), numbers, (ego, when), memory, (perceived, hidden))
        seen = Seen(bodies=q.bodies, motion=perceived, hidden=hidden, meetings=q.meetings)
        return seen if self._errors.ghosts is None else self._with_ghosts(seen, q, games)

    def lost(self, game: int) -> list[str]:
        """The names of the objects that are not in the list of this step because they are lost."""
        return [name for name, number in self._names[game].items() if self._missed[game, number]]

    def ghosts(self, game: int, step: int) -> list[tuple[float, float, float, float]]:
        """x_m, y_m, heading_rad and speed_mps of the ghosts of a game in this step."""
        return [(x_m, y_m, heading, mps) for x_m, y_m, heading, mps, end in self._ghost[game].tolist() if end > step]

    def _numbers(self, names: Sequence[Sequence[str]], games: IntArray) -> IntArray:
        """[N, B] the numbers of bodies among the objects of their games; -1 for the ego and for no body."""
        numbers = np.full((len(names), max(map(len, names), default=0)), -1)
        for row, game in enumerate(games.tolist()):
            known = self._names[game]
            for body, name in enumerate(names[row]):
                if body != EGO and name:
                    if name not in known:
                        self._add(game, name)
                    numbers[row, body] = known[name]
        return numbers

    def _add(self, game: int, name: str) -> None:
        number = len(self._names[game])
        if number == self._lost.shape[1]:
            self._grow()
        self._names[game][name] = number
        step_s = self._sensing.step_s
        self._draws[game, number] = draw_object(self._errors, self._steps, step_s, name, *self._parts[game])

    def _grow(self) -> None:
        for name, axis in (("_draws", 1), ("_lost", 1), ("_missed", 1), ("_known", 1), ("_motion", 3), ("_listed", 2)):
            array = getattr(self, name)
            setattr(self, name, np.concatenate((array, np.zeros_like(array)), axis=axis))

    def _haunt(self, q: Quantities, games: IntArray) -> None:
        """Move the ghosts of games [N] by a step, and let those of this step appear."""
        heading_rad, moved_m = self._ghost[games, :, 2], self._sensing.step_s * self._ghost[games, :, 3]
        self._ghost[games, :, 0] += moved_m * np.cos(heading_rad)
        self._ghost[games, :, 1] += moved_m * np.sin(heading_rad)
        for row, (game, step) in enumerate(zip(games.tolist(), q.state.step.tolist(), strict=True)):
            for ghost in self._drawn_ghosts[game].get(step, ()):
                heading_rad = q.state.heading_rad[row, EGO]
                cosine, sine = np.cos(heading_rad), np.sin(heading_rad)
                x_m = q.state.x_m[row, EGO] + ghost.ahead_m * cosine - ghost.left_m * sine
                y_m = q.state.y_m[row, EGO] + ghost.ahead_m * sine + ghost.left_m * cosine
                self._ghost[game, ghost.place] = x_m, y_m, heading_rad, ghost.speed_mps, ghost.end_step

    def _with_ghosts(self, seen: Seen, q: Quantities, games: IntArray) -> Seen:
        """The same with the ghosts after the bodies, which the ego alone sees. No rule gives a ghost priority."""
        kind = self._errors.ghosts
        assert kind is not None
        ghost = self._ghost[games]
        x_m, y_m, heading_rad, speed_mps, end = np.moveaxis(ghost, -1, 0)
        there = end > q.state.step[:, None]
        sizes_m = (np.full(there.shape, kind.length_m), np.full(there.shape, kind.width_m))
        added = (x_m, y_m, heading_rad, speed_mps, *sizes_m, there)
        bodies = Bodies(*(np.concatenate(pair, axis=1) for pair in zip(seen.bodies, added, strict=True)))
        shape = (*q.state.present.shape, MOST_GHOSTS)
        motion = np.stack([np.broadcast_to(each[:, None], shape) for each in added[:4]])
        hidden = np.ones(shape, dtype=bool)
        hidden[:, EGO] = ~there
        meetings = (np.concatenate(pair, axis=2) for pair in zip(seen.meetings, no_meetings(shape), strict=True))
        return Seen(
            bodies=bodies,
            motion=np.concatenate((seen.motion, motion), axis=3),
            hidden=np.concatenate((seen.hidden, hidden), axis=2),
            meetings=Meetings._make(meetings),
        )


@compiled
def _interpolated(losses: FloatArray, distance_m: float) -> tuple[float, float]:
    """The losses per second and their mean duration (s) at a distance."""
    last = len(losses) - 1
    if distance_m <= losses[0, 0]:
        return losses[0, 1] / 60.0, losses[0, 2]
    for k in range(last):
        if distance_m < losses[k + 1, 0]:
            share = (distance_m - losses[k, 0]) / (losses[k + 1, 0] - losses[k, 0])
            per_min = losses[k, 1] + share * (losses[k + 1, 1] - losses[k, 1])
            return per_min / 60.0, losses[k, 2] + share * (losses[k + 1, 2] - losses[k, 2])
    return losses[last, 1] / 60.0, losses[last, 2]


@compiled
def _lose_and_find(
    parameters: tuple[Any, ...],
    columns: tuple[Any, ...],
    numbers: IntArray,
    where: tuple[Any, ...],
    memory: tuple[FloatArray, BoolArray, BoolArray],
) -> None:
    """Change `lost` [G, N] in place by the draws of this step. An object that is met for the first time is lost with
    the long-run share of time in which such an object is."""
    sensing, bodies = _Sensing(*parameters), Bodies(*columns)
    (ego, (games, steps)), (draws, lost, known) = where, memory
    for row in range(len(games)):
        g = games[row]
        for b in range(numbers.shape[1]):
            n = numbers[row, b]
            if n < 0 or not bodies.present[row, b]:
                continue
            distance_m = np.hypot(bodies.x_m[row, b] - ego[0][row], bodies.y_m[row, b] - ego[1][row])
            per_s, mean_s = _interpolated(sensing.losses, distance_m)
            draw = draws[g, n, steps[row], LOSS]
            if not known[g, n]:
                known[g, n] = True
                lost[g, n] = draw < per_s * mean_s / (1.0 + per_s * mean_s)
            elif lost[g, n]:
                lost[g, n] = draw >= 1.0 - np.exp(-sensing.step_s / mean_s)
            else:
                lost[g, n] = draw < 1.0 - np.exp(-sensing.step_s * per_s)


@compiled
def _sense(
    parameters: tuple[Any, ...],
    columns: tuple[Any, ...],
    numbers: IntArray,
    where: tuple[Any, ...],
    memory: tuple[FloatArray, tuple[BoolArray, BoolArray], FloatArray, BoolArray],
    result: tuple[FloatArray, BoolArray],
) -> None:
    """Write the lists of this step, and what the ego knows of each body by the list that has reached it: its motion,
    and whether it is hidden."""
    sensing, bodies, (draws, (lost, missed), motion, listed) = _Sensing(*parameters), Bodies(*columns), memory
    ((x_m, y_m, heading_rad), (games, steps, drawn, visibility_m)), (perceived, hidden) = where, result
    kept = len(listed)
    position_sd, position_sd_per_m = sensing.position
    speed_sd, speed_sd_per_m = sensing.speed
    for row in range(len(games)):
        g, now = games[row], steps[row] % kept
        then = (steps[row] - min(sensing.latency_steps, steps[row])) % kept
        listed[now, g, :] = False
        missed[g, :] = False
        for b in range(numbers.shape[1]):
            n = numbers[row, b]
            if n < 0 or not bodies.present[row, b]:
                continue
            dx, dy = bodies.x_m[row, b] - x_m[row], bodies.y_m[row, b] - y_m[row]
            distance_m, ahead_m = np.hypot(dx, dy), dx * np.cos(heading_rad[row]) + dy * np.sin(heading_rad[row])
            in_view = distance_m <= min(sensing.range_m, visibility_m[row]) and ahead_m >= sensing.cosine * distance_m
            in_view = in_view and not hidden[row, EGO, b]
            listed[now, g, n], missed[g, n] = in_view and not lost[g, n], in_view and lost[g, n]
            motion[now, 0, g, n], motion[now, 1, g, n] = bodies.x_m[row, b], bodies.y_m[row, b]
            motion[now, 2, g, n], motion[now, 3, g, n] = bodies.heading_rad[row, b], bodies.speed_mps[row, b]
            sd_m, sd_mps = position_sd + position_sd_per_m * distance_m, speed_sd + speed_sd_per_m * distance_m
            if sd_m > 0.0:
                motion[now, 0, g, n] += sd_m * draws[g, n, drawn[row], X]
                motion[now, 1, g, n] += sd_m * draws[g, n, drawn[row], Y]
            if sd_mps > 0.0:
                motion[now, 3, g, n] += sd_mps * draws[g, n, drawn[row], SPEED]
            hidden[row, EGO, b] = not listed[then, g, n]
            for k in range(4):
                perceived[k, row, EGO, b] = motion[then, k, g, n]
