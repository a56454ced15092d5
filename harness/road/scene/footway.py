"""A player on foot: its way, and the surface on which it walks."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry
from sumolib.net import Net

from harness.config.road_user import WALKER_LENGTH_M, WALKER_WIDTH_M
from harness.config.scene import Scene
from harness.errors import UsageError
from harness.game.arrays import FloatArray
from harness.game.rails import RASTER_M, Raster
from harness.game.road import MARGIN_M
from harness.road.net import surface
from harness.road.net.network import lane_line
from harness.road.net.route_table import way_table
from harness.road.net.stream import USERS
from harness.road.net.walker_conflicts import WalkersWay, stripes, ways_of
from harness.road.scene.open_player import OpenPlayer
from harness.road.scene.scene_files import SceneFiles

_LEAST_M, _MOST_M = 2.0, 150.0  # of a way
_STRAYS_M = 30.0  # beside a way, within which the carriageway is known
_ROOM_M = 0.5 * (WALKER_LENGTH_M**2 + WALKER_WIDTH_M**2) ** 0.5  # a walker's centre keeps from the surface's edge


@dataclass(frozen=True, kw_only=True)
class Ground:
    """Where players on foot walk."""

    surface: BaseGeometry
    """Carriageway, pavements, walking areas and crossings."""
    carriageway: BaseGeometry
    """The part of it that cars can drive on."""
    near_m: FloatArray
    """[4] bounds of the surroundings of the ways: least x and y, greatest x and y."""
    rail_lines: tuple[FloatArray, ...]
    """The edges of the surface as polylines [n, 2]."""
    ways: list[WalkersWay]

    @property
    def stripes(self) -> tuple[FloatArray, ...]:
        """[5, 2] each: the stripes of the marked crossings, for drawings."""
        return tuple(stripes([np.array(way.line.coords) for way in self.ways if way.marked], self.carriageway))

    @cached_property
    def raster(self) -> Raster:
        """The carriageway's cells around the ways."""
        low, high = self.near_m[:2] - RASTER_M, self.near_m[2:] + RASTER_M
        counts = np.ceil((high - low) / RASTER_M).astype(int)
        x_m, y_m = (low[k] + RASTER_M * (np.arange(counts[k]) + 0.5) for k in range(2))
        cells = shapely.contains_xy(self.carriageway, *np.meshgrid(x_m, y_m, indexing="ij"))
        return Raster(origin_m=low, cells=cells)


def opened_ground(document: Scene, net: Net, carriageway: BaseGeometry) -> Ground | None:
    """The ground around the ways of a scene's players on foot; None without any. `carriageway` is the net's drivable
    area."""
    ways = ways_of(document, net)
    around = shapely.union_all([way.line for way in ways if way.line.length > 0.0])
    if around.is_empty:
        return None
    parts = [each for each in _pavements(net) if each.intersects(around.buffer(MARGIN_M))]
    area = surface.without_slits(surface.joined([carriageway, *parts]))
    return Ground(
        surface=area,
        carriageway=carriageway,
        near_m=np.array(around.buffer(_STRAYS_M).bounds),
        rail_lines=tuple(shapely.get_coordinates(ring) for ring in shapely.get_rings(shapely.get_parts(area))),
        ways=ways,
    )


def _pavements(net: Net) -> list[BaseGeometry]:
    shapes: list[BaseGeometry] = []
    for edge in net.getEdges(withInternal=True):
        for lane in edge.getLanes():
            line = lane_line(lane)
            if edge.getFunction() == "walkingarea":
                if len(line) > 2:
                    shapes.append(shapely.Polygon(line).buffer(0))
            elif lane.allows("pedestrian") and np.ptp(line, axis=0).any():
                shapes.append(surface.lane_shape(line, lane.getWidth()))
    return shapes


def open_walker(role: str, files: SceneFiles, ground: Ground | None) -> OpenPlayer:
    """The player of a name (`Scene.roles`) who is on foot. Raises UsageError with every problem found."""
    document, routes = files.document, files.routes
    way = np.array(document.player(role).way, dtype=float)
    player = document.roles.index(role)
    problem = partial(UsageError.of, files.file, f"{role}.way")
    length_m = surface.length_of(way)
    if not _LEAST_M <= length_m <= _MOST_M:
        message = f"is {length_m:.1f} m long, {_LEAST_M:g} to {_MOST_M:g} m are possible"
        raise problem(message, "move its points")
    assert ground is not None, "a scene with a way has a ground"
    on_way = next(each for each in ground.ways if each.player == player)
    outside = on_way.line.difference(ground.surface.buffer(-_ROOM_M, join_style="mitre"))
    if not outside.is_empty:
        x_m, y_m = shapely.get_coordinates(outside)[0]
        message = f"leaves the surface for people on foot near [{x_m:.1f}, {y_m:.1f}]"
        raise problem(message, f"keep it {_ROOM_M:.2f} m within pavements and roads, or add pavements to the net")
    if shapely.intersects(ground.carriageway, shapely.Point(way[-1])):
        message = f"ends on the carriageway, at [{way[-1][0]:.1f}, {way[-1][1]:.1f}]"
        raise problem(message, "end it on a pavement")
    junction = _junction_crossed(files.net, on_way)
    if junction is not None:
        message = f"crosses the road inside junction {junction!r}, where priority and signals on foot are not known"
        remedy = "let it cross the lanes before or behind the junction, or on a crossing of the net without signals"
        raise problem(message, remedy)
    vehicle = routes.vehicles[document.vehicles[player]]
    return OpenPlayer(
        route=way_table(way, ground.surface),
        edges=vehicle.edges,
        vehicle_type=routes.types[vehicle.vehicle_type],
    )


def _junction_crossed(net: Net, way: WalkersWay) -> str | None:
    """The first junction inside which a way crosses a lane of traffic; None if there is none. A marked crossing may lie
    in a junction without signals: the walker has priority there, whichever way a vehicle goes."""
    for edge in net.getEdges(withInternal=True):
        has_signals = any(link.getTLSID() for link in edge.getFromNode().getConnections())
        if edge.getFunction() != "internal" or (way.marked and not has_signals):
            continue
        for lane in edge.getLanes():
            line = lane_line(lane)
            is_road = any(lane.allows(user) for user in USERS) and np.ptp(line, axis=0).any()
            if is_road and way.line.intersects(shapely.LineString(line)):
                return str(edge.getFromNode().getID())
    return None
