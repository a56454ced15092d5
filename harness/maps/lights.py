"""How long the traffic lights of a net are red."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

from harness.game.junctions import SIGNALS, Signal
from harness.road.xml.xml_file import number_of, parse_xml

_STOPS = {letter for letter, signal in SIGNALS.items() if signal in (Signal.YELLOW, Signal.RED)}


def longest_reds_s(net_file: Path) -> dict[str, float]:
    """The longest time for which a link of each traffic light of a checked net is yellow or red, by the light's id."""
    reds: dict[str, float] = {}
    for logic in parse_xml(net_file).findall("tlLogic"):
        name = logic.get("id", "")
        reds[name] = max(reds.get(name, 0.0), _longest_s(logic))
    return reds


def _longest_s(logic: ElementTree.Element) -> float:
    phases = [(number_of(each.get("duration", "")), each.get("state", "")) for each in logic.findall("phase")]
    longest_s = 0.0
    for link in range(min(len(state) for _, state in phases)):
        stops = [(duration_s, state[link] in _STOPS) for duration_s, state in phases]
        if all(stop for _, stop in stops):
            continue  # of a direction that is closed
        since_s = 0.0
        for duration_s, stop in stops * 2:  # red may go on from the last phase to the first
            since_s = since_s + duration_s if stop else 0.0
            longest_s = max(longest_s, since_s)
    return longest_s
