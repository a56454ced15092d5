"""The vehicle types of a recorded game, with their colours in the replay."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from xml.etree import ElementTree

import numpy as np
import pandas as pd

from harness.game.placed_obstacles import NO_OBSTACLES, Obstacles, PlacedObstacle
from harness.game.roles import role_in_words
from harness.road.demand.route_file import CAR_SIZE_M, SIZES_M
from harness.road.demand.walks import WALKER_ATTRIBUTES, WALKER_TYPE

PLAYER_COLOURS = {
    "ego": "31,119,255",  # blue and orange, as in the paper's figure 2
    "non_ego": "255,127,14",
    "non_ego_2": "214,39,40",
    "non_ego_3": "148,103,189",
    "non_ego_4": "140,86,75",
}
_COLOUR_NAMES = {"ego": "blue", "non_ego": "orange", "non_ego_2": "red"}
_COLOUR_NAMES |= {"non_ego_3": "purple", "non_ego_4": "brown"}
OBSTACLE_COLOUR = "110,110,120"
_OBSTACLE_SHAPES = {
    "car": "passenger/sedan",
    "broken_down_car": "passenger/sedan",
    "van": "delivery",
    "truck": "truck",
    "bus": "bus",
}
_BACKGROUND_COLOUR = "190,190,190"

_DEFAULT_CLASSES = {"DEFAULT_PEDTYPE": "pedestrian", "DEFAULT_BIKETYPE": "bicycle"}
_SHAPES = {name: name for name in SIZES_M} | {
    "wheelchair": "pedestrian",
    "trailer": "truck/trailer",
    "coach": "bus/coach",
    "tram": "rail/railcar",
}


@dataclass(frozen=True, kw_only=True)
class DrawnVehicle:
    """The drawing of a vehicle; `name` is the type's id in the replay."""

    name: str
    length_m: float
    width_m: float
    shape: str
    """SUMO's guiShape; empty: an obstacle that is drawn as a polygon."""
    colour: str

    def attributes(self) -> dict[str, str]:
        """The attributes of a SUMO `<vType>`.

        The class is `ignoring`, so that no lane's permissions exclude a recorded vehicle. The limits are so wide that
        no recorded motion causes a warning.
        """
        return {
            "id": self.name,
            "vClass": "ignoring",
            "length": f"{self.length_m:g}",
            "width": f"{self.width_m:g}",
            "guiShape": self.shape,
            "color": self.colour,
            "maxSpeed": "1000",
            "emergencyDecel": "1000",
        }


def names_in_pictures(persona: object) -> dict[str, str]:
    """What the players of a game with one person are called; `persona` is of `episodes.csv`, empty for none."""
    return {"non_ego": persona} if isinstance(persona, str) and persona else {}


def shown_name(player: str, names: Mapping[str, str]) -> str:
    """What a player is called in pictures: its entry in `names`, else its name in the trace."""
    return names[player].replace("_", " ") if player in names else role_in_words(player)


def legend(trace: pd.DataFrame, names: Mapping[str, str]) -> str:
    """Which vehicle is whose, by its colour."""
    present = [name for name in PLAYER_COLOURS if (trace["player"] == name).any()]
    return ", ".join(f"{_COLOUR_NAMES[name]}: {shown_name(name, names)}" for name in present)


def presences(rows: pd.DataFrame) -> Iterator[pd.DataFrame]:
    """A road user's rows, split where it was absent."""
    cuts = np.flatnonzero(np.diff(rows["step"].to_numpy()) > 1) + 1
    for first, end in pairwise([0, *cuts.tolist(), len(rows)]):
        yield rows.iloc[first:end]


def types_of_vehicles(
    trace: pd.DataFrame, types_xml: str, obstacles: Obstacles = NO_OBSTACLES
) -> dict[str, DrawnVehicle]:
    """The drawing of each vehicle and obstacle of one game, by its id; `types_xml` is that of the scene's routes.

    The players get types of their own. Background vehicles keep their type, in grey where it has no colour. A type that
    the routes do not define is SUMO's default.
    """
    defined = {WALKER_TYPE: WALKER_ATTRIBUTES, **_defined_types(types_xml)}
    vehicles = trace.drop_duplicates("player")
    types = {}
    for vehicle, type_id in sorted(zip(vehicles["player"], vehicles["vehicle_type"], strict=True)):
        name = vehicle if vehicle in PLAYER_COLOURS else type_id
        if vehicle not in PLAYER_COLOURS and name in PLAYER_COLOURS:
            name = f"{name}_type"
        builtin = {"vClass": _DEFAULT_CLASSES.get(type_id, "passenger")}
        types[vehicle] = _drawn(name, defined.get(type_id, builtin))
    return types | {each.name: _standing(each) for each in obstacles.each if each.name in types}


@lru_cache(maxsize=8)
def _defined_types(types_xml: str) -> dict[str, dict[str, str]]:
    """The attributes of each type."""
    root = ElementTree.fromstring(types_xml)
    return {str(element.get("id")): dict(element.attrib) for element in root.iter("vType")}


def _standing(obstacle: PlacedObstacle) -> DrawnVehicle:
    return DrawnVehicle(
        name=obstacle.vehicle_type,
        length_m=obstacle.length_m,
        width_m=obstacle.width_m,
        shape=_OBSTACLE_SHAPES.get(obstacle.kind, ""),
        colour=OBSTACLE_COLOUR,
    )


def _drawn(name: str, attributes: Mapping[str, str]) -> DrawnVehicle:
    vehicle_class = attributes.get("vClass", "passenger")
    length_m, width_m = SIZES_M.get(vehicle_class, CAR_SIZE_M)
    return DrawnVehicle(
        name=name,
        length_m=float(attributes.get("length", length_m)),
        width_m=float(attributes.get("width", width_m)),
        shape=attributes.get("guiShape", _SHAPES.get(vehicle_class, "passenger/sedan")),
        colour=PLAYER_COLOURS.get(name, attributes.get("color", _BACKGROUND_COLOUR)),
    )
