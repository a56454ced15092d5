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
_OF_STATE = (*_MOTION, "lapsed", "outcome")
_OF_PLAYER = (*_OF_STATE, "payoff", "shielded")
_NO_STEPS = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True, kw_only=True)
class _Others:
    """The background vehicles [N] of all games, by game."""

    bounds: IntArray
    """[G + 1] where the vehicles of each game begin, and where those of the last one end."""
    texts: NDArray
    """[2, N] their names and types."""
    motion: FloatArray
    """[4, N] the columns of `_BACKGROUND`."""


@dataclass(frozen=True, kw_only=True)
class _Frame:
    """All games after a step, or after a reset."""

    present: BoolArray
    """[G, P] which players were there before the step."""
    players: FloatArray
    """[C, G, P] the columns of `_OF_PLAYER`, before a player is removed."""
    perceived: dict[str, list[str]]
    """[G] what the ego lost and which ghosts it sees, by column; empty without perception errors."""
    others: _Others | None
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
        self._signal_s: dict[int, list[float]] = {}

    def begin(self, games: Sequence[int]) -> None:
        """Games that have been reset begin."""
        state = self._arena.state
        nothing = np.zeros(state.present.shape)
        frame = self._frame(state, state.present, nothing, nothing.astype(bool))
        self._frames |= {game: [frame] for game in games}
        self._signal_s |= {game: state.signal_s[game].tolist() for game in games}

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
        signal_s[0] = " ".join(map(repr, self._signal_s.pop(game)))
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
            present=present.copy(),
            players=np.array([*(getattr(state, name) for name in _OF_STATE), payoff, shielded], dtype=np.float64),
            perceived=self._perceived(state),
            others=_others(arena.reading) if arena.reading is not None else None,
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
        values = np.array([frame.players[:, game] for frame in frames])[steps, :, players]
        columns: dict[str, NDArray] = dict(zip(_OF_PLAYER, values.T, strict=True))
        for name in frames[0].perceived:
            texts = np.full((len(frames), len(self._roles)), "", dtype=object)
            texts[:, EGO] = [frame.perceived[name][game] for frame in frames]
            columns[name] = texts[steps, players]
        return steps, columns | {
            "player": self._roles[players],
            "vehicle_type": self._types[players],
            "steers": self._steers[players],
            "lapsed": columns["lapsed"].astype(bool),
            "shielded": columns["shielded"].astype(bool),
            "outcome": _WORDS[columns["outcome"].astype(np.int64) - min(Outcome)],
        }

    def _others(self, game: int, frames: Sequence[_Frame]) -> tuple[IntArray, dict[str, NDArray]]:
        """The steps [n] of the rows of background vehicles, and their columns [n]."""
        there = [
            (step, each, slice(each.bounds[game], each.bounds[game + 1]))
            for step, frame in enumerate(frames)
            if (each := frame.others) is not None and each.bounds[game] < each.bounds[game + 1]
        ]
        if not there:
            return _NO_STEPS, {}
        steps = np.repeat([step for step, _, _ in there], [rows.stop - rows.start for _, _, rows in there])
        texts = np.concatenate([each.texts[:, rows] for _, each, rows in there], axis=1)
        motion = np.concatenate([each.motion[:, rows] for _, each, rows in there], axis=1)
        return steps, dict(zip(("player", "vehicle_type", *_BACKGROUND), (*texts, *motion), strict=True))

    def _obstacles(self, game: int, frames: int) -> tuple[IntArray, dict[str, NDArray]]:
        """The steps [n] of the rows of obstacles, and their columns [n]."""
        obstacles = self._scene.obstacles.each
        if not obstacles:
            return _NO_STEPS, {}
        poses = dict(zip(_POSE, self._arena.nearby.poses[game].T, strict=True))
        texts = {"player": [each.name for each in obstacles], "vehicle_type": [each.vehicle_type for each in obstacles]}
        columns = poses | {name: np.array(each, dtype=object) for name, each in texts.items()}
        return np.repeat(np.arange(frames), len(obstacles)), {
            name: np.tile(column, frames) for name, column in columns.items()
        }


def _others(reading: Reading) -> _Others:
    """The background vehicles of a reading."""
    games, slots = np.nonzero(reading.present)
    return _Others(
        bounds=np.searchsorted(games, np.arange(len(reading.present) + 1)),
        texts=np.array([reading.names[games, slots], reading.types[games, slots]], dtype=object),
        motion=np.array([getattr(reading, name)[games, slots] for name in _BACKGROUND]),
    )


def _blank(column: NDArray, count: int) -> NDArray:
    """The cells [count] of road users without a value in a column."""
    return np.full(count, "" if column.dtype == object else 0, dtype=column.dtype)
