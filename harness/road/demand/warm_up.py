"""The warm-up: background traffic that is on the road when a game begins.

SUMO runs the background traffic alone for the time of the warm-up, several times with different seeds, in separate
processes. The vehicles at the end of each run are a snapshot. A game draws one of them and puts its vehicles on the
road at once, each with its lane, place, speed, speed factor, remaining route and remaining stops. Vehicles that wait to
depart, and parked ones, are left out. A person enters the traffic in the first step of the game, on its edge, with the
rest of its walk. The snapshots are the same in training and in assessment, and are cached.
"""

from __future__ import annotations

import logging
import os
import tempfile
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from xml.etree import ElementTree

from pydantic import TypeAdapter

from harness.config.scene import Scene
from harness.errors import SimulationError, UsageError
from harness.files import write_atomically
from harness.game.seeding import between, generator_of, seed_of
from harness.road.demand.route_file import Departure, Motion, RouteFile
from harness.road.demand.route_writing import traveller_element
from harness.road.xml.angles import heading_rad_of
from harness.road.xml.sumo_program import cached_file, run_program
from harness.road.xml.xml_file import parse_xml

SNAPSHOTS = 20
LANE_CHANGE_S = 2.0
"""Duration of a lane change of background traffic."""
_ENDING = ".warm"  # of a vehicle's name: a flow numbers its later vehicles anew
_PATIENCE_S = 300.0
_LOGGER = logging.getLogger("harness.preparation")


@dataclass(frozen=True, kw_only=True)
class Snapshot:
    """The background traffic at the end of a warm-up, and the density that it had."""

    density: float
    vehicles: tuple[Departure, ...]


_CONTENT = TypeAdapter(tuple[Snapshot, ...])


def snapshots(document: Scene, routes: RouteFile, net_file: Path) -> tuple[Snapshot, ...]:
    """The snapshots of a scene, from the cache if it has them. Raises SimulationError if SUMO fails."""
    players = set(document.vehicles)
    drawn = [_drawn(document, routes, players, k) for k in range(SNAPSHOTS)]
    options = _options(document)

    def write(file: Path) -> None:
        done: list[Snapshot] = []
        run = partial(_run, routes=routes, net_file=net_file.resolve(), options=options)
        with ThreadPoolExecutor(os.cpu_count() or 1) as threads:
            vehicles = threads.map(run, (departures for _, departures in drawn), range(SNAPSHOTS))
            for (density, _), on_road in zip(drawn, vehicles, strict=True):
                done.append(Snapshot(density=density, vehicles=tuple(on_road)))
                extra = {"done": len(done), "total": SNAPSHOTS}
                _LOGGER.info("warming up the background traffic, once per scene", extra=extra)
        write_atomically(file, _CONTENT.dump_json(tuple(done)))

    return _CONTENT.validate_json(
        cached_file("warm-up/.json", net_file, (options, routes.types_xml, drawn), write).read_bytes()
    )


def _drawn(document: Scene, routes: RouteFile, players: set[str], k: int) -> tuple[float, list[Departure]]:
    generator = generator_of("warm-up", k)
    varied = document.varies.traffic_density
    density = 1.0 if varied is None else between(varied, generator.random())
    begin_s = document.traffic_begin_s
    return density, routes.departures(
        players, begin_s + document.warm_up_s, generator, begin_s=begin_s, density=density
    )


def _options(document: Scene) -> tuple[str, ...]:
    step_s = document.step_length_s
    end_s = round(document.warm_up_s / step_s) * step_s
    return (
        *("--step-length", str(step_s), "--collision.action", "none", "--time-to-teleport", "-1"),
        *("--lanechange.duration", str(LANE_CHANGE_S), "--end", f"{end_s + step_s:.3f}"),
        *("--save-state.times", f"{end_s:.3f}", "--save-state.files", "state.xml", "--save-state.precision", "6"),
        *("--fcd-output", "motion.xml", "--device.fcd.begin", f"{end_s - step_s:.3f}", "--precision", "6"),
        *("--no-step-log", "--no-warnings", "--xml-validation", "never"),
    )


def _run(
    departures: Sequence[Departure], k: int, *, routes: RouteFile, net_file: Path, options: Sequence[str]
) -> list[Departure]:
    if not departures:
        return []
    with tempfile.TemporaryDirectory(prefix="harness-warm-up-") as name:
        folder = Path(name)
        (folder / "types.rou.xml").write_text(routes.types_xml, encoding="utf-8")
        root = ElementTree.Element("routes")
        root.extend(traveller_element(each, each.name, each.depart_s) for each in departures)
        ElementTree.ElementTree(root).write(folder / "vehicles.rou.xml", encoding="utf-8", xml_declaration=True)
        files = ("--net-file", str(net_file), "--route-files", "types.rou.xml,vehicles.rou.xml")
        run = run_program("sumo", [*files, *options, "--seed", str(seed_of("warm-up", k) % 2**31)], folder, _PATIENCE_S)
        if run is None:
            raise SimulationError(f"SUMO did not finish the warm-up within {_PATIENCE_S:.0f} s")
        if run.returncode:
            raise SimulationError(f"SUMO failed in the warm-up: {run.stderr.strip()[-300:]}")
        try:
            return _vehicles(folder, {each.name: each for each in departures}, routes, options)
        except (UsageError, KeyError, ValueError, IndexError) as error:
            raise SimulationError(f"SUMO's state after the warm-up could not be read: {error!r}") from error


def _vehicles(
    folder: Path, departures: Mapping[str, Departure], routes: RouteFile, options: Sequence[str]
) -> list[Departure]:
    steps = parse_xml(folder / "motion.xml").findall("timestep")
    end_s = float(options[options.index("--save-state.times") + 1])
    first_s = float(options[options.index("--device.fcd.begin") + 1])
    seen = [each for step in steps if abs(float(step.get("time", "nan")) - first_s) < 1e-6 for each in step]
    moving = {each.get("id", ""): each for each in seen if each.tag == "vehicle"}
    walking = [(each, departures[each.get("id", "")]) for each in seen if each.tag == "person"]
    people = [
        _person(each, person, routes) for each, person in walking if person.edges.count(each.get("edge", "")) == 1
    ]
    return people + [
        _vehicle(state, moving[state.get("id", "")], departures[state.get("id", "")], routes=routes, end_s=end_s)
        for state in parse_xml(folder / "state.xml").findall("vehicle")
        if state.get("id") in moving and state.find("stop[1][@started][@parking]") is None
    ]


def _vehicle(
    state: ElementTree.Element, moving: ElementTree.Element, departure: Departure, *, routes: RouteFile, end_s: float
) -> Departure:
    lane, passed = moving.attrib["lane"], int(state.attrib["state"].split()[2])
    edges = departure.edges[passed:]
    if not lane.startswith(":") and lane.rpartition("_")[0] != edges[0]:
        raise ValueError(f"vehicle {departure.name} is on lane {lane}, not on edge {edges[0]}")
    waiting = state.findall("stop")
    stops = tuple(stop.later(-end_s) for stop in departure.stops[len(departure.stops) - len(waiting) :])
    if stops and waiting[0].get("started") is not None:
        stops = (replace(stops[0], duration_s=float(waiting[0].get("duration", "0"))), *stops[1:])
    return replace(
        departure,
        name=departure.name + _ENDING,
        edges=edges,
        depart_s=0.0,
        lane=lane,
        position=moving.attrib["pos"],
        speed="0",
        speed_factor=float(state.attrib["speedFactor"]),
        lateral="",
        stops=stops,
        motion=_motion(moving, departure, routes),
    )


def _person(moving: ElementTree.Element, departure: Departure, routes: RouteFile) -> Departure:
    """The departure of a person at the beginning of a game, from its motion on an edge that it walks along once."""
    return replace(
        departure,
        name=departure.name + _ENDING,
        edges=departure.edges[departure.edges.index(moving.attrib["edge"]) :],
        depart_s=0.0,
        position=moving.attrib["pos"],
        motion=_motion(moving, departure, routes),
    )


def _motion(moving: ElementTree.Element, departure: Departure, routes: RouteFile) -> Motion:
    kind = routes.types[departure.vehicle_type]
    return Motion(
        x_m=float(moving.attrib["x"]),
        y_m=float(moving.attrib["y"]),
        heading_rad=float(heading_rad_of(float(moving.attrib["angle"]))),
        speed_mps=float(moving.attrib["speed"]),
        length_m=kind.length_m,
        width_m=kind.width_m,
    )
