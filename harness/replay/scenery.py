"""The additional file of a replay: vehicle types, obstacles, buildings, crossings, rails, contacts, traffic lights.

A traffic light's programme has a phase for each time in which its recorded state did not change. SUMO uses the
programme of a light that was loaded last, and additional files are loaded after the net. Lights off the players' routes
are not recorded: they keep the net's programme.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pandas as pd

from harness.game.arrays import FloatArray
from harness.game.placed_obstacles import Obstacles
from harness.replay.contacts import Contact, box_of
from harness.replay.gui_settings import Viewport
from harness.replay.vehicles import OBSTACLE_COLOUR, DrawnVehicle

PROGRAMME = "recorded"
_AFTER_THE_GAME_S = 3600.0
"""Duration of the last phase: the programme must not start again before the replay ends."""
_COLOURS = {"cone": "255,110,0", "closed_lane": "200,60,40,120", "debris": "120,90,60", "wall": "90,90,100"}
_BUILDING_COLOUR, _RAIL_COLOUR, _CONTACT_COLOUR = "150,140,130", "24,26,32", "220,20,20"
_RING_RADIUS_M = 4.0
_TITLE_SHARE = 0.05
"""The least distance of other texts from the title, of the height of the picture: a line is 20 of 450 pixels."""
_OF_LABEL = "_label"


def scenery(
    *,
    types: Mapping[str, DrawnVehicle],
    rails: Sequence[FloatArray],
    touches: Sequence[Contact],
    view: Viewport,
    title: str,
) -> ElementTree.Element:
    """A document with the types, the rails, a ring around each contact, and the title."""
    root = ElementTree.Element("additional")
    for _, drawn in sorted({drawn.name: drawn for drawn in types.values() if drawn.shape}.items()):
        ElementTree.SubElement(root, "vType", drawn.attributes())
    for number, rail in enumerate(rails):
        root.append(_shape(f"rail_{number}", rail, _RAIL_COLOUR, layer=5, width_m=0.4))
    title_y_m = view.y_m + 0.4 * view.height_m
    turn = np.linspace(0.0, 2.0 * math.pi, 37)
    for number, contact in enumerate(touches):
        ring = np.array((contact.x_m, contact.y_m)) + _RING_RADIUS_M * np.stack((np.cos(turn), np.sin(turn)), axis=-1)
        root.append(_shape(f"contact_{number}", ring, _CONTACT_COLOUR, layer=6, width_m=0.24))
        away_m = _away_m(number, title_y_m - contact.y_m, view.height_m)
        root.append(_text(f"contact_{number}{_OF_LABEL}", contact.label, contact.x_m, contact.y_m + away_m))
    root.append(_text("title", title, view.x_m, title_y_m))
    return root


def _away_m(number: int, title_m: float, height_m: float) -> float:
    """How far above a contact its label is, by its number and how far above it the title is.

    The labels of two near contacts do not overlap, and neither overlaps the title.
    """
    if abs(title_m - 2.0 * _RING_RADIUS_M) < _TITLE_SHARE * height_m:
        return -(2.0 + number % 2) * _RING_RADIUS_M
    return (-2.0 if number % 2 else 2.0) * _RING_RADIUS_M


def labels_of_contacts(document: ElementTree.Element) -> Iterator[tuple[str, FloatArray, FloatArray]]:
    """The text, the place [2] and the contact [2] (m) of each label of a contact in a document of `scenery`."""
    shapes = {each.get("id"): each.get("shape", "") for each in document.iter("poly")}
    for each in document.iter("poi"):
        name = each.get("id", "").removesuffix(_OF_LABEL)
        if name in shapes:
            ring = np.array([point.split(",") for point in shapes[name].split()], dtype=float)
            place = np.array([float(each.get(axis, "nan")) for axis in ("x", "y")])
            yield each.get("type", ""), place, 0.5 * (ring.min(0) + ring.max(0))


def shapes_of(
    trace: pd.DataFrame, types: Mapping[str, DrawnVehicle], obstacles: Obstacles
) -> Iterator[ElementTree.Element]:
    """The polygons of one game's obstacles that are not drawn as vehicles, and of the buildings."""
    first = {str(row.player): row for row in trace.drop_duplicates("player").itertuples()}
    for obstacle in obstacles.each:
        row: Any = first.get(obstacle.name)
        if row is not None and not types[obstacle.name].shape:
            corners = np.array(box_of(row, types[obstacle.name]).exterior.coords)
            yield _shape(obstacle.name, corners, _COLOURS.get(obstacle.kind, OBSTACLE_COLOUR), filled=True)
    for number, outline in enumerate(obstacles.outlines):
        corners = np.concatenate((outline, outline[:1]))
        yield _shape(f"building_{number}", corners, _BUILDING_COLOUR, filled=len(outline) > 2)


def painted(stripes: Sequence[FloatArray]) -> Iterator[ElementTree.Element]:
    """The polygons of the stripes of marked crossings, above the lanes and below the vehicles."""
    for number, corners in enumerate(stripes):
        yield _shape(f"stripe_{number}", corners, "white", filled=True)


def _shape(
    name: str, points: FloatArray, colour: str, *, filled: bool = False, layer: int = 4, width_m: float = 0.3
) -> ElementTree.Element:
    """A line or an area; SUMO's `lineWidth` is half of what it draws."""
    shape = " ".join(f"{x:.3f},{y:.3f}" for x, y in points)
    look = {"color": colour, "layer": str(layer), "fill": str(int(filled)), "lineWidth": f"{0.5 * width_m:g}"}
    return ElementTree.Element("poly", {"id": name, "shape": shape} | look)


def _text(name: str, text: str, x_m: float, y_m: float) -> ElementTree.Element:
    """SUMO-GUI has no text element, but it shows the type of an (invisible) point of interest.

    The point is small: SUMO-GUI cuts its circle out of the road, also where the colour is transparent.
    """
    place = {"x": f"{x_m:.2f}", "y": f"{y_m:.2f}", "layer": "200", "width": "0.02", "height": "0.02"}
    return ElementTree.Element("poi", {"id": name, "type": text, "color": "0,0,0,0"} | place)


def programmes(trace: pd.DataFrame, step_length_s: float) -> list[ElementTree.Element]:
    """A `<tlLogic>` for each light of a game's trace, in the order of their ids; none for a trace without lights.

    A change in a step is shown in SUMO's step of the same sample, which is a step later than in the game.
    """
    found = []
    for light, changes in changes_of_signals(trace, step_length_s).items():
        root = ElementTree.Element("tlLogic", id=light, type="static", programID=PROGRAMME, offset="0")
        for place, (duration_s, state) in enumerate(phases_of(changes)):
            before_s = step_length_s if place == 0 else 0.0  # the first phase also covers the step before the game
            ElementTree.SubElement(root, "phase", duration=f"{before_s + duration_s:.3f}", state=state)
        found.append(root)
    return found


def changes_of_signals(trace: pd.DataFrame, step_length_s: float) -> dict[str, list[tuple[float, str]]]:
    """The times (s) at which each light's recorded state changed, with the new states; the first is its first state.

    In the order of the lights' ids; empty for a trace without lights. The column `signals` has the state of each light
    in each step, as `id=state` separated by spaces.
    """
    if "signals" not in trace:
        return {}
    changes: dict[str, list[tuple[float, str]]] = {}
    steps = trace.drop_duplicates("time_s").sort_values("time_s")
    for time_s, text in zip(np.rint(steps["time_s"] / step_length_s) * step_length_s, steps["signals"], strict=True):
        for each in str(text).split():
            light, separator, state = each.rpartition("=")  # an id may contain '='
            if separator:
                of_light = changes.setdefault(light, [])
                if not of_light or of_light[-1][1] != state:
                    of_light.append((float(time_s), state))
    return dict(sorted(changes.items()))


def phases_of(changes: Sequence[tuple[float, str]]) -> list[tuple[float, str]]:
    """Durations (s) and states from the times of changes; the last phase lasts beyond the game."""
    ends_s = [time_s for time_s, _ in changes[1:]] + [changes[-1][0] + _AFTER_THE_GAME_S]
    return [(end_s - time_s, state) for (time_s, state), end_s in zip(changes, ends_s, strict=True)]
