"""The files of a scene, read and checked one by one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from sumolib.net import Net

from harness.config.scene import SCENE_FILE, PlainFile, Scene
from harness.config.toml_reading import Excerpt, nearest, read_document
from harness.errors import Problem, UsageError, collect
from harness.files import leads_out
from harness.road.demand.route_file import RouteFile
from harness.road.demand.route_reading import read_route_file
from harness.road.demand.trips import with_routes
from harness.road.demand.walks import with_walkers
from harness.road.net import network
from harness.road.net.net_file import check_net


@dataclass(frozen=True, kw_only=True)
class SceneFiles:
    """The contents of a scene's files. All trips of vehicles that may take part in a game have routes."""

    folder: Path
    document: Scene
    net: Net
    net_warnings: tuple[str, ...]
    """A line for each attribute of the net that SUMO ignores."""
    routes: RouteFile

    @property
    def file(self) -> Path:
        """The scene's document, which problems name."""
        return self.folder / SCENE_FILE


class NamedFiles(Excerpt):
    """The files that a scene names. They are checked even if the rest of the document is invalid."""

    net: PlainFile
    routes: PlainFile
    additional: tuple[PlainFile, ...] = ()


def read_scene(folder: Path, ego_type: str | None) -> SceneFiles:
    """Read the files of a scene. Raises UsageError with every problem found.

    `ego_type` is a vehicle type of the route file that replaces the type of the ego's vehicle.
    """
    problems: list[Problem] = []
    file = folder / SCENE_FILE
    _check_within(file, folder)
    document = collect(problems, lambda: read_document(file, Scene))
    named = document or collect([], lambda: read_document(file, NamedFiles))
    if named is None:
        raise UsageError(problems)
    net_file, route_files = folder / named.net, [folder / each for each in (named.routes, *named.additional)]
    read_net = collect(problems, lambda: _net(net_file, folder))
    net, net_warnings = read_net or (None, ())
    routes = collect(problems, lambda: _routes(route_files, folder, document, ego_type))
    if (
        document is not None and net is not None and routes is None
    ):  # players are not opened: their lanes are checked here
        for role, player in zip(document.roles, document.players, strict=True):
            if player.lane:
                collect(problems, partial(network.find_lane, net, file, f"{role}.lane", player.lane))
    if document is None or net is None or routes is None:
        raise UsageError(problems)
    routes = with_walkers(routes, document, net)
    players = [routes.vehicles[name] for name in document.vehicles if name in routes.vehicles]
    needed = [*players, *routes.within(*document.traffic_window_s)]
    routed = collect(problems, partial(with_routes, routes, net_file, net, needed))
    if routed is None or problems:
        raise UsageError(problems)
    return SceneFiles(folder=folder, document=document, net=net, net_warnings=net_warnings, routes=routed)


def _net(path: Path, folder: Path) -> tuple[Net, tuple[str, ...]]:
    _check_within(path, folder)
    warnings = check_net(path).warnings
    return network.read_net(path), warnings


def _routes(paths: Sequence[Path], folder: Path, document: Scene | None, ego_type: str | None) -> RouteFile:
    for path in paths:
        _check_within(path, folder)
    routes = read_route_file(*paths)
    if ego_type is None or document is None or document.ego.vehicle not in routes.vehicles:
        return routes
    if ego_type not in routes.types:
        message, remedy = f"has no vehicle type {ego_type!r} for the ego", nearest(ego_type, routes.types)
        raise UsageError.of(routes.path, "vType", message, remedy)
    ego = replace(routes.vehicles[document.ego.vehicle], vehicle_type=ego_type)
    return replace(routes, vehicles={**routes.vehicles, document.ego.vehicle: ego})


def _check_within(path: Path, folder: Path) -> None:
    if leads_out(path, folder):
        message = "is a link that leads out of the scene's folder"
        raise UsageError.of(path, "", message, "replace the link by a copy of its target")
