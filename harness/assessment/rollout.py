"""Assessment of one arm: its seeded games, one after the other, as records and traces.

SUMO is reloaded for each game with a seed that depends on the episode only: episode k has the same initial state in
every arm of every training seed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import repeat
from types import MappingProxyType
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa

from harness.drivers.mixture import Mixture, factors_of, shares_of
from harness.drivers.shield import ShieldedDriver
from harness.environments.arena import Arena, Step
from harness.environments.recorded import recorded_game
from harness.environments.seats import seats_of
from harness.errors import is_of_disk
from harness.evaluation.measured_game import measured
from harness.evaluation.recorded_game import RecordedGame
from harness.evaluation.trace_file import SCHEMA, SHIELDED_SCHEMA
from harness.game.arrays import BoolArray, FloatArray
from harness.game.initial_state import InitialState, StartDistribution, draw_initial_state
from harness.game.outcome import Outcome
from harness.game.roles import EGO
from harness.game.seeding import generator_of, parts_of
from harness.road.scene.open_scene import OpenScene


@dataclass(frozen=True, kw_only=True)
class SeatedArm:
    """A pairing to assess. Each player has one of the drivers of its mixture per game; None: it does not take part.

    Several people without an ego drive one at a time: in episode k, person k modulo their number (`present_in`).
    """

    name: str
    scene: OpenScene
    drivers: tuple[Mixture | None, ...]
    """[P], ego first."""
    seed: int
    """The seed of the starts, `Campaign.start_seed`: not that of the trainings of the drivers."""

    @property
    def trace_schema(self) -> pa.Schema:
        """The columns of the traces of its games."""
        return SHIELDED_SCHEMA if any(map(_shield_of, self.drivers)) else SCHEMA

    def present_in(self, episode: int) -> list[bool]:
        """[P] which players take part in an episode."""
        present = [driver is not None for driver in self.drivers]
        if present[EGO] or sum(present) < 2:
            return present
        people = [player for player, there in enumerate(present) if there]
        return [player == people[episode % len(people)] for player in range(len(present))]


@dataclass(frozen=True, kw_only=True)
class Game:
    """A played game: its log."""

    played: Mapping[str, Any]
    """Cells of the table `played`: outcomes, and the error of a game that could not be played."""
    trace: Mapping[str, Sequence[Any]] | None
    """Columns; None if it could not be played."""
    scene: OpenScene

    @cached_property
    def recorded(self) -> RecordedGame | None:
        """The game as its trace tells it."""
        return recorded_game(pd.DataFrame(self.trace), self.scene) if self.trace is not None else None

    def payoff_of(self, player: int) -> float:
        """The payoff of a player, equation 1 of the paper; NaN if the game could not be played."""
        return float(self.recorded.payoff[:, player].sum()) if self.recorded is not None else math.nan

    @cached_property
    def record(self) -> dict[str, Any]:
        """The cells of its row of episodes.csv, computed from the trace."""
        return {**self.played, **(measured(self.recorded) if self.recorded is not None else {})}


def assess(
    arm: SeatedArm,
    episodes: int | Iterable[int],
    on_start: Callable[[int], None] = lambda episode: None,
    abandoned: Mapping[int, str] = MappingProxyType({}),
    start_from: Callable[[InitialState], InitialState] = lambda drawn: drawn,
) -> Iterator[Game]:
    """Play episodes: numbers 0 to `episodes` - 1, or the given numbers. A game that can't be played, or that has
    impossible numbers, is a record with outcome `error`.

    `on_start` gets each episode number before that game is played. Episodes in `abandoned` are not played; their record
    has the reason as its error. `start_from` may change the start that is drawn for a game.
    Raises SimulationError if SUMO can't load the scene, MemoryError, and OSError if the disk takes no more.
    """
    factors, shares = [factors_of(each) for each in arm.drivers], [shares_of(each) for each in arm.drivers]
    start_distribution = arm.scene.start_distribution(factors, [1.0] * len(factors), shares)
    arena = Arena(arm.scene, 1, [seats_of(each, paid=True) for each in arm.drivers], recorded=True)
    try:
        for episode in range(episodes) if isinstance(episodes, int) else episodes:
            if episode in abandoned:
                yield _failed(arm, episode, abandoned[episode])
                continue
            on_start(episode)
            try:
                yield _play(arena, arm, start_distribution, episode, start_from)
            except Exception as error:  # a driver may raise any exception: the other games are played
                if isinstance(error, MemoryError) or is_of_disk(error):
                    raise
                yield _failed(arm, episode, f"{type(error).__name__}: {error}")
    finally:
        arena.close()


def _play(
    arena: Arena,
    arm: SeatedArm,
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
    while arena.state.running.any():
        present = arena.state.present[0].copy()
        trace.add_players(present, arena.step())
        trace.add_others()
    played = _played(arm, episode, [Outcome(outcome) for outcome in arena.state.outcome[0].tolist()], "")
    return Game(played=played, trace=trace.columns, scene=arm.scene)


def _failed(arm: SeatedArm, episode: int, error: str) -> Game:
    played = _played(arm, episode, [Outcome.ERROR] * len(arm.drivers), error)
    return Game(played=played, trace=None, scene=arm.scene)


def _played(arm: SeatedArm, episode: int, outcomes: Sequence[Outcome], error: str) -> dict[str, Any]:
    named = zip(arm.scene.world.roles, outcomes, arm.present_in(episode), strict=True)
    words = {f"{role}_outcome": outcome.word if there else "" for role, outcome, there in named}
    return {"episode": episode, **words, "error": error}


def start_at(
    scene: OpenScene, drawn: InitialState, position_m: Sequence[float], speed_mps: Sequence[float]
) -> InitialState:
    """A drawn start with other positions (of the front bumpers, along the players' lines) and speeds [P]."""
    lengths_m = scene.world.length_m
    poses = [
        place.pose(position, length)
        for place, position, length in zip(scene.places, position_m, lengths_m.tolist(), strict=True)
    ]
    x_m, y_m, heading_rad = np.array(poses).T
    positions = np.array(position_m, dtype=float)
    return replace(
        drawn,
        x_m=x_m,
        y_m=y_m,
        heading_rad=heading_rad,
        speed_mps=np.array(speed_mps, dtype=float),
        position_m=positions,
        station_m=positions - 0.5 * lengths_m,
    )


class StartTrials:
    """Plays one episode of an arm as often as asked, each time from another start. SUMO runs in the `with` block."""

    def __init__(self, arm: SeatedArm, episode: int) -> None:
        self._arm = arm
        self._next: FloatArray | None = None
        self.last_start: FloatArray = np.empty(0)
        """[2 P] the start of the game that was played last."""
        self._games: Iterator[Game] = assess(arm, repeat(episode), start_from=self._start)

    def play(self, start: FloatArray | None) -> Game:
        """Play the episode from a start [2 P]: the players' positions, then their speeds; None: from the one that is
        drawn for it. Raises SimulationError if SUMO can't load the scene."""
        self._next = start
        return next(self._games)

    def __enter__(self) -> StartTrials:
        return self

    def __exit__(self, *error: object) -> None:
        self._games.close()  # type: ignore[attr-defined]

    def _start(self, drawn: InitialState) -> InitialState:
        start = drawn
        if self._next is not None:
            position_m, speed_mps = np.split(self._next, 2)
            start = start_at(self._arm.scene, drawn, position_m.tolist(), speed_mps.tolist())
        self.last_start = np.concatenate((start.position_m, start.speed_mps))
        return start


def _shield_of(player: Mixture | None) -> ShieldedDriver | None:
    """The shield of a player, which then has one driver; None without one."""
    driver = player.members[0].driver if player is not None else None
    return driver if isinstance(driver, ShieldedDriver) else None


class _Trace:
    """The trace of one game, as columns."""

    def __init__(self, arm: SeatedArm, arena: Arena, episode: int) -> None:
        self._arm, self._arena, self._episode = arm, arena, episode
        self.columns: dict[str, list[Any]] = {name: [] for name in arm.trace_schema.names}
        self._shields = [_shield_of(driver) for driver in arm.drivers]
        self._steers = [driver is not None and driver.takes_over for driver in arm.drivers]

    def add_players(self, present: BoolArray, step: Step | None = None) -> None:
        """A row for each player in `present` [P], with its outcome so far."""
        state = step.quantities.state if step is not None else self._arena.state
        for player in np.flatnonzero(present).tolist():
            self._add(
                player=self._arm.scene.world.roles[player],
                vehicle_type=self._arm.scene.vehicle(player).vehicle_type,
                **{name: float(getattr(state, name)[0, player]) for name in _MOTION},
                lapsed=bool(state.lapsed[0, player]),
                steers=self._steers[player],
                payoff=float(step.payoff[0, player]) if step is not None else 0.0,
                outcome=Outcome(int(state.outcome[0, player])).word,
                shielded=self._is_shielded(player, step),
            )

    def _is_shielded(self, player: int, step: Step | None) -> bool:
        """Whether a player's shield changed its decision in a step."""
        shield = self._shields[player]
        return shield is not None and step is not None and bool(step.drove[0, player] and shield.intervenes[0])

    def add_others(self) -> None:
        """A row for each vehicle of the background traffic, and for each obstacle."""
        reading = self._arena.reading
        for slot in np.flatnonzero(reading.present[0]).tolist() if reading is not None else ():
            assert reading is not None
            pose = {name: float(getattr(reading, name)[0, slot]) for name in _MOTION[:4]}
            self._add(player=reading.names[0, slot], vehicle_type=reading.types[0, slot], **pose)
        for pose, obstacle in zip(self._arena.nearby.poses[0].tolist(), self._arm.scene.obstacles.each, strict=True):
            place = dict(zip(_MOTION[:3], pose, strict=True))
            self._add(player=obstacle.name, vehicle_type=obstacle.vehicle_type, **place)

    def _add(self, **cells: Any) -> None:
        state = self._arena.state
        step = int(state.step[0])
        row = {**_NEITHER, **cells, "episode": self._episode, "step": step}
        row |= {"time_s": step * self._arm.scene.world.step_s, "signals": self._arena.signal_texts[0]}
        row |= {"friction": float(state.friction[0]), "limit_share": float(state.limit_share[0])}
        row["signal_s"] = " ".join(map(repr, state.signal_s[0].tolist())) if step == 0 else ""
        for name, column in self.columns.items():
            column.append(row[name])


_MOTION = ("x_m", "y_m", "heading_rad", "speed_mps", "acceleration_mps2", "steering_rad", "station_m")
_NEITHER: dict[str, Any] = dict.fromkeys((*_MOTION, "payoff"), 0.0)
_NEITHER |= {"lapsed": False, "steers": False, "outcome": "", "shielded": False}
"""Cells of a road user that is no player."""
