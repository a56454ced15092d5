"""How SUMO's traffic gets past an obstacle on a lane.

    python docs/scenes/obstacles.py

lets 60 vehicles depart on a road of 600 m, one every 2.5 s on a random lane, and prints the table of docs/junctions.md:
how many of them have arrived after 180 s, and how many passed through the place of the obstacle.
"""

from __future__ import annotations

import subprocess
import tempfile
from pathlib import Path

import libsumo
import sumo

from harness.sumo.insertion import OBSTACLE_TYPE, TYPES_XML, stand

_NODES = '<nodes><node id="a" x="0" y="0"/><node id="b" x="300" y="0"/><node id="c" x="600" y="0"/></nodes>'
_EDGE = '<edge id="{}" from="{}" to="{}" numLanes="{}" speed="13.89" spreadType="right"/>'
_STEP_S, _STEPS, _VEHICLES, _EVERY = 0.1, 1800, 60, 25
_FRONT_M, _LENGTH_M, _WIDTH_M = 200.0, 5.0, 1.8
_MODELS = {
    "changes take no time": ("--lanechange.duration", "0"),
    "changes take 2 s": ("--lanechange.duration", "2"),
    "sublane model": ("--lateral-resolution", "0.8"),
}


def main() -> None:
    """Print the table."""
    print("| lanes | lane changes | arrived without an obstacle | with it | passed through it |")
    print("| --- | --- | --- | --- | --- |")
    for lanes in (2, 1):
        for model, options in _MODELS.items():
            free, _ = _run(lanes, options, blocked=False)
            arrived, through = _run(lanes, options, blocked=True)
            print(f"| {lanes} | {model} | {free} | {arrived} | {through} |")


def _run(lanes: int, options: tuple[str, ...], *, blocked: bool) -> tuple[int, int]:
    """Vehicles that arrived, and those that were in the obstacle's place."""
    vehicle, through, arrived = libsumo.vehicle, set(), 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        common = ("--step-length", str(_STEP_S), "--collision.action", "none", "--time-to-teleport", "-1")
        files = ("--net-file", str(_net(folder, lanes)), "--route-files", str(folder / "types.rou.xml"))
        libsumo.start(["sumo", *files, *common, *options, "--no-step-log", "--no-warnings", "--seed", "1"])
        libsumo.route.add("whole", ["first", "second"])
        libsumo.route.add("short", ["first"])
        if blocked:
            vehicle.add("obstacle", "short", OBSTACLE_TYPE, depart="now", departLane="first", departSpeed="0")
            stand("obstacle", "first_0", _FRONT_M, _LENGTH_M)
        for step in range(_STEPS):
            if step % _EVERY == 0 and step // _EVERY < _VEHICLES:
                vehicle.add(f"v{step}", "whole", depart="now", departLane="random", departSpeed="10")
            libsumo.simulation.step()
            arrived += len(libsumo.simulation.getArrivedIDList())
            for each in set(vehicle.getIDList()) - {"obstacle"}:
                front_m, lateral = vehicle.getPosition(each)
                beside_m = abs(lateral + 3.2 * (lanes - 0.5))  # of their middles
                if (
                    beside_m < _WIDTH_M
                    and front_m > _FRONT_M - _LENGTH_M
                    and front_m - vehicle.getLength(each) < _FRONT_M
                ):
                    through.add(each)
        libsumo.close()
    return arrived, len(through) if blocked else 0


def _net(folder: Path, lanes: int) -> Path:
    edges = _EDGE.format("first", "a", "b", lanes) + _EDGE.format("second", "b", "c", lanes)
    (folder / "n.nod.xml").write_text(_NODES, encoding="utf-8")
    (folder / "n.edg.xml").write_text(f"<edges>{edges}</edges>", encoding="utf-8")
    (folder / "types.rou.xml").write_text(f"<routes>{TYPES_XML}</routes>", encoding="utf-8")
    program = Path(sumo.SUMO_HOME) / "bin" / "netconvert"
    files = ("-n", "n.nod.xml", "-e", "n.edg.xml", "-o", "n.net.xml")
    subprocess.run([program, *files], cwd=folder, check=True, capture_output=True)
    return folder / "n.net.xml"


if __name__ == "__main__":
    main()
