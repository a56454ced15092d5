"""Made-up recorded games for tests of the page: on the road of networks/merge, without SUMO."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd

from harness.evaluation.tables import table_of
from harness.evaluation.worst_first import choose_games, worst_first
from harness.game.arrays import FloatArray
from harness.reports.embedding import COLUMNS, REFERENCE_COLUMNS, GameTracks, Reference, Track

PREVENTED = 9
"""The episode of the collisions that a reference driver prevents."""
REFERENCE = list(COLUMNS)[:REFERENCE_COLUMNS]
STEP_S, STEPS = 0.1, 80
OUTLINE = [[0, 0], [220, 0], [220, -3.2], [130, -3.2], [100, -6.4], [0, -6.4], [0, 0]]
SCENE: dict[str, Any] = {
    "surfaces": [[OUTLINE]],
    "laneMarks": [[[0, -3.2], [100, -3.2]]],
    "edgeLines": [],
    "rails": [[[0.3, 0], [219.7, 0]], [[219.7, -3.2], [130, -3.2], [100, -6.4], [0.3, -6.4]]],
    "goal": [[[175, -3.2], [175, 0]]],
}


def recorded(episodes: pd.DataFrame, background: int = 2) -> Iterator[GameTracks]:
    """A game for each played row of `episodes`, those to watch first at the front."""
    played = episodes[(episodes["error"] == "") & (episodes["ego_outcome"] != "error")]
    chosen = worst_first(choose_games(played))
    rest = worst_first(played.drop(chosen.index))
    for rows in (chosen, rest):
        for row in rows.itertuples():
            yield recorded_game(row, background)


def recorded_game(row: Any, background: int = 2) -> GameTracks:
    """One game with the outcome of its row and so many background vehicles."""
    outcome = row.ego_outcome or row.non_ego_outcome
    random = np.random.default_rng([row.seed, row.episode])
    touching = outcome in ("collision", "rail")
    ends = STEPS - 18 + int(random.integers(10)) if touching else STEPS
    time = np.arange(ends + 1) * STEP_S
    sides = {"ego": (row.ego_outcome, 12.5), "non_ego": (row.non_ego_outcome, 13.4 if touching else 14.4)}
    players = [_player(name, time, random, *each) for name, each in sides.items() if each[0]]
    if len(players) == 1:
        for nothing in ("leader_gap_m", "time_to_collision_s"):
            players[0].columns[nothing][:] = np.inf
    along = [
        Track(name=f"car {n}", size_m=(5.0, 1.8), first_step=0, columns=_motion(time, 80.0 + 30.0 * n, -1.6, 9.0))
        for n in range(background)
    ]
    y_m = {"collision": -2.5, "rail": 0.0}
    return GameTracks(
        arm=row.arm,
        persona=row.persona,
        seed=row.seed,
        episode=row.episode,
        step_s=STEP_S,
        steps=ends,
        outcome=outcome,
        players=players,
        background=along,
        severity=row.severity,
        delta_v_mps=2.0 + row.episode / 10 if outcome == "collision" else None,
        reference=_reference(*players) if outcome == "collision" and row.episode == PREVENTED else None,
        touches=[(float(time[-1]), float(players[0].columns["x_m"][-1]), y_m[outcome])] if touching else [],
    )


def _reference(ego: Track, person: Track) -> Reference:
    """A driver takes the ego over after 3 s and falls back by up to 15 m; the person goes on for a second."""
    return Reference(
        driver="careful and competent driver", players=[_going_on(ego, 30, -15.0), _going_on(person, -1, 0.0)]
    )


def _going_on(track: Track, first_step: int, offset_m: float) -> Track:
    """The track from a step on and for another second, with an offset that grows to this one."""
    columns = {name: np.append(track.columns[name][first_step:], [track.columns[name][-1]] * 10) for name in REFERENCE}
    columns["x_m"][-10:] += np.arange(1, 11) * STEP_S * track.columns["speed_mps"][-1]
    columns["x_m"] += np.linspace(0.0, offset_m, len(columns["x_m"]))
    first_step %= len(track.columns["x_m"])
    return Track(name=track.name, size_m=track.size_m, first_step=first_step, columns=columns)


def _player(name: str, time: FloatArray, random: np.random.Generator, outcome: str, speed_mps: float) -> Track:
    """The ego keeps its lane; the person changes to it where its own ends."""
    ego = name == "ego"
    acceleration = random.normal(-0.1 if ego else 0.1, 0.08, len(time))
    x_m, y_m = (30.0, -1.6) if ego else (32.0, -4.8)
    columns = _motion(time, x_m, y_m, speed_mps + np.cumsum(acceleration) * STEP_S) | {
        "acceleration_mps2": acceleration,
        "steering_rad": np.zeros(len(time)),
        "lapsed": ((time > 2.0) & (time < 3.4) & (not ego)).astype(float),
        "leader_gap_m": np.where(np.abs(time - 3.5) < 2.5, 18 - 2.2 * time, np.inf),
        "time_to_collision_s": np.where(time > 2.5, (time[-1] - time) * 1.3, np.inf),
    }
    if not ego:
        columns["y_m"] += 3.2 * np.clip((columns["x_m"] - 85) / 40, 0, 1) ** 2
    return Track(name=name, size_m=(4.6, 1.8), first_step=0, columns=columns, outcome=outcome, ended_step=len(time) - 1)


def _motion(time: FloatArray, x_m: float, y_m: float, speed_mps: FloatArray | float) -> dict[str, FloatArray]:
    """A car that drives along the road from a place."""
    speed = np.zeros(len(time)) + speed_mps
    return {
        "x_m": x_m + np.cumsum(speed) * STEP_S,
        "y_m": np.full(len(time), y_m),
        "heading_rad": np.zeros(len(time)),
        "speed_mps": speed,
    }


def manoeuvres(episodes: pd.DataFrame) -> pd.DataFrame:
    """A frame of manoeuvres as the rule book writes it: two in each game against a persona."""
    names = (("cut_in", "swerve"), ("drift", "hard_brake"), ("tailgate", "overtake"))
    rows = []
    for row in episodes[episodes["arm"].str.contains("_vs_")].itertuples():
        non_ego, ego = names[row.episode % 3]
        cells = {"arm": row.arm, "persona": row.persona, "seed": row.seed, "episode": row.episode}
        rows.append(
            {**cells, "player": "non_ego", "manoeuvre": non_ego, "time_s": 4.0, "until_s": 5.4}
            | {"gap_m": 3.1, "ttc_s": 0.9, "text": "gap 3.1 m, TTC 0.9 s"}
        )
        rows.append(
            {**cells, "player": "ego", "manoeuvre": ego, "time_s": 5.0, "until_s": 5.3}
            | {"gap_m": np.nan, "ttc_s": np.nan, "text": ""}
        )
    return pd.DataFrame(rows)


def causes(episodes: pd.DataFrame) -> pd.DataFrame:
    """A frame of causes that fits: the non-ego's manoeuvre in each failure against a persona."""
    deeds = {0: ("cut_in", "cuts in from the left", "swerves"), 1: ("drift", "drifts in", "brakes")}
    rows = []
    for row in episodes[episodes["ego_failed"].fillna(0) == 1].itertuples():
        event, deed, reaction = deeds[row.episode % 2]
        other = "non_ego" if "_vs_" in row.arm else ""
        rows.append(
            {"arm": row.arm, "persona": row.persona, "seed": row.seed, "episode": row.episode}
            | {"ego_outcome": row.ego_outcome, "other": other, "event": event, "deed": deed}
            | {"time_s": 4.0, "time_left_s": 1.2, "ego_saw": "yes", "hidden_until_s": np.nan}
            | {"reaction": reaction, "braking_mps2": 2.5, "ego_broke": ""}
        )
    return table_of("causes", rows)
