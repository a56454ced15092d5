"""Departures as elements of a SUMO route file, for SUMO's own programs."""

from __future__ import annotations

from xml.etree import ElementTree

from harness.traffic.route_file import SHARE, Departure


def vehicle_element(departure: Departure, name: str, depart_s: float) -> ElementTree.Element:
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
