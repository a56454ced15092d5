"""The times and places at which the players of a recorded game touch something."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
import shapely
from shapely.affinity import rotate, translate

from harness.game.arrays import FloatArray
from harness.replay.vehicles import DrawnVehicle, shown_name


@dataclass(frozen=True, kw_only=True)
class Contact:
    """The time and place of a contact of players."""

    time_s: float
    x_m: float
    y_m: float
    label: str


def contacts(trace: pd.DataFrame, types: Mapping[str, DrawnVehicle], rails: Sequence[FloatArray]) -> list[Contact]:
    """Every contact of one game, in order of time; a collision of two players is one contact."""
    hit = trace[trace["outcome"].isin(["collision", "rail"])].sort_values("step", kind="stable")
    hit = hit.drop_duplicates("player")
    several = len(hit) > 0 and trace["player"].drop_duplicates().str.fullmatch(r"non_ego_\d").any()
    touches = []
    for (step, outcome), rows in hit.groupby(["step", "outcome"]):
        frame = trace[trace["step"] == step]
        bodies = {row.player: box_of(row, types[row.player]) for row in frame.itertuples()}
        first = rows["player"].iloc[0]
        if outcome == "collision":
            against = [body for player, body in bodies.items() if player != first]
        else:
            against = [shapely.LineString(rail) for rail in rails]
        place = _touching_point(bodies[first], against)
        time_s = float(rows["time_s"].iloc[0])
        whose = " of " + " and ".join(shown_name(player, {}) for player in sorted(rows["player"])) if several else ""
        label = f"{outcome}{whose} at {time_s:.1f} s"
        touches.append(Contact(time_s=time_s, x_m=place.x, y_m=place.y, label=label))
    return touches


def box_of(row: Any, drawn: DrawnVehicle) -> shapely.Polygon:
    """The body of a vehicle or obstacle at a row of the trace."""
    half_length, half_width = 0.5 * drawn.length_m, 0.5 * drawn.width_m
    box = shapely.box(-half_length, -half_width, half_length, half_width)
    return translate(rotate(box, row.heading_rad, (0, 0), use_radians=True), row.x_m, row.y_m)


def _touching_point(body: shapely.Polygon, against: Sequence[shapely.Geometry]) -> shapely.Point:
    """Centre of the overlap of `body` with the nearest of `against`; centre of `body` where there is none."""
    if not against:
        return body.centroid
    nearest = against[int(np.argmin([body.distance(other) for other in against]))]
    shared = body.intersection(nearest)
    if not shared.is_empty:
        return shared.centroid
    return shapely.shortest_line(body, nearest).centroid
