"""SUMO-GUI's settings: the visible part of the road, the zoom, the speed, and the halts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np
import pandas as pd

from harness.replay.contacts import Contact
from harness.replay.floating_car_data import Lanes
from harness.replay.vehicles import PLAYER_COLOURS

WINDOW_PX = (1280, 640)
_CANVAS_PX = (WINDOW_PX[0] - 10, WINDOW_PX[1] - 190)  # without SUMO-GUI's tool bars and message window
_NET_MARGIN_M = 6.0  # added around a net by SUMO-GUI at zoom 100
_AROUND_M = 12.0  # of road beyond the places of the players
_WIDEST_M = 220.0  # a car of 4.6 m is then 27 pixels long
_WIDEST_WITH_CONTACT_M = 120.0  # 49 pixels: the contact must be visible
_GROUND, _ASPHALT, _BEHIND_TEXT = "214,224,206", "96,98,104", "white"
# "Delay in milliseconds" is per simulated second (GUIRunThread.cpp), so 1000 is real time.
_DELAY_MS = 2000


@dataclass(frozen=True, kw_only=True)
class Viewport:
    """The piece of road to show: its centre and size (m)."""

    x_m: float
    y_m: float
    width_m: float
    height_m: float


def choose_view(trace: pd.DataFrame, touches: Sequence[Contact]) -> Viewport:
    """The part of the road with the players; if it is too large, around a contact or the closest approach."""
    players = trace[trace["player"].isin(PLAYER_COLOURS)]
    places = players[["x_m", "y_m"]].to_numpy(float)
    low, high = places.min(0) - _AROUND_M, places.max(0) + _AROUND_M
    widest = _WIDEST_WITH_CONTACT_M if touches else _WIDEST_M
    aspect = _CANVAS_PX[1] / _CANVAS_PX[0]
    width = float(min(max(high[0] - low[0], (high[1] - low[1]) / aspect), widest))
    size = np.array([width, width * aspect])
    focus = np.array([touches[-1].x_m, touches[-1].y_m]) if touches else _closest_approach(trace)
    fits = high - low <= size
    centre = np.where(fits, 0.5 * (low + high), np.clip(focus, low + 0.5 * size, high - 0.5 * size))
    return Viewport(x_m=float(centre[0]), y_m=float(centre[1]), width_m=float(size[0]), height_m=float(size[1]))


def _closest_approach(trace: pd.DataFrame) -> np.ndarray:
    """The place of a player when another road user was nearest to it; halfway along its path if it was alone."""
    player = next(name for name in PLAYER_COLOURS if (trace["player"] == name).any())
    own, others = trace[trace["player"] == player], trace[trace["player"] != player]
    pairs = own.merge(others, on="step", suffixes=("", "_other"))
    if pairs.empty:
        return own[["x_m", "y_m"]].iloc[len(own) // 2].to_numpy(float)
    distance = np.hypot(pairs["x_m"] - pairs["x_m_other"], pairs["y_m"] - pairs["y_m_other"])
    return pairs.loc[distance.idxmin(), ["x_m", "y_m"]].to_numpy(float)


def view_settings(view: Viewport, halts_s: Sequence[float], lanes: Lanes, *, signals: bool) -> ElementTree.Element:
    """SUMO-GUI's settings file. It halts at these times of its own clock, and continues with "play".

    With `signals`, the state of the traffic lights is drawn at the ends of the lanes.
    """
    left, bottom, right, top = lanes.bounds()
    net = (right - left + 2 * _NET_MARGIN_M, top - bottom + 2 * _NET_MARGIN_M)
    whole = min(_CANVAS_PX[0] / net[0], _CANVAS_PX[1] / net[1])  # pixels per metre at zoom 100
    wanted = min(_CANVAS_PX[0] / view.width_m, _CANVAS_PX[1] / view.height_m)

    root = ElementTree.Element("viewsettings")
    scheme = ElementTree.SubElement(root, "scheme", name="real world")
    ElementTree.SubElement(scheme, "background", backgroundColor=_GROUND)
    for surface, entry, options in (("edges", "road", {"showLinkRules": str(int(signals))}), ("junctions", "", {})):
        element = ElementTree.SubElement(scheme, surface, options)
        colours = ElementTree.SubElement(element, "colorScheme", name="uniform")
        ElementTree.SubElement(colours, "entry", color=_ASPHALT, name=entry)
    ElementTree.SubElement(
        scheme, "vehicles", vehicleQuality="2", showBlinker="0", vehicle_minSize="1", vehicle_exaggeration="1"
    )
    texts = {"show": "1", "size": "70", "color": "black", "bgColor": _BEHIND_TEXT, "constantSize": "1"}
    ElementTree.SubElement(scheme, "pois", {f"poiType_{name}": value for name, value in texts.items()})
    ElementTree.SubElement(
        root, "viewport", x=f"{view.x_m:.2f}", y=f"{view.y_m:.2f}", zoom=f"{100 * wanted / whole:.2f}"
    )
    ElementTree.SubElement(root, "delay", value=str(_DELAY_MS))
    for halt_s in halts_s:
        ElementTree.SubElement(root, "breakpoint", time=f"{halt_s:.3f}")
    return root
