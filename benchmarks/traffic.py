"""What the harness adds to SUMO's own step where SUMO drives others: the same traffic, with an arena and without."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import sumo

from benchmarks.bare import place_and_step, record
from benchmarks.budget import Budget
from benchmarks.games import GAMES, Played
from benchmarks.sides import Pace, Side, Tell, best, described, take_turns
from harness.traffic.scene import open_scene

OTHERS = (0, 10, 50, 200)
_APPROACH_M, _TAPER_M, _EXIT_M = 1600.0, 30.0, 2400.0
_START_M = 700.0  # of the players, along the approach
_SPACING_M = 25.0

_NODES = f"""<nodes>
    <node id="start" x="0" y="0" type="dead_end"/>
    <node id="taper" x="{_APPROACH_M}" y="0" type="priority" shape="{_APPROACH_M},-9.40 {_APPROACH_M},0.00
        {_APPROACH_M + _TAPER_M},-3.20 {_APPROACH_M + _TAPER_M},-9.40"/>
    <node id="finish" x="{_APPROACH_M + _TAPER_M + _EXIT_M}" y="-3.2" type="dead_end"/>
</nodes>"""
_EDGES = f"""<edges>
    <edge id="approach" from="start" to="taper" numLanes="3" speed="13.89" spreadType="right">
        <lane index="0" allow="emergency authority" width="3.00"/>
    </edge>
    <edge id="exit" from="taper" to="finish" numLanes="2" speed="13.89" spreadType="right"
        shape="{_APPROACH_M},-3.20 {_APPROACH_M + _TAPER_M + _EXIT_M},-3.20">
        <lane index="0" allow="emergency authority" width="3.00"/>
    </edge>
</edges>"""
_CONNECTIONS = """<connections>
    <connection from="approach" to="exit" fromLane="0" toLane="0"/>
    <connection from="approach" to="exit" fromLane="1" toLane="1"/>
</connections>"""
_CARS = """
    <vType id="ego_car" length="4.6" width="1.8" maxSpeed="40" speedFactor="1.0" speedDev="0.0"/>
    <vType id="person_car" length="4.6" width="1.8" maxSpeed="40" speedFactor="1.0" speedDev="0.05"/>
    <vType id="other_car" length="4.6" width="1.8"/>
    <route id="through" edges="approach exit"/>
    <route id="onward" edges="exit"/>
    <vehicle id="ego" type="ego_car" route="through" depart="0"/>
    <vehicle id="non_ego" type="person_car" route="through" depart="0"/>"""
_SCENE = f"""name = "long_merge"
net = "long.net.xml"
routes = "long.rou.xml"
time_limit_s = 60.0
goal = {{ edge = "exit", position_m = 1000.0 }}
[ego]
vehicle = "ego"
lane = "approach_1"
position_m = [{_START_M}, {_START_M}]
speed_mps = [7.0, 8.0]
[non_ego]
vehicle = "non_ego"
lane = "approach_2"
beside_ego_m = [8.0, 10.0]
speed_mps = [7.0, 8.0]
"""


def write_scene(folder: Path, others: int) -> Path:
    """The merge on longer roads, with so many others on it from the first step on: those nearest to the players."""
    folder.mkdir(parents=True)
    for name, text in (("nod", _NODES), ("edg", _EDGES), ("con", _CONNECTIONS)):
        (folder / f"long.{name}.xml").write_text(text, encoding="utf-8")
    program = shutil.which("netconvert", path=os.path.join(sumo.SUMO_HOME, "bin"))
    assert program is not None, "eclipse-sumo brings it"
    sources = ["-n", "long.nod.xml", "-e", "long.edg.xml", "-x", "long.con.xml", "-o", "long.net.xml"]
    environment = {**os.environ, "SUMO_HOME": sumo.SUMO_HOME}
    subprocess.run([program, *sources], cwd=folder, env=environment, check=True, capture_output=True)
    net = folder / "long.net.xml"  # its comment holds the time: without it, the tiles made of it are made once
    net.write_text(re.sub(r"<!--.*?-->", "", net.read_text(encoding="utf-8"), flags=re.DOTALL), encoding="utf-8")
    vehicles = "".join(
        f'\n    <vehicle id="other{k}" type="other_car" route="{route}" depart="0" departLane="{lane}"'
        f' departPos="{position_m}" departSpeed="11"/>'
        for k, (route, lane, position_m) in enumerate(_nearest_places(others))
    )
    (folder / "long.rou.xml").write_text(f"<routes>{_CARS}{vehicles}\n</routes>", encoding="utf-8")
    (folder / "scene.toml").write_text(_SCENE, encoding="utf-8")
    return folder


def _nearest_places(others: int) -> list[tuple[str, int, float]]:
    """Route, lane and position along its first edge, nearest to the players first; nobody where they start."""
    places = []
    for k in range(int((_APPROACH_M - 50.0) / _SPACING_M)):
        along_m = 10.0 + k * _SPACING_M
        if abs(along_m - _START_M) > _SPACING_M:
            places += [(abs(along_m - _START_M), ("through", lane, along_m)) for lane in (1, 2)]
    for k in range(int((_EXIT_M - 400.0) / _SPACING_M)):
        along_m = 30.0 + k * _SPACING_M
        places.append((_APPROACH_M + _TAPER_M + along_m - _START_M, ("onward", 1, along_m)))
    assert others <= len(places), "the roads are too short for so many"
    return [place for _, place in sorted(places)[:others]]


def arena_side(pace: Pace, folder: Path, steps: int) -> None:
    """Arena steps from the same start, lap after lap; starting is not counted."""
    played = Played(open_scene(folder), GAMES)
    try:
        played.begin_again()
        for _ in range(steps):
            played.step(restart=False)
        played.begin_again()
        pace.begin()
        while True:
            for _ in range(steps):
                played.step(restart=False)
            reading = played.arena.reading
            pace.lap(steps, others=float(reading.present.sum()) / GAMES if reading is not None else 0.0)
            played.begin_again()
            pace.start_clock()
    finally:
        played.arena.close()


def libsumo_side(pace: Pace, folder: Path, steps: int) -> None:
    """SUMO's steps alone from that start, with the players placed where the arena had them: the same traffic."""
    played = Played(open_scene(folder), GAMES)
    try:
        played.begin_again()
        placements = record(played, steps, restart=False)
        played.begin_again()
        pace.begin()
        while True:
            for each in placements:
                place_and_step(each)
            pace.lap(steps)
            played.begin_again()
            pace.start_clock()
    finally:
        played.arena.close()


def traffic_overhead(budget: Budget, tell: Tell) -> tuple[dict[str, float], dict[str, Any]]:
    """What an arena's step takes beyond SUMO's own, as a share of SUMO's own."""
    values: dict[str, float] = {}
    details: dict[str, Any] = {"unit": "steps/s of all games", "games": GAMES}
    with tempfile.TemporaryDirectory(prefix="benchmark-") as scratch:
        for done, others in enumerate(OTHERS):
            folder = write_scene(Path(scratch) / str(others), others)
            arguments = (folder, budget.traffic_steps)
            sides = {"arena": Side(arena_side, arguments), "libsumo": Side(libsumo_side, arguments)}

            def tell_of_all(share: float, done: int = done) -> None:
                tell((done + share) / len(OTHERS))

            laps = take_turns(sides, budget.traffic_repeats, 0.0, tell_of_all)
            share = best(laps["libsumo"]) / best(laps["arena"]) - 1.0
            details[str(others)] = {"overhead": share, **described(laps)}
            values[f"traffic_overhead_{others}"] = share
    return {key: values[key] for key in ("traffic_overhead_50", "traffic_overhead_200")}, details
