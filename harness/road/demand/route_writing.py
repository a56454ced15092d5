"""Departures as elements of a SUMO route file, for SUMO's own programs."""

from __future__ import annotations

from xml.etree import ElementTree

from harness.road.demand.route_file import EDGE_SHARE, SHARE, Departure


def traveller_element(departure: Departure, name: str, depart_s: float) -> ElementTree.Element:
    """A `<vehicle>` with one route, or a `<person>` with one walk, under a name and at a time."""
    attributes = {"id": name, "type": departure.vehicle_type, "depart": f"{depart_s:.3f}"}
    if departure.speed_factor is not None:
        attributes["speedFactor"] = f"{departure.speed_factor:.6f}"
    if not departure.on_foot:
        return _vehicle_element(departure, attributes, depart_s - departure.depart_s)
    departs, arrives = (
        "random" if each.endswith(EDGE_SHARE) else each for each in (departure.position, departure.arrival[1])
    )
    element = ElementTree.Element("person", {**attributes, "departPos": departs})
    speed = {"speed": departure.speed} if departure.speed else {}
    ElementTree.SubElement(element, "walk", {"edges": " ".join(departure.edges), "arrivalPos": arrives, **speed})
    return element


def _vehicle_element(departure: Departure, attributes: dict[str, str], later_s: float) -> ElementTree.Element:
    names = ("departLane", "departPos", "departSpeed", "arrivalLane", "arrivalPos", "arrivalSpeed")
    places = (departure.lane, departure.position, departure.speed, *departure.arrival)
    attributes |= dict(zip(names, places, strict=True))
    if departure.lateral:
        attributes["departPosLat"] = "random" if departure.lateral.endswith(SHARE) else departure.lateral
    element = ElementTree.Element("vehicle", attributes)
    ElementTree.SubElement(element, "route", edges=" ".join(departure.edges))
    for stop in departure.stops:
        numbers = {
            "startPos": stop.start_m,
            "endPos": stop.end_m,
            "duration": stop.duration_s,
            "until": stop.later(later_s).until_s,
        }
        written = {key: f"{value:.3f}" for key, value in numbers.items() if value is not None}
        parking = {"parking": "true"} if stop.parking else {}
        ElementTree.SubElement(element, "stop", {"lane": f"{stop.edge}_{stop.lane}", **written, **parking})
    return element
