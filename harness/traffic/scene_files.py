"""The files of a scene: they are read and checked before the scene is opened."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from pydantic import ConfigDict
from sumolib.net import Net

from harness.config.scene import PlainFile, Scene
from harness.config.toml_reading import Document, nearest
from harness.errors import UsageError
from harness.files import leads_out
from harness.traffic import network
from harness.traffic.net_file import check_net
from harness.traffic.route_file import RouteFile
from harness.traffic.route_reading import read_route_file


class NamedFiles(Document):
    """The files that a scene names. They are checked even if the rest of the document is invalid."""

    model_config = ConfigDict(extra="ignore")
    net: PlainFile
    routes: PlainFile
    additional: tuple[PlainFile, ...] = ()


def _with_ego_type(routes: RouteFile, document: Scene | None, ego_type: str | None) -> RouteFile:
    if ego_type is None or document is None or document.ego.vehicle not in routes.vehicles:
        return routes
    if ego_type not in routes.types:
        message, remedy = f"has no vehicle type {ego_type!r} for the ego", nearest(ego_type, routes.types)
        raise UsageError.of(routes.path, "vType", message, remedy)
    ego = replace(routes.vehicles[document.ego.vehicle], vehicle_type=ego_type)
    return replace(routes, vehicles={**routes.vehicles, document.ego.vehicle: ego})


def check_within(path: Path, folder: Path) -> None:
    """Raise UsageError if a path is a link that leads out of the folder."""
    if leads_out(path, folder):
        message = "is a link that leads out of the scene's folder"
        raise UsageError.of(path, "", message, "replace the link by a copy of its target")


def checked_net(path: Path, folder: Path) -> Net:
    """The net of a scene. Raises UsageError if it is not one that can be used."""
    check_within(path, folder)
    check_net(path)
    return network.read_net(path)


def checked_routes(paths: Sequence[Path], folder: Path, document: Scene | None, ego_type: str | None) -> RouteFile:
    """The route files of a scene as one, the ego with another vehicle type if one is given. Raises UsageError."""
    for path in paths:
        check_within(path, folder)
    return _with_ego_type(read_route_file(*paths), document, ego_type)
