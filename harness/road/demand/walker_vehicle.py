"""The body of a player on foot in SUMO: a small vehicle with the shape of a pedestrian.

Persons that are placed end SUMO 1.28 in nets with crossings, and SUMO's cars do not see them beside crossings.
"""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import shapely
from sumolib.net import Net
from sumolib.net.edge import Edge

from harness.config.road_user import WALKER_LENGTH_M, WALKER_RUN_MPS, WALKER_WIDTH_M
from harness.config.scene import Scene
from harness.game.arrays import FloatArray
from harness.road.demand.route_file import Departure, RouteFile, VehicleType
from harness.road.net.network import car_lanes, lane_line

WALKER_TYPE = "harness_pedestrian"
WALKER_ATTRIBUTES = {
    "id": WALKER_TYPE,
    "length": f"{WALKER_LENGTH_M:g}",
    "width": f"{WALKER_WIDTH_M:g}",
    "maxSpeed": f"{WALKER_RUN_MPS:g}",
    "minGap": "0.25",
    "guiShape": "pedestrian",
}
"""The SUMO `<vType>` of a walker. Its class is a car's: the edges of its route need not allow pedestrians."""


def with_walkers(routes: RouteFile, document: Scene, net: Net) -> RouteFile:
    """The route file with a vehicle for each pedestrian among the players, on the road that is nearest to its way."""
    walkers = {
        name: np.array(player.way)
        for name, player in zip(document.vehicles, document.players, strict=True)
        if player.way is not None
    }
    if not walkers:
        return routes
    types = ElementTree.fromstring(routes.types_xml)
    ElementTree.SubElement(types, "vType", WALKER_ATTRIBUTES)
    vehicles = {
        name: Departure(
            name=name,
            vehicle_type=WALKER_TYPE,
            edges=(_nearest_road(net, way).getID(),),
            depart_s=0.0,
            lane="best",
            position="base",
            speed="0",
        )
        for name, way in walkers.items()
    }
    kind = VehicleType(
        name=WALKER_TYPE,
        length_m=WALKER_LENGTH_M,
        width_m=WALKER_WIDTH_M,
        max_speed_mps=WALKER_RUN_MPS,
        vehicle_class="pedestrian",  # what it is; to SUMO it is a car
    )
    return replace(
        routes,
        types={**routes.types, WALKER_TYPE: kind},
        vehicles={**routes.vehicles, **vehicles},
        types_xml=ElementTree.tostring(types, encoding="unicode"),
    )


def _nearest_road(net: Net, way: FloatArray) -> Edge:
    roads = [edge for edge in net.getEdges(withInternal=False) if car_lanes(edge)]
    line = shapely.LineString(way)
    return min(roads, key=lambda edge: shapely.distance(line, shapely.LineString(lane_line(car_lanes(edge)[0]))))
