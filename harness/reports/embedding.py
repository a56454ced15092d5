"""The recorded games in the page: small numbers, packed, as many games as fit.

A game's columns are whole numbers of centimetres, milliradians and so on (`COLUMNS`). Of smooth columns the second
differences are written, of the others the first, as variable-length integers (zigzag, 7 bits a byte, low bits first),
deflated, in base64. `recorded.js` reads them.
"""

from __future__ import annotations

import base64
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple
from urllib.parse import quote

import numpy as np
from markupsafe import Markup

from harness.game.arrays import FloatArray, IntArray
from harness.game.roles import NON_EGO, roles_of
from harness.reports.page_template import json_text


class PackedColumn(NamedTuple):
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
"""The columns of a player, in their order; background vehicles have the first `BACKGROUND_COLUMNS` of them, and those
of `Reference` the first `REFERENCE_COLUMNS`."""
BACKGROUND_COLUMNS, REFERENCE_COLUMNS = 4, 3
NOTHING = -1
"""Stands for a missing gap or time."""
LONGEST = 1e5
"""Metres or seconds; a longer gap or time counts as missing."""


@dataclass(frozen=True, kw_only=True)
class Track:
    """The track of one road user, of its body's centre; `outcome` and `ended_step` are those of a player."""

    name: str
    """`ego`, `non_ego`, `non_ego_2` and so on, or SUMO's id of a background vehicle."""
    size_m: tuple[float, float]
    """Length and width."""
    first_step: int
    columns: Mapping[str, FloatArray]
    """[n] values from `first_step` on, by names of `COLUMNS` and in their order: all of a player."""
    outcome: str = ""
    """goal, collision, rail, timeout; empty if it was still driving at the end of the game."""
    ended_step: int | None = None


@dataclass(frozen=True, kw_only=True)
class Reference:
    """How a reference driver prevents a collision."""

    driver: str
    """In words, after "the"."""
    players: Sequence[Track]
    """The ego as it drives it, and the people as they are taken to go on after the recorded collision."""


@dataclass(frozen=True, kw_only=True)
class GameTracks:
    """One game, step 0 to step `steps`."""

    arm: str
    persona: str
    seed: int
    episode: int
    step_s: float
    steps: int
    outcome: str
    """Of the judged player: the ego, or the non-ego where it drives alone."""
    players: Sequence[Track]
    background: Sequence[Track]
    touches: Sequence[tuple[float, float, float]]
    """Time (s) and place (x, y in m) of each contact."""
    severity: float = 0.0
    """The column of episodes.csv, which orders games."""
    delta_v_mps: float | None = None
    """Of a collision: the greater change of velocity (m/s); None: there is none, or it is not known."""
    reference: Reference | None = None
    """How a reference driver takes over and prevents the collision; None: none does."""
    perceived: Sequence[tuple[int, Sequence[str], int]] = ()
    """From which step on the ego's perception has lost which road users and sees how many ghosts; empty without
    errors."""


Marks = Mapping[str, Sequence[Mapping[str, Any]]]
"""The manoeuvres to mark in each game, by `key`."""
Causes = Mapping[str, str]
"""Why the ego failed in each game that it did, by `key`."""
Crowds = Mapping[str, Sequence[str]]
"""The personas of each crowd, in the order of its people."""


def key(arm: str, seed: int, episode: int) -> str:
    """The name of a game in addresses."""
    return f"{quote(arm, safe='')},{seed},{episode}"


def embedded_games(
    games: Iterable[GameTracks], marks: Marks, causes: Causes, crowds: Crowds, budget_bytes: int
) -> dict[str, str]:
    """The games that fit into the page as JSON, by `key`, those to watch first at the front.

    Games are read until the budget is used up.
    """
    texts: dict[str, str] = {}
    size = 0
    for game in games:
        text = game_text(game, marks, causes, crowds)
        size += len(text)
        if size > budget_bytes:
            break
        texts[key(game.arm, game.seed, game.episode)] = text
    return texts


def recorded_document(scene: Mapping[str, Any] | None, games: Iterable[str]) -> Markup:
    """Texts of games, and the road, as JSON that is safe inside a script element. `road.js` reads the scene."""
    columns = json_text(list(COLUMNS.values()))
    counts = f'"backgroundColumns":{BACKGROUND_COLUMNS},"referenceColumns":{REFERENCE_COLUMNS}'
    head = f'"columns":{columns},{counts},"scene":{json_text(scene)}'
    return Markup("{" + head + ',"games":[' + ",\n".join(games) + "]}")


def game_text(game: GameTracks, marks: Marks, causes: Causes, crowds: Crowds) -> str:
    """One game as JSON, with its manoeuvres, why the ego failed, and the personas of its crowd, if it has one."""
    crowd = crowds.get(game.persona, ())
    people = dict(zip(roles_of(1 + len(crowd))[NON_EGO:], crowd, strict=True)) if crowd else {}
    times = [player.columns["time_to_collision_s"] for player in game.players if player.name == "ego"]
    measured = [float(values[np.isfinite(values)].min()) for values in times if np.isfinite(values).any()]
    players = []
    for player in game.players:
        persona = {"persona": people[player.name]} if player.name in people else {}
        players.append(_track(player) | {"outcome": player.outcome, "ended": player.ended_step} | persona)
    perceived = {"perceived": [list(each) for each in game.perceived]} if game.perceived else {}
    return json_text(
        {
            "arm": game.arm,
            "persona": game.persona,
            "seed": game.seed,
            "episode": game.episode,
            "step": game.step_s,
            "steps": game.steps,
            "outcome": game.outcome,
            "cause": causes.get(key(game.arm, game.seed, game.episode), ""),
            "leastTime": round(measured[0], 2) if measured else None,
            "severity": round(game.severity, 2),
            "deltaV": None if game.delta_v_mps is None else round(game.delta_v_mps, 1),
            "players": players,
            "background": [_track(vehicle) for vehicle in game.background],
            "reference": None if game.reference is None else _reference(game.reference),
            "touches": [[round(time_s, 3), round(x_m, 2), round(y_m, 2)] for time_s, x_m, y_m in game.touches],
            "marks": list(marks.get(key(game.arm, game.seed, game.episode), ())),
            "packed": pack(columns_of(game)),
            **perceived,
        }
    )


def _track(track: Track) -> dict[str, Any]:
    size = [round(side_m, 3) for side_m in track.size_m]
    return {"name": track.name, "size": size, "first": track.first_step, "count": len(track.columns["x_m"])}


def _reference(reference: Reference) -> dict[str, Any]:
    return {"driver": reference.driver, "players": [_track(track) for track in reference.players]}


def columns_of(game: GameTracks) -> Iterator[tuple[IntArray, int]]:
    """A game's columns as whole numbers, track by track, each with the number of its differences."""
    for track in (*game.players, *game.background, *(game.reference.players if game.reference else ())):
        for name, values in track.columns.items():
            unit, differences = COLUMNS[name]
            yield _whole(values, unit), differences


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
