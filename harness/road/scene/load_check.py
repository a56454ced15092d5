"""The load check: SUMO loads a scene in a separate process before a campaign uses it, because a net may crash SUMO.

It validates the scene by SUMO's schemas and lets one background vehicle of each kind depart.
"""

from __future__ import annotations

import errno
import os
import re
import signal
import subprocess
import tempfile
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

from harness.config.scene import SCENE_FILE
from harness.errors import Problem, SimulationError, UsageError
from harness.road.demand.departures import background_departures
from harness.road.demand.route_writing import traveller_element
from harness.road.net.net_file import check_net
from harness.road.scene.open_scene import OpenScene
from harness.road.xml.sumo_program import run_program

PATIENCE_S, PATIENCE_S_PER_BYTE = 15.0, 2e-6  # time limit of a program: a constant, and a part per byte of the net
_INTERVAL_S, _AFTERWARDS_S = 5, 30  # between departures, and after the last one
_PLACE = re.compile(r"At line/column (\d+)/(\d+)")
_ABOUT_VEHICLES = re.compile(r"vtype|vehicle|car.following", re.IGNORECASE)
_LONGEST_MESSAGE = 500


def check_loads(scene: OpenScene) -> None:
    """Raise UsageError, with the file and SUMO's message, if SUMO can't load the scene."""
    net, routes = scene.net_file.resolve(), scene.routes.path
    patience_s = PATIENCE_S + PATIENCE_S_PER_BYTE * net.stat().st_size
    with tempfile.TemporaryDirectory(prefix="harness-load-check-") as name:
        folder = Path(name)
        types, vehicles = folder / "types.rou.xml", folder / "vehicles.rou.xml"
        types.write_text(scene.routes.types_xml, encoding="utf-8")
        end_s = _write_vehicles(scene, vehicles)
        if scene.net_warnings:  # the schema has no attributes but those that SUMO reads
            ElementTree.ElementTree(check_net(net).root).write(folder / "checked.net.xml")
            net = folder / "checked.net.xml"
        options = [
            *("--net-file", str(net), "--route-files", f"{types},{vehicles}", "--end", str(end_s)),
            *("--step-length", "1", "--collision.action", "none", "--time-to-teleport", "-1"),
            *("--no-step-log", "--no-warnings"),
            *("--xml-validation", "always", "--xml-validation.net", "always", "--xml-validation.routes", "always"),
        ]
        run = run_program("sumo", options, folder, patience_s)
    complaint = f"SUMO did not finish reading it within {patience_s:.0f} s" if run is None else _complaint(run)
    if complaint:
        about_net = not (str(types) in complaint or str(vehicles) in complaint or _ABOUT_VEHICLES.search(complaint))
        raise UsageError([_problem(complaint, scene.net_file.resolve() if about_net else routes, about_net)])
    if scene.document.warm_up_s and scene.has_background_traffic:
        try:
            _ = scene.warm_up
        except SimulationError as error:
            remedy = "correct the route file as SUMO's message says, or choose a shorter warm-up"
            raise UsageError.of(scene.folder / SCENE_FILE, "warm_up_s", str(error), remedy) from None


def _write_vehicles(scene: OpenScene, file: Path) -> int:
    """Write one background vehicle of each kind, one after another. Returns the end time in s. Raises OSError."""
    players = set(scene.document.vehicles)
    departures = background_departures(scene.routes, players, scene.document.traffic_window_s)
    kinds = {replace(each, name="", depart_s=0.0, stops=()): each for each in departures}
    root = ElementTree.Element("routes")
    for k, each in enumerate(kinds.values()):
        root.append(traveller_element(each, name=each.name, depart_s=_INTERVAL_S * k))
    if not kinds:
        ElementTree.SubElement(root, "vType", id="harness_unused")  # the schema forbids an empty document
    ElementTree.ElementTree(root).write(file, encoding="utf-8", xml_declaration=True)
    return _INTERVAL_S * len(kinds) + _AFTERWARDS_S if kinds else 0


def _complaint(run: subprocess.CompletedProcess[str]) -> str:
    if run.returncode == -getattr(signal, "SIGXFSZ", 0):  # the disk or its quota is full: not an error of the scene
        raise OSError(errno.EFBIG, os.strerror(errno.EFBIG))
    if run.returncode < 0:
        return f"SUMO died of {signal.Signals(-run.returncode).name} {run.stderr}"
    errors = [line for line in run.stderr.splitlines() if not line.startswith(("Warning", "Quitting"))]
    return "\n".join(errors) or f"SUMO ended with exit code {run.returncode}" if run.returncode else ""


def _problem(complaint: str, file: Path, about_net: bool) -> Problem:
    place = _PLACE.search(complaint)
    key = f"line {place[1]}, column {place[2]}" if place and str(file) in complaint else ""
    lines = [line.strip().removeprefix("Error: ") for line in complaint.splitlines()]
    message = "; ".join(dict.fromkeys(line for line in lines if line and not line.startswith(("In file", "At line"))))
    remedy = "build it with netconvert or netedit" if about_net else "correct it as SUMO's message says"
    return Problem(str(file), key, f"SUMO can't load it: {message[:_LONGEST_MESSAGE]}", remedy)
