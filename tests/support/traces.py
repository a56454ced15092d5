"""Traces of games that were never played."""

from __future__ import annotations

import pandas as pd


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
