"""The traces of an arena's games, written down step by step and put together when a game has ended."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from harness.assessment.seated_arm import SeatedArm
from harness.environments.arena import Arena, Step
from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.outcome import Outcome
from harness.game.roles import EGO
from harness.game.state import State
from harness.sumo.simulation import Reading

_POSE = ("x_m", "y_m", "heading_rad")
_BACKGROUND = (*_POSE, "speed_mps")
_MOTION = (*_BACKGROUND, "acceleration_mps2", "steering_rad", "station_m")
_WORDS = np.array([each.word for each in sorted(Outcome)], dtype=object)
_NO_BACKGROUND = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True, kw_only=True)
class _Frame:
    """All games after a step, or after a reset. No array in it changes before a game of it is reset."""

    state: State
    """Of the players, before one is removed."""
    present: BoolArray
    """[G, P] which players were there before the step."""
    payoff: FloatArray
    """[G, P]"""
    shielded: BoolArray
    """[G, P] whether a player's shield changed its decision in the step."""
    perceived: dict[str, list[str]]
    """[G] what the ego lost and which ghosts it sees, by column; empty without perception errors."""
    reading: Reading | None
    signal_texts: tuple[str, ...]


class GameTraces:
    """Writes down the games of an arena, which may be reset one after the other."""

    def __init__(self, arm: SeatedArm, arena: Arena) -> None:
        scene, steers = arm.scene, [driver is not None and driver.takes_over for driver in arm.drivers]
        self._scene, self._arena = scene, arena
        self._roles = np.array(scene.world.roles, dtype=object)
        self._types = np.array([scene.vehicle(player).vehicle_type for player in range(len(steers))], dtype=object)
        self._steers, self._shields = np.array(steers, dtype=bool), arm.shields
        self._names = arm.trace_schema.names
        self._frames: dict[int, list[_Frame]] = {}

    def begin(self, games: Sequence[int]) -> None:
        """Games that have been reset begin."""
        state = self._arena.state
        nothing = np.zeros(state.present.shape)
        frame = self._frame(state, state.present, nothing, nothing.astype(bool))
        self._frames |= {game: [frame] for game in games}

    def add(self, present: BoolArray, step: Step) -> None:
        """Add a step to the games that have begun; `present` [G, P] are the players before it."""
        frame = self._frame(step.quantities.state, present, step.payoff, self._shielded(step))
        for frames in self._frames.values():
            frames.append(frame)

    def end(self, game: int, episode: int) -> dict[str, list[Any]]:
        """End a game, before it is reset: its trace, as columns of the arm's `trace_schema`."""
        frames = self._frames.pop(game)
        of_player, players = self._players(game, frames)
        of_other, others = self._others(game, frames)
        of_obstacle, obstacles = self._obstacles(game, len(frames))
        steps = np.concatenate((of_player, of_other, of_obstacle))
        order = np.argsort(steps, kind="stable")
        steps = steps[order]
        signals = np.array([frame.signal_texts[game] for frame in frames], dtype=object)
        signal_s = np.full(len(frames), "", dtype=object)
        signal_s[0] = " ".join(map(repr, frames[0].state.signal_s[game].tolist()))
        state = self._arena.state
        of_all: dict[str, NDArray] = {
            "episode": np.full(len(steps), episode),
            "step": steps,
            "time_s": steps * self._scene.world.step_s,
            "signals": signals[steps],
            "signal_s": signal_s[steps],
            "friction": np.full(len(steps), state.friction[game]),
            "limit_share": np.full(len(steps), state.limit_share[game]),
        }
        rows = (len(of_player), len(of_other), len(of_obstacle))
        for name in set(self._names) - of_all.keys():
            parts = (players[name], *(each.get(name) for each in (others, obstacles)))
            filled = [
                _blank(players[name], count) if part is None else part for part, count in zip(parts, rows, strict=True)
            ]
            of_all[name] = np.concatenate(filled)[order]
        return {name: of_all[name].tolist() for name in self._names}

    def _shielded(self, step: Step) -> BoolArray:
        """[G, P] whether a player's shield changed its decision in a step."""
        changed = np.zeros(step.drove.shape, dtype=bool)
        for player, shield in enumerate(self._shields):
            if shield is not None:
                changed[: len(shield.intervenes), player] = shield.intervenes
        return changed & step.drove

    def _frame(self, state: State, present: BoolArray, payoff: FloatArray, shielded: BoolArray) -> _Frame:
        arena = self._arena
        return _Frame(
            state=state,
            present=present.copy(),
            payoff=payoff,
            shielded=shielded,
            perceived=self._perceived(state),
            reading=arena.reading,
            signal_texts=tuple(arena.signal_texts),
        )

    def _perceived(self, state: State) -> dict[str, list[str]]:
        lists = self._arena.knowledge.object_lists
        if lists is None:
            return {}
        games = enumerate(state.step.tolist())
        shown = [(lists.lost(game), lists.ghosts(game, step)) for game, step in games]
        return {
            "ego_lost": [" ".join(lost) for lost, _ in shown],
            "ego_ghosts": ["; ".join(" ".join(map(repr, ghost)) for ghost in ghosts) for _, ghosts in shown],
        }

    def _players(self, game: int, frames: Sequence[_Frame]) -> tuple[IntArray, dict[str, NDArray]]:
        """The steps [n] of the players' rows, and their columns [n]."""
        steps, players = np.nonzero(np.array([frame.present[game] for frame in frames]))

        def rows(values: list[NDArray]) -> NDArray:
            return np.array(values)[steps, players]

        columns = {name: rows([getattr(frame.state, name)[game] for frame in frames]) for name in (*_MOTION, "lapsed")}
        for name in frames[0].perceived:
            texts = np.full((len(frames), len(self._roles)), "", dtype=object)
            texts[:, EGO] = [frame.perceived[name][game] for frame in frames]
            columns[name] = texts[steps, players]
        outcomes = rows([frame.state.outcome[game] for frame in frames])
        return steps, columns | {
            "player": self._roles[players],
            "vehicle_type": self._types[players],
            "steers": self._steers[players],
            "payoff": rows([frame.payoff[game] for frame in frames]),
            "shielded": rows([frame.shielded[game] for frame in frames]),
            "outcome": _WORDS[outcomes - min(Outcome)],
        }

    def _others(self, game: int, frames: Sequence[_Frame]) -> tuple[IntArray, dict[str, NDArray]]:
        """The steps [n] of the rows of background vehicles, and their columns [n]."""
        readings = [frame.reading for frame in frames]
        slots = [_NO_BACKGROUND if each is None else np.flatnonzero(each.present[game]) for each in readings]
        names = {"player": "names", "vehicle_type": "types"} | {name: name for name in _BACKGROUND}
        steps = np.repeat(np.arange(len(frames)), [len(each) for each in slots])
        if not len(steps):
            return steps, {}
        there = [(each, slot) for each, slot in zip(readings, slots, strict=True) if each is not None]
        return steps, {
            name: np.concatenate([getattr(each, column)[game, slot] for each, slot in there])
            for name, column in names.items()
        }

    def _obstacles(self, game: int, frames: int) -> tuple[IntArray, dict[str, NDArray]]:
        """The steps [n] of the rows of obstacles, and their columns [n]."""
        obstacles = self._scene.obstacles.each
        if not obstacles:
            return _NO_BACKGROUND, {}
        poses = dict(zip(_POSE, self._arena.nearby.poses[game].T, strict=True))
        texts = {"player": [each.name for each in obstacles], "vehicle_type": [each.vehicle_type for each in obstacles]}
        columns = poses | {name: np.array(each, dtype=object) for name, each in texts.items()}
        return np.repeat(np.arange(frames), len(obstacles)), {
            name: np.tile(column, frames) for name, column in columns.items()
        }


def _blank(column: NDArray, count: int) -> NDArray:
    """The cells [count] of road users without a value in a column."""
    return np.full(count, "" if column.dtype == object else 0, dtype=column.dtype)
