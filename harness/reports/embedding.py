"""The recorded games as the page carries them: small numbers, packed, and as many as fit.

A game's columns are whole numbers of centimetres, milliradians and so on (`SCALES`), each but a column's first the
difference to the one before. Their bytes are laid out in four planes (all lowest bytes, all second ones, ...), which
are mostly zeros but for the first, deflated, and written in base64. `recorded.js` reads them.
"""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from markupsafe import Markup

from harness.reports.player_data import FloatArray, RecordedGame, SceneDrawing, Track, key

SCALES = {
    "x_m": 0.01,
    "y_m": 0.01,
    "heading_rad": 0.001,
    "speed_mps": 0.01,
    "acceleration_mps2": 0.01,
    "steering_rad": 0.001,
    "lapsed": 1.0,
    "leader_gap_m": 0.01,
    "time_to_collision_s": 0.01,
}
"""What 1 is in each column of a player; other road users have the first four."""
OF_OTHERS = 4
NOTHING = -1
"""Stands for a gap or a time that there is not."""
LONGEST = 1e5
"""Metres or seconds: more is nothing."""


class Embedded:
    """The games that fit into the page, in the order they were given."""

    def __init__(
        self,
        scene: SceneDrawing | None,
        games: Iterable[RecordedGame],
        marks: Mapping[str, Sequence[Mapping[str, Any]]],
        budget_bytes: int,
    ) -> None:
        """`games`, the ones to watch first on top, are taken until the budget is used up; `marks` are the manoeuvres
        to mark in each, by `key`."""
        self.games: list[RecordedGame] = []
        self._written: list[str] = []
        size = 0
        for game in games if scene is not None else ():
            text = _json(_game(game, marks.get(key(game.arm, game.seed, game.episode), ())))
            size += len(text)
            if size > budget_bytes:
                break
            self.games.append(game)
            self._written.append(text)
        self._scene = scene

    def __contains__(self, name: str) -> bool:
        return name in self.keys

    @property
    def keys(self) -> set[str]:
        """Of all games that are embedded."""
        return {key(game.arm, game.seed, game.episode) for game in self.games}

    def document(self) -> Markup:
        """The games and the road as JSON that is safe inside a script element."""
        scales = _json(list(SCALES.values()))
        columns = f'"scales":{scales},"ofOthers":{OF_OTHERS},"scene":{_json(_scene(self._scene))}'
        return Markup("{" + columns + ',"games":[' + ",\n".join(self._written) + "]}")


def _json(value: Any) -> str:
    """JSON in which nothing can end a script element, or be taken for anything but text."""
    text = json.dumps(value, separators=(",", ":"), ensure_ascii=True, allow_nan=False)
    return text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e")


def _scene(scene: SceneDrawing | None) -> dict[str, Any] | None:
    if scene is None:
        return None
    return {
        "surfaces": [[_points(ring) for ring in rings] for rings in scene.surfaces],
        "laneMarks": [_points(line) for line in scene.lane_marks],
        "rails": [_points(line) for line in scene.rails],
        "goal": [_points(line) for line in scene.goal],
    }


def _points(line: FloatArray) -> list[list[float]]:
    points: list[list[float]] = np.round(np.asarray(line, dtype=float), 2).tolist()
    return points


def _game(game: RecordedGame, marks: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    times = [player.time_to_collision_s for player in game.players if player.name == "ego"]
    measured = [float(values[np.isfinite(values)].min()) for values in times if np.isfinite(values).any()]
    return {
        "arm": game.arm,
        "persona": game.persona,
        "seed": game.seed,
        "episode": game.episode,
        "step": game.step_s,
        "steps": game.steps,
        "outcome": game.outcome,
        "leastTime": round(measured[0], 2) if measured else None,
        "players": [
            _track(player) | {"outcome": player.outcome, "ended": player.ended_step} for player in game.players
        ],
        "others": [_track(other) for other in game.others],
        "touches": [[round(each.time_s, 3), round(each.x_m, 2), round(each.y_m, 2)] for each in game.touches],
        "marks": list(marks),
        "packed": pack(columns_of(game)),
    }


def _track(track: Track) -> dict[str, Any]:
    size = [round(track.length_m, 3), round(track.width_m, 3)]
    return {"name": track.name, "size": size, "first": track.first_step, "count": len(track.x_m)}


def columns_of(game: RecordedGame) -> list[FloatArray]:
    """A game's columns as whole numbers, track by track."""
    names = list(SCALES)
    tracks: list[tuple[Track, Sequence[str]]] = [(player, names) for player in game.players]
    tracks += [(other, names[:OF_OTHERS]) for other in game.others]
    return [_whole(getattr(track, name), SCALES[name]) for track, columns in tracks for name in columns]


def _whole(values: Any, scale: float) -> FloatArray:
    numbers = np.asarray(values, dtype=float)
    there = np.isfinite(numbers) & (np.abs(numbers) < LONGEST)
    return np.where(there, np.rint(np.where(there, numbers, 0.0) / scale), NOTHING)


def pack(columns: Sequence[FloatArray]) -> str:
    """Columns of whole numbers as text."""
    differences = [np.diff(column, prepend=0.0) for column in columns]
    numbers = np.concatenate([np.zeros(0), *differences]).astype("<i4")
    planes = numbers.view(np.uint8).reshape(-1, 4).T
    return base64.b64encode(zlib.compress(planes.tobytes(), 9)).decode("ascii")
