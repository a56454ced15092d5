"""Departures as elements of a SUMO route file, for SUMO's own programs."""

from __future__ import annotations

from xml.etree import ElementTree

from harness.road.demand.route_file import EDGE_SHARE, SHARE, Departure


def traveller_element(departure: Departure, name: str, depart_s: float) -> ElementTree.Element:
    """A `<vehicle>` with one route, or a `<person>` with one walk, under a name and at a time."""
    return (_person_element if departure.on_foot else _vehicle_element)(departure, name, depart_s)


def _person_element(departure: Departure, name: str, depart_s: float) -> ElementTree.Element:
    factor = {} if departure.speed_factor is None else {"speedFactor": f"{departure.speed_factor:.6f}"}
    attributes = {"id": name, "type": departure.vehicle_type, "depart": f"{depart_s:.3f}", **factor}
    departs, arrives = (
        "random" if each.endswith(EDGE_SHARE) else each for each in (departure.position, departure.arrival[1])
    )
    element = ElementTree.Element("person", {**attributes, "departPos": departs})
    speed = {"speed": departure.speed} if departure.speed else {}
    ElementTree.SubElement(element, "walk", {"edges": " ".join(departure.edges), "arrivalPos": arrives, **speed})
    return element


def _vehicle_element(departure: Departure, name: str, depart_s: float) -> ElementTree.Element:
    """A `<vehicle>` with one route, under a name and at a time."""
    arrival_lane, arrival_position, arrival_speed = departure.arrival
    attributes = {
        "id": name,
        "type": departure.vehicle_type,
        "depart": f"{depart_s:.3f}",
        "departLane": departure.lane,
        "departPos": departure.position,
        "departSpeed": departure.speed,
        "arrivalLane": arrival_lane,
        "arrivalPos": arrival_position,
        "arrivalSpeed": arrival_speed,
    }
    if departure.lateral:
        attributes["departPosLat"] = "random" if departure.lateral.endswith(SHARE) else departure.lateral
    if departure.speed_factor is not None:
        attributes["speedFactor"] = f"{departure.speed_factor:.6f}"
    element = ElementTree.Element("vehicle", attributes)
    ElementTree.SubElement(element, "route", edges=" ".join(departure.edges))
    for stop in departure.stops:
        times = {
            "duration": stop.duration_s,
            "until": None if stop.until_s is None else stop.until_s + depart_s - departure.depart_s,
        }
        place = {"startPos": stop.start_m, "endPos": stop.end_m}
        numbers = {key: f"{value:.3f}" for key, value in {**place, **times}.items() if value is not None}
        lane = {"lane": f"{stop.edge}_{stop.lane}"}
        parking = {"parking": "true"} if stop.parking else {}
        ElementTree.SubElement(element, "stop", lane | numbers | parking)
    return element
