"""Traces of games that were never played."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from harness.evaluation.recorded_game import BodyKind, RecordedGame
from harness.game.world import World
from tests.support.roads import nearest_station_m

Pose = tuple[float, float, float, float]
"""x and y (m), heading (rad), speed (m/s)."""


def rows(
    player: str, poses: Sequence[Pose], kind: str = "car", end: str = "", lapsed: Sequence[int] = ()
) -> list[dict[str, Any]]:
    """A player's rows of a trace from its poses in each step; `end`: its outcome in the last; `lapsed`: steps of a
    lapse of attention."""
    table = pd.DataFrame(list(poses), columns=["x_m", "y_m", "heading_rad", "speed_mps"], dtype=float)
    step = table.index
    table = table.assign(episode=0, step=step, time_s=0.1 * step, player=player, vehicle_type=kind)
    table = table.assign(acceleration_mps2=table["speed_mps"].diff().fillna(0.0) / 0.1, steering_rad=0.0)
    last = step == len(table) - 1
    return table.assign(signals="", lapsed=step.isin(lapsed), outcome=np.where(last, end, "")).to_dict("records")


def drawn(**players: tuple[list[float], float, float, dict[int, str]]) -> pd.DataFrame:
    """A trace of players that drive straight on approach_1 or _0 of networks/merge: x (m) per step, speed, y; and
    their outcomes by the step."""
    table: list[dict[str, Any]] = []
    for name, (places, speed_mps, y_m, outcomes) in players.items():
        made = rows(name, [(x_m, y_m, 0.0, speed_mps) for x_m in places], kind="ego_car")
        table += [{**row, "outcome": outcomes.get(row["step"], "")} for row in made]
    return pd.DataFrame(table)


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
