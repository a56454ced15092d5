"""Writing of departures and flows as elements of route files, for SUMO's own programs and for scenes of maps."""

from __future__ import annotations

from math import inf
from xml.etree import ElementTree

from harness.road.demand.route_file import EDGE_SHARE, SHARE, Departure, Flow, RouteFile


def elements_of(routes: RouteFile) -> list[ElementTree.Element]:
    """The types, vehicles, persons and flows of a route file, the latter by time. Each traveller has one route."""
    vehicles = [(each.depart_s, traveller_element(each, each.name, each.depart_s)) for each in routes.vehicles.values()]
    flows = [(each.departure.depart_s, _flow_element(each)) for each in routes.flows]
    by_time = sorted([*vehicles, *flows], key=lambda each: each[0])
    return [*ElementTree.fromstring(routes.types_xml), *(element for _, element in by_time)]


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


def _flow_element(flow: Flow) -> ElementTree.Element:
    departure, rate = flow.departure, flow.rate
    element = traveller_element(departure, departure.name, departure.depart_s)
    element.tag = "personFlow" if departure.on_foot else "flow"
    element.set("begin", element.attrib.pop("depart"))
    if flow.end_s < inf:
        element.set("end", f"{flow.end_s:.3f}")
    if rate.period_s is not None and not rate.spread:
        element.set("period", repr(rate.period_s))
    if rate.mean_period_s is not None:
        element.set("period", f"exp({1.0 / rate.mean_period_s!r})")
    if rate.probability_per_s is not None:
        element.set("probability", repr(rate.probability_per_s))
    if rate.number is not None:
        element.set("number", str(rate.number))
    return element
