"""Assessment of one arm: its seeded games, one after the other, as records and traces.

SUMO is reloaded for each game with a seed that depends on the episode only: episode k has the same initial state in
every arm.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np
import pandas as pd

from harness.drivers.mixture import Mixture, factors_of, shares_of
from harness.environments.arena import Arena, Step
from harness.environments.seats import seats_of
from harness.evaluation.encounters import Encounter, encounters_of
from harness.evaluation.metrics import OF_EGO, PlayerSeries
from harness.evaluation.people import COLLIDED_WITH, of_person
from harness.evaluation.trace_quantities import drove_in, quantities_of, sizes_by_name
from harness.game.arrays import BoolArray, FloatArray
from harness.game.geometry import Box, box_distance
from harness.game.initial_state import InitialState, StartDistribution, draw_initial_state
from harness.game.outcome import Outcome
from harness.game.roles import EGO, ROLES
from harness.game.seeding import generator_of
from harness.traffic.scene import OpenScene


@dataclass(frozen=True, kw_only=True)
class Arm:
    """A pairing to assess. Each player has one of the drivers of its mixture per game; None: it does not take part.

    Several people without an ego drive one at a time: in episode k, person k modulo their number (`present_in`).
    """

    name: str
    scene: OpenScene
    drivers: tuple[Mixture | None, ...]
    """[P], ego first."""
    seed: int

    def present_in(self, episode: int) -> list[bool]:
        """[P] which players take part in an episode."""
        present = [driver is not None for driver in self.drivers]
        if present[EGO] or sum(present) < 2:
            return present
        people = [player for player, there in enumerate(present) if there]
        return [player == people[episode % len(people)] for player in range(len(present))]


@dataclass(frozen=True, kw_only=True)
class Game:
    """A played game: the cells of its record, and its trace as columns (None if it could not be played)."""

    record: dict[str, Any]
    trace: Mapping[str, Sequence[Any]] | None


def assess(
    arm: Arm,
    episodes: int | Iterable[int],
    on_start: Callable[[int], None] = lambda episode: None,
    abandoned: Mapping[int, str] = MappingProxyType({}),
    start_from: Callable[[InitialState], InitialState] = lambda drawn: drawn,
) -> Iterator[Game]:
    """Play episodes: numbers 0 to `episodes` - 1, or the given numbers. A game that can't be played, or that has
    impossible numbers, is a record with outcome `error`.

    `on_start` gets each episode number before that game is played. Episodes in `abandoned` are not played; their record
    has the reason as its error. `start_from` may change the start that is drawn for a game.
    Raises SimulationError if SUMO can't load the scene.
    """
    factors, shares = [factors_of(each) for each in arm.drivers], [shares_of(each) for each in arm.drivers]
    start_distribution = arm.scene.start_distribution(factors, [1.0] * len(factors), shares)
    arena = Arena(arm.scene, 1, [seats_of(each, paid=True) for each in arm.drivers], recorded=True)
    try:
        for episode in range(episodes) if isinstance(episodes, int) else episodes:
            if episode in abandoned:
                yield Game(record=_failed(arm, episode, abandoned[episode]), trace=None)
                continue
            on_start(episode)
            try:
                yield _play(arena, arm, start_distribution, episode, start_from)
            except MemoryError:
                raise
            except Exception as error:  # a driver may raise any exception: the other games are played
                yield Game(record=_failed(arm, episode, f"{type(error).__name__}: {error}"), trace=None)
    finally:
        arena.close()


def parts_of(seed: int, episode: int) -> tuple[str | int, ...]:
    """The parts that name the random numbers of an episode, the same in every arm."""
    return ("assessment", seed, "episode", episode)


def _play(
    arena: Arena,
    arm: Arm,
    start_distribution: StartDistribution,
    episode: int,
    start_from: Callable[[InitialState], InitialState],
) -> Game:
    parts = parts_of(arm.seed, episode)
    present = [float(each) for each in arm.present_in(episode)]
    start = start_from(draw_initial_state(replace(start_distribution, present_share=present), *parts))
    arena.reload(start.seed)
    arena.reset({0: start}, {0: arm.scene.departures(generator_of(*parts, "others"))})
    trace = _Trace(arm, arena, episode)
    trace.add_players(arena.state.present[0])
    trace.add_others()
    steps: list[Step] = []
    while arena.state.running.any():
        present = arena.state.present[0].copy()
        step = arena.step()
        steps.append(step)
        trace.add_players(present, step)
        trace.add_others()
    encounters = _encounters(arm, trace.columns)
    return Game(record=_record(arm, arena, episode, steps, encounters), trace=trace.columns)


def _encounters(arm: Arm, trace: Mapping[str, Sequence[Any]]) -> tuple[tuple[Encounter, ...], ...]:
    """The encounters at junctions of each player in one game."""
    world = arm.scene.world
    if not len(world.right_of_way.conflicts.player):
        return ((),) * len(arm.drivers)
    frame = pd.DataFrame(trace)
    types_m = {name: (kind.length_m, kind.width_m) for name, kind in arm.scene.routes.types.items()}
    quantities, drove = quantities_of(frame, world, sizes_by_name(frame, types_m)), drove_in(frame, world.roles)
    return tuple(tuple(encounters_of(quantities, player, drove[:, player])) for player in range(len(arm.drivers)))


def _record(
    arm: Arm, arena: Arena, episode: int, steps: Sequence[Step], encounters: Sequence[tuple[Encounter, ...]]
) -> dict[str, Any]:
    outcomes = [Outcome(int(outcome)) for outcome in arena.state.outcome[0]]
    record: dict[str, Any] = {"episode": episode, "duration_s": len(steps) * arm.scene.world.step_s, "error": ""}
    present = arm.present_in(episode)
    for player, role in enumerate(arm.scene.world.roles):
        record[f"{role}_outcome"] = outcomes[player].word if present[player] else ""
        series = _series_of(arm, steps, player, outcomes[player], encounters[player]) if present[player] else None
        for name, metric in (OF_EGO if player == EGO else of_person(role)).items():
            record[name] = metric(series) if series is not None else None
    record["ego_failed"] = int(outcomes[EGO] is not Outcome.GOAL) if present[EGO] else None
    if len(present) > len(ROLES):
        record[COLLIDED_WITH] = _collided_with(arm, steps) if outcomes[EGO] is Outcome.COLLISION else ""
    return record


def _collided_with(arm: Arm, steps: Sequence[Step]) -> str:
    """The name of what the ego collided with: a person's, an obstacle's, or `background`."""
    quantities = next(step.quantities for step in reversed(steps) if step.drove[0, EGO])
    bodies, roles = quantities.bodies, quantities.world.roles
    boxes = [
        Box(*(float(getattr(bodies, name)[0, body]) for name in Box._fields)) for body in range(bodies.x_m.shape[1])
    ]
    others = [body for body in np.flatnonzero(bodies.present[0]).tolist() if body != EGO]
    nearest = min(others, key=lambda body: box_distance(boxes[EGO], boxes[body]))
    obstacles = [each.name for each in arm.scene.obstacles.each]
    names = [*roles, *["background"] * (len(boxes) - len(roles) - len(obstacles)), *obstacles]
    return names[nearest]


def _series_of(
    arm: Arm, steps: Sequence[Step], player: int, outcome: Outcome, encounters: tuple[Encounter, ...]
) -> PlayerSeries:
    driver = arm.drivers[player]
    steers = driver is not None and driver.takes_over  # SUMO's cars change lanes without a steering angle
    drove = [step for step in steps if step.drove[0, player]]
    not_measured = np.full((1, len(arm.drivers)), np.nan)

    def series(value: Callable[[Step], FloatArray]) -> FloatArray:
        return np.array([value(step)[0, player] for step in drove], dtype=float)

    return PlayerSeries(
        outcome=outcome,
        step_s=arm.scene.world.step_s,
        speed_mps=series(lambda step: step.quantities.state.speed_mps),
        acceleration_mps2=series(lambda step: step.quantities.state.acceleration_mps2),
        lateral_acceleration_mps2=series(
            lambda step: step.quantities.lateral_acceleration_mps2 if steers else not_measured
        ),
        leader_gap_m=series(lambda step: step.quantities.leader_gap_m),
        time_to_collision_s=series(lambda step: step.quantities.time_to_collision_s),
        payoff=series(lambda step: step.payoff),
        passed_red_s=series(lambda step: step.quantities.passed_red_s),
        wrong_way=series(lambda step: step.quantities.wrong_way),
        encounters=encounters,
    )


def _failed(arm: Arm, episode: int, error: str) -> dict[str, Any]:
    present = zip(arm.scene.world.roles, arm.present_in(episode), strict=True)
    outcomes = {f"{role}_outcome": Outcome.ERROR.word if there else "" for role, there in present}
    return {"episode": episode, **outcomes, "error": error}


class _Trace:
    """The trace of one game, as columns."""

    def __init__(self, arm: Arm, arena: Arena, episode: int) -> None:
        self._arm, self._arena, self._episode = arm, arena, episode
        self.columns: dict[str, list[Any]] = {name: [] for name in TRACE_COLUMNS}

    def add_players(self, present: BoolArray, step: Step | None = None) -> None:
        """A row for each player in `present` [P], with its outcome so far."""
        state = step.quantities.state if step is not None else self._arena.state
        for player in np.flatnonzero(present):
            self._add(
                self._arm.scene.world.roles[player],
                self._arm.scene.vehicle(int(player)).vehicle_type,
                *(float(getattr(state, name)[0, player]) for name in _MOTION),
                bool(state.lapsed[0, player]),
                Outcome(int(state.outcome[0, player])).word,
            )

    def add_others(self) -> None:
        """A row for each vehicle of the background traffic, and for each obstacle."""
        self._add_background()
        for pose, obstacle in zip(self._arena.nearby.poses[0].tolist(), self._arm.scene.obstacles.each, strict=True):
            self._add(obstacle.name, obstacle.vehicle_type, *pose, 0.0, 0.0, 0.0, False, "")

    def _add_background(self) -> None:
        reading = self._arena.reading
        if reading is None:
            return
        for slot in np.flatnonzero(reading.present[0]).tolist():
            pose = (float(getattr(reading, each)[0, slot]) for each in ("x_m", "y_m", "heading_rad", "speed_mps"))
            self._add(reading.names[0, slot], reading.types[0, slot], *pose, 0.0, 0.0, False, "")

    def _add(self, *cells: Any) -> None:
        step = int(self._arena.state.step[0])
        row = (self._episode, step, step * self._arm.scene.world.step_s, *cells, self._arena.signal_texts[0])
        for name, cell in zip(TRACE_COLUMNS, row, strict=True):
            self.columns[name].append(cell)


_MOTION = ("x_m", "y_m", "heading_rad", "speed_mps", "acceleration_mps2", "steering_rad")
TRACE_COLUMNS = ("episode", "step", "time_s", "player", "vehicle_type", *_MOTION, "lapsed", "outcome", "signals")
