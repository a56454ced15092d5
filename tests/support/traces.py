"""Traces of games that were never played."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from harness.evaluation.recorded_game import BodyKind, RecordedGame
from harness.game.world import World
from tests.support.stations import nearest_station_m


def drawn(**players: tuple[list[float], float, float, dict[int, str]]) -> pd.DataFrame:
    """A trace of players that drive straight on approach_1 or _0 of networks/merge: x (m) per step, speed, y."""
    rows: list[dict[str, object]] = []
    for name, (places, speed_mps, y_m, outcomes) in players.items():
        for step, x_m in enumerate(places):
            cells: dict[str, object] = {
                "episode": 0,
                "step": step,
                "time_s": step * 0.1,
                "player": name,
                "vehicle_type": "ego_car",
            }
            cells |= {"x_m": x_m, "y_m": y_m, "heading_rad": 0.0, "speed_mps": speed_mps, "acceleration_mps2": 0.0}
            rows.append(cells | {"steering_rad": 0.0, "lapsed": False, "outcome": outcomes.get(step, "")})
    return pd.DataFrame(rows)


Pose = tuple[float, float, float, float]
"""x and y (m), heading (rad), speed (m/s)."""


def rows(
    player: str, poses: Sequence[Pose], kind: str = "car", end: str = "", lapsed: Sequence[int] = ()
) -> list[dict[str, Any]]:
    """A player's rows of a trace from its poses in each step; `end`: its outcome in the last; `lapsed`: steps of a
    lapse of attention."""
    cells = {"episode": 0, "vehicle_type": kind, "steering_rad": 0.0, "signals": "", "player": player}
    result = []
    for step, (x, y, heading, speed) in enumerate(poses):
        before = poses[max(step - 1, 0)][3]
        motion = {"x_m": x, "y_m": y, "heading_rad": heading, "speed_mps": speed}
        acceleration = (speed - before) / 0.1
        outcome = end if step == len(poses) - 1 else ""
        row = {
            **cells,
            **motion,
            "lapsed": step in lapsed,
            "step": step,
            "time_s": 0.1 * step,
            "acceleration_mps2": acceleration,
        }
        result.append({**row, "outcome": outcome})
    return result


def along(x: float, y: float, heading: float, speed: float, steps: int) -> list[Pose]:
    """Poses at constant velocity."""
    move = 0.1 * speed
    return [(x + k * move * math.cos(heading), y + k * move * math.sin(heading), heading, speed) for k in range(steps)]


def game(world: World, trace: pd.DataFrame, kinds: Mapping[str, BodyKind] | None = None, **cells: Any) -> RecordedGame:
    """The game of a trace; a column that it lacks is added: the station nearest to each player, steering that is known,
    and what a game is without payoffs, signals, and differences to the scene. `cells` replace columns."""
    usual = {"episode": 0, "signals": "", "payoff": 0.0, "steers": True, "limit_share": 1.0, "station_m": 0.0}
    usual |= {
        "friction": world.actuators.friction,
        "signal_s": " ".join(["0.0"] * len(world.right_of_way.signal_links)),
    }
    trace = trace.assign(**{name: cell for name, cell in usual.items() if name not in trace} | cells)
    for player, role in enumerate(world.roles):
        own = trace["player"] == role
        places = (np.tile(trace.loc[own, name].to_numpy()[:, None], len(world.roles)) for name in ("x_m", "y_m"))
        trace.loc[own, "station_m"] = nearest_station_m(world.road.routes, *places)[:, player]
    return RecordedGame(trace=trace.reset_index(drop=True), world=world, kinds=kinds or {})
