"""What the harness adds to SUMO's own step among background traffic: the same traffic with and without an arena."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import sumo

from benchmarks.bare_sumo import place_and_step, record_placements
from benchmarks.budget import Budget
from benchmarks.figures import Measured
from benchmarks.games import GAMES, CoastingGames
from benchmarks.sides import LapTimer, OnProgress, Side, best_rate, raw_numbers, take_turns
from harness.road.scene.open_scene import open_scene

BACKGROUND_VEHICLES = (0, 10, 50, 200)
_APPROACH_M, _TAPER_M, _EXIT_M = 1600.0, 30.0, 2400.0
_START_M = 700.0  # start of the players along the approach
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
[[non_ego]]
vehicle = "non_ego"
lane = "approach_2"
beside_ego_m = [8.0, 10.0]
speed_mps = [7.0, 8.0]
"""


def write_scene(folder: Path, background: int) -> Path:
    """Write the merge on longer roads, with so many background vehicles from the first step on, near the players."""
    folder.mkdir(parents=True)
    for name, text in (("nod", _NODES), ("edg", _EDGES), ("con", _CONNECTIONS)):
        (folder / f"long.{name}.xml").write_text(text, encoding="utf-8")
    program = shutil.which("netconvert", path=os.path.join(sumo.SUMO_HOME, "bin"))
    assert program is not None, "eclipse-sumo contains netconvert"
    sources = ["-n", "long.nod.xml", "-e", "long.edg.xml", "-x", "long.con.xml", "-o", "long.net.xml"]
    environment = {**os.environ, "SUMO_HOME": sumo.SUMO_HOME}
    subprocess.run([program, *sources], cwd=folder, env=environment, check=True, capture_output=True)
    net = folder / "long.net.xml"
    # netconvert writes the time into a comment. Without it the net stays the same, and its tiles are cached.
    net.write_text(re.sub(r"<!--.*?-->", "", net.read_text(encoding="utf-8"), flags=re.DOTALL), encoding="utf-8")
    vehicles = "".join(
        f'\n    <vehicle id="other{k}" type="other_car" route="{route}" depart="0" departLane="{lane}"'
        f' departPos="{position_m}" departSpeed="11"/>'
        for k, (route, lane, position_m) in enumerate(_nearest_places(background))
    )
    (folder / "long.rou.xml").write_text(f"<routes>{_CARS}{vehicles}\n</routes>", encoding="utf-8")
    (folder / "scene.toml").write_text(_SCENE, encoding="utf-8")
    return folder


def _nearest_places(count: int) -> list[tuple[str, int, float]]:
    """Route, lane and position along its first edge, nearest to the players first; none where the players start."""
    places = []
    for k in range(int((_APPROACH_M - 50.0) / _SPACING_M)):
        along_m = 10.0 + k * _SPACING_M
        if abs(along_m - _START_M) > _SPACING_M:
            places += [(abs(along_m - _START_M), ("through", lane, along_m)) for lane in (1, 2)]
    for k in range(int((_EXIT_M - 400.0) / _SPACING_M)):
        along_m = 30.0 + k * _SPACING_M
        places.append((_APPROACH_M + _TAPER_M + along_m - _START_M, ("onward", 1, along_m)))
    assert count <= len(places), "the roads are too short for so many vehicles"
    return [place for _, place in sorted(places)[:count]]


def arena_side(timer: LapTimer, folder: Path, steps: int) -> None:
    """Arena steps from the same start in every lap; the reset is not counted."""
    coasting = CoastingGames(open_scene(folder), GAMES)
    try:
        coasting.reset_all()
        for _ in range(steps):
            coasting.step(reset_ended=False)
        coasting.reset_all()
        timer.ready()
        while True:
            for _ in range(steps):
                coasting.step(reset_ended=False)
            reading = coasting.arena.reading
            background = float(reading.present.sum()) / GAMES if reading is not None else 0.0
            timer.finish_lap(steps, others=background)
            coasting.reset_all()
            timer.restart_clock()
    finally:
        coasting.arena.close()


def libsumo_side(timer: LapTimer, folder: Path, steps: int) -> None:
    """Steps of SUMO alone from that start, with the players placed where the arena had them: the same traffic."""
    coasting = CoastingGames(open_scene(folder), GAMES)
    try:
        coasting.reset_all()
        placements = record_placements(coasting, steps, reset_ended=False)
        coasting.reset_all()
        timer.ready()
        while True:
            for of_step in placements:
                place_and_step(of_step)
            timer.finish_lap(steps)
            coasting.reset_all()
            timer.restart_clock()
    finally:
        coasting.arena.close()


def traffic_overhead(budget: Budget, on_progress: OnProgress) -> Measured:
    """Time that an arena's step takes beyond SUMO's own step, as a share of SUMO's own."""
    values: dict[str, float] = {}
    details: dict[str, Any] = {"unit": "steps/s of all games", "games": GAMES}
    with tempfile.TemporaryDirectory(prefix="benchmark-") as scratch:
        for done, background in enumerate(BACKGROUND_VEHICLES):
            folder = write_scene(Path(scratch) / str(background), background)
            arguments = (folder, budget.traffic_steps)
            sides = {
                "arena": Side(run=arena_side, arguments=arguments),
                "libsumo": Side(run=libsumo_side, arguments=arguments),
            }

            def on_progress_of_scene(share: float, done: int = done) -> None:
                on_progress((done + share) / len(BACKGROUND_VEHICLES))

            repeats = budget.traffic_repeats
            laps = take_turns(sides, repeats=repeats, lap_s=0.0, on_progress=on_progress_of_scene)
            share = best_rate(laps["libsumo"]) / best_rate(laps["arena"]) - 1.0
            details[str(background)] = {"overhead": share, **raw_numbers(laps)}
            values[f"traffic_overhead_{background}"] = share
    return {key: values[key] for key in ("traffic_overhead_50", "traffic_overhead_200")}, details
