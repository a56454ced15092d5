"""The recorded games in the page: small numbers, packed, as many games as fit.

A game's columns are whole numbers of centimetres, milliradians and so on (`COLUMNS`). Of smooth columns the second
differences are written, of the others the first, as variable-length integers (zigzag, 7 bits a byte, low bits first),
deflated, in base64. `recorded.js` reads them.
"""

from __future__ import annotations

import base64
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from harness.game.roles import NON_EGO, roles_of
from harness.reports.page_template import json_text
from harness.reports.player_data import FloatArray, GameTracks, SceneDrawing, Track, key

IntArray = NDArray[np.int64]


class PackedColumn(NamedTuple):
    """How a column of a track is packed."""

    unit: float
    """Values are rounded to multiples of it."""
    differences: int
    """1: of neighbours, 2: of their differences."""


COLUMNS = {
    "x_m": PackedColumn(0.02, 2),
    "y_m": PackedColumn(0.02, 2),
    "heading_rad": PackedColumn(0.002, 2),
    "speed_mps": PackedColumn(0.02, 1),
    "acceleration_mps2": PackedColumn(0.05, 1),
    "steering_rad": PackedColumn(0.002, 1),
    "lapsed": PackedColumn(1.0, 1),
    "leader_gap_m": PackedColumn(0.1, 1),
    "time_to_collision_s": PackedColumn(0.1, 1),
}
"""The columns of a player; background vehicles have the first `BACKGROUND_COLUMNS` of them."""
BACKGROUND_COLUMNS = 4
NOTHING = -1
"""Stands for a missing gap or time."""
LONGEST = 1e5
"""Metres or seconds; a longer gap or time counts as missing."""


class Embedded:
    """The games that fit into the page, in the order of the input."""

    def __init__(
        self,
        scene: SceneDrawing | None,
        games: Iterable[GameTracks],
        marks: Mapping[str, Sequence[Mapping[str, Any]]],
        budget_bytes: int,
        *,
        crowds: Mapping[str, Sequence[str]] = MappingProxyType({}),
    ) -> None:
        """`games`, those to watch first at the front, are embedded until the budget is used up; `marks` are the
        manoeuvres to mark in each, by `key`; `crowds` are the personas of each crowd, in the order of its people."""
        self.games: list[GameTracks] = []
        self._texts: list[str] = []
        size = 0
        for game in games if scene is not None else ():
            text = game_text(game, marks, crowds)
            size += len(text)
            if size > budget_bytes:
                break
            self.games.append(game)
            self._texts.append(text)
        self._scene = scene

    def __contains__(self, name: str) -> bool:
        return name in self.keys

    @property
    def keys(self) -> set[str]:
        """The keys of all embedded games."""
        return {key(game.arm, game.seed, game.episode) for game in self.games}

    def document(self) -> Markup:
        """The games and the road as JSON that is safe inside a script element."""
        columns = json_text(list(COLUMNS.values()))
        head = f'"columns":{columns},"backgroundColumns":{BACKGROUND_COLUMNS},"scene":{json_text(_scene(self._scene))}'
        return Markup("{" + head + ',"games":[' + ",\n".join(self._texts) + "]}")


def game_text(
    game: GameTracks,
    marks: Mapping[str, Sequence[Mapping[str, Any]]],
    crowds: Mapping[str, Sequence[str]] = MappingProxyType({}),
) -> str:
    """One game as JSON, with its manoeuvres out of `marks` and the personas of its crowd, if it has one."""
    return json_text(_game(game, marks.get(key(game.arm, game.seed, game.episode), ()), crowds.get(game.persona, ())))


def _scene(scene: SceneDrawing | None) -> dict[str, Any] | None:
    if scene is None:
        return None
    return {
        "surfaces": [[_points(ring) for ring in rings] for rings in scene.surfaces],
        "laneMarks": [_points(line) for line in scene.lane_marks],
        "edgeLines": [_points(line) for line in scene.edge_lines],
        "rails": [_points(line) for line in scene.rails],
        "goal": [_points(line) for line in scene.goal],
        **{
            name: [_points(outline) for outline in outlines]
            for name, outlines in (("buildings", scene.buildings), ("stripes", scene.stripes))
            if outlines
        },
        "hidingObstacles": list(scene.hiding_obstacles),
        "tallWidth": scene.tall_width_m,
    }


def _points(line: FloatArray) -> list[list[float]]:
    points: list[list[float]] = np.round(np.asarray(line, dtype=float), 2).tolist()
    return points


def _game(game: GameTracks, marks: Sequence[Mapping[str, Any]], crowd: Sequence[str] = ()) -> dict[str, Any]:
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
            _track(player) | {"outcome": player.outcome, "ended": player.ended_step} | _persona(player, crowd)
            for player in game.players
        ],
        "background": [_track(vehicle) for vehicle in game.background],
        "touches": [[round(each.time_s, 3), round(each.x_m, 2), round(each.y_m, 2)] for each in game.touches],
        "marks": list(marks),
        "packed": pack(columns_of(game)),
    }


def _track(track: Track) -> dict[str, Any]:
    size = [round(track.length_m, 3), round(track.width_m, 3)]
    return {"name": track.name, "size": size, "first": track.first_step, "count": len(track.x_m)}


def _persona(player: Track, crowd: Sequence[str]) -> dict[str, str]:
    """The persona of one of the people of a crowd; empty for the ego and without a crowd."""
    people = roles_of(1 + len(crowd))[NON_EGO:] if crowd else ()
    return {"persona": crowd[people.index(player.name)]} if player.name in people else {}


def columns_of(game: GameTracks) -> Iterator[tuple[IntArray, int]]:
    """A game's columns as whole numbers, track by track, each with the number of its differences."""
    names = list(COLUMNS)
    tracks: list[tuple[Track, Sequence[str]]] = [(player, names) for player in game.players]
    tracks += [(vehicle, names[:BACKGROUND_COLUMNS]) for vehicle in game.background]
    for track, columns in tracks:
        for name in columns:
            unit, differences = COLUMNS[name]
            yield _whole(getattr(track, name), unit), differences


def _whole(values: Any, unit: float) -> IntArray:
    numbers = np.asarray(values, dtype=float)
    present = np.isfinite(numbers) & (np.abs(numbers) < LONGEST)
    return np.where(present, np.rint(np.where(present, numbers, 0.0) / unit), NOTHING).astype(np.int64)


def pack(columns: Iterable[tuple[IntArray, int]]) -> str:
    """Columns of whole numbers, each with the number of its differences, as text."""
    numbers: list[IntArray] = [np.zeros(0, np.int64)]
    for column, differences in columns:
        for _ in range(differences):
            column = np.diff(column, prepend=0)
        numbers.append(column)
    signed = np.concatenate(numbers)
    rest = ((signed << 1) ^ (signed >> 63))[:, None] >> np.arange(0, 42, 7)  # [numbers, bytes]: what each byte begins
    digits = (rest & 127) | np.where(rest >> 7 > 0, 128, 0)
    needed = (rest > 0) | (np.arange(rest.shape[1]) == 0)
    return base64.b64encode(zlib.compress(digits[needed].astype(np.uint8).tobytes(), 9)).decode("ascii")
