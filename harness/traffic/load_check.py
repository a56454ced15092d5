"""A scene, loaded by SUMO in processes of their own before anything rests on it: a net may make SUMO die.

Two programs of the installed SUMO read it: `sumo`, held to SUMO's schemas, which also lets one of each kind of the
other vehicles depart; and netconvert, which copies the net when several games are played side by side.
"""

from __future__ import annotations

import errno
import os
import re
import signal
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from xml.etree import ElementTree

import sumo

from harness.errors import Problem, UsageError
from harness.traffic.departures import others_of
from harness.traffic.scene import OpenScene

PATIENCE_S, PATIENCE_S_PER_BYTE = 15.0, 2e-6
_APART_S, _AFTERWARDS_S = 5, 30
_PLACE = re.compile(r"At line/column (\d+)/(\d+)")
_OF_VEHICLES = re.compile(r"vtype|vehicle|car.following", re.IGNORECASE)
_MOST_SAID = 500


def check_loads(scene: OpenScene) -> None:
    """Raise UsageError, naming the file and what SUMO says of it, unless SUMO loads the scene."""
    net, routes = scene.net_file.resolve(), scene.routes.path
    patience_s = PATIENCE_S + PATIENCE_S_PER_BYTE * net.stat().st_size
    with tempfile.TemporaryDirectory(prefix="harness-trial-") as name:
        folder = Path(name)
        types, vehicles = folder / "types.rou.xml", folder / "vehicles.rou.xml"
        types.write_text(scene.routes.types_xml, encoding="utf-8")
        end_s = _write_vehicles(scene, vehicles)
        commands = {
            "netconvert": ["-s", str(net), "--prefix", "g0_", "-o", "copy.net.xml", "--xml-validation", "never"],
            "sumo": [
                *("--net-file", str(net), "--route-files", f"{types},{vehicles}", "--end", str(end_s)),
                *("--step-length", "1", "--collision.action", "none", "--time-to-teleport", "-1"),
                *("--no-step-log", "--no-warnings"),
                *("--xml-validation", "always", "--xml-validation.net", "always", "--xml-validation.routes", "always"),
            ],
        }
        running = _started(commands, folder)
        try:
            said = {program: _said(process, patience_s) for program, process in running.items()}
        finally:
            for process in running.values():
                process.kill()
                process.wait()
                assert process.stderr is not None
                process.stderr.close()
    complaint = said["sumo"] or said["netconvert"]
    if complaint:
        of_net = not (str(types) in complaint or str(vehicles) in complaint or _OF_VEHICLES.search(complaint))
        raise UsageError([_problem(complaint, net if of_net else routes, of_net)])


def _write_vehicles(scene: OpenScene, file: Path) -> int:
    """One of each kind of other vehicle, one after another; when to stop. Raises OSError."""
    kinds = {
        (each.vehicle_type, each.edges, each.lane, each.position, each.speed): each
        for each in others_of(scene.routes, (player.vehicle for player in scene.document.players))
    }
    root = ElementTree.Element("routes")
    for k, each in enumerate(kinds.values()):
        start = {"departLane": each.lane, "departPos": each.position, "departSpeed": each.speed}
        named = {"id": each.name, "type": each.vehicle_type, "depart": str(_APART_S * k)}
        vehicle = ElementTree.SubElement(root, "vehicle", named | start)
        ElementTree.SubElement(vehicle, "route", edges=" ".join(each.edges))
    if not kinds:
        ElementTree.SubElement(root, "vType", id="harness_nobody")  # an empty document is against the schema
    ElementTree.ElementTree(root).write(file, encoding="utf-8", xml_declaration=True)
    return _APART_S * len(kinds) + _AFTERWARDS_S if kinds else 0


def _started(commands: Mapping[str, Sequence[str]], folder: Path) -> dict[str, subprocess.Popen[str]]:
    environment = {**os.environ, "SUMO_HOME": sumo.SUMO_HOME}
    return {
        program: subprocess.Popen(
            [Path(sumo.SUMO_HOME) / "bin" / program, *arguments],
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
        )
        for program, arguments in commands.items()
    }


def _said(process: subprocess.Popen[str], patience_s: float) -> str:
    """What a program complained of; nothing if it ended well."""
    try:
        said = process.communicate(timeout=patience_s)[1]
    except subprocess.TimeoutExpired:
        return f"SUMO did not finish reading it within {patience_s:.0f} s"
    if process.returncode == -getattr(signal, "SIGXFSZ", 0):  # the disk's fault, or its quota's: not the scene's
        raise OSError(errno.EFBIG, os.strerror(errno.EFBIG))
    if process.returncode < 0:
        return f"SUMO died of it ({signal.Signals(-process.returncode).name}) {said}"
    errors = [line for line in said.splitlines() if not line.startswith(("Warning", "Quitting"))]
    return "\n".join(errors) or f"SUMO ended with exit code {process.returncode}" if process.returncode else ""


def _problem(complaint: str, file: Path, of_net: bool) -> Problem:
    place = _PLACE.search(complaint)
    key = f"line {place[1]}, column {place[2]}" if place and of_net else ""
    lines = [line.strip().removeprefix("Error: ") for line in complaint.splitlines()]
    told = "; ".join(line for line in lines if line and not line.startswith(("In file", "At line")))
    remedy = "build it with netconvert or netedit" if of_net else "mend it as SUMO says"
    return Problem(str(file), key, f"SUMO can't load it: {told[:_MOST_SAID]}", remedy)
