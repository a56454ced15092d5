"""Made-up recorded games for tests of the page: on the road of networks/merge, without SUMO."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd

from harness.evaluation.tables import table_of
from harness.evaluation.worst_first import worst_first
from harness.game.arrays import FloatArray
from harness.replay.selection import choose_games
from harness.reports.embedding import COLUMNS, GameTracks, Track

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
    ends = STEPS - 18 + int(random.integers(10)) if outcome in ("collision", "rail") else STEPS
    time = np.arange(ends + 1) * STEP_S
    players = []
    if row.ego_outcome:
        players.append(_player("ego", time, 30.0, -1.6, 12.5, random, row.ego_outcome))
    if row.non_ego_outcome:
        players.append(_player("non_ego", time, 32.0, -4.8, 13.4, random, row.non_ego_outcome))
    if outcome == "collision" and len(players) == 2:
        ego, non_ego = (player.columns for player in players)
        shift = ego["y_m"][-1] - non_ego["y_m"][-1] - 1.75
        non_ego["y_m"][:] += shift * np.clip((time - time[-1] + 2.5) / 2.5, 0, 1) ** 2
        non_ego["x_m"][:] += (ego["x_m"][-1] - non_ego["x_m"][-1] + 1.2) * (time / time[-1])
    touches = []
    if outcome in ("collision", "rail"):
        first = players[0].columns
        y_m = first["y_m"][-1] - 0.9 if outcome == "collision" else 0.0
        touches.append((float(time[-1]), float(first["x_m"][-1]), float(y_m)))
    along = [
        Track(
            name=f"car {n}",
            size_m=(5.0, 1.8),
            first_step=0,
            columns={
                "x_m": 80 + 30 * n + 9.0 * time,
                "y_m": np.full(len(time), -1.6),
                "heading_rad": 0 * time,
                "speed_mps": 0 * time + 9.0,
            },
        )
        for n in range(background)
    ]
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
        touches=touches,
    )


def _player(
    name: str,
    time: FloatArray,
    x_m: float,
    y_m: float,
    speed_mps: float,
    random: np.random.Generator,
    outcome: str,
) -> Track:
    ego = name == "ego"
    wave = random.uniform(0.6, 1.4)
    acceleration = (-0.6 if ego else 0.5) * np.sin(wave * time) + random.normal(0, 0.08, len(time))
    if ego:
        acceleration = np.where(time > time[-1] - 1.2, -4.0, acceleration)
    speed = np.maximum(speed_mps + np.cumsum(acceleration) * STEP_S, 0.0)
    x = x_m + np.concatenate(([0.0], np.cumsum(speed)[:-1] * STEP_S))
    y: FloatArray = np.full(len(time), y_m)
    if not ego:
        y = y_m + 3.2 * np.clip((x - 85) / 40, 0, 1) ** 2
    elif outcome == "rail":
        y = y_m + 0.75 * np.clip((time - time[-1] + 2.0) / 2.0, 0, 1) ** 2
    heading = np.arctan2(np.gradient(y), np.gradient(x))
    gap = np.where(np.abs(time - 3.5) < 2.5, 18 - 2.2 * time, np.inf)
    time_to_collision = np.where(time > 2.5, np.maximum(time[-1] - time, 0.0) * 1.3, np.inf)
    steering = np.gradient(heading) * 2.0
    lapsed = ((time > 2.0) & (time < 3.4) & (not ego)).astype(float)
    values = (x, y, heading, speed, acceleration, steering, lapsed, gap, time_to_collision)
    return Track(
        name=name,
        size_m=(4.6, 1.8),
        first_step=0,
        columns=dict(zip(COLUMNS, values, strict=True)),
        outcome=outcome,
        ended_step=len(time) - 1,
    )


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
