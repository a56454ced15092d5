"""Small scenes that tests build, and initial states with given poses in them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from harness.game.human_factors import HumanFactors
from harness.game.initial_state import InitialState, draw_initial_state
from harness.road.scene.open_scene import OpenScene, open_scene
from harness.road.xml.sumo_program import run_program
from tests.support.roads import nearest_station_m
from tests.support.tiny import PATIENCE_S

STRAIGHT_NODES = '<node id="a" x="0" y="0"/><node id="b" x="300" y="0"/>'
STRAIGHT_EDGES = '<edge id="road" from="a" to="b" numLanes="2" speed="13.89" spreadType="right"/>'
STRAIGHT = {"ego": ("road", "road_0"), "non_ego": ("road", "road_1"), "goal": "road"}
THREE_PEOPLE = {
    "ego": ("road", "road_0"),
    "non_ego": ("road", "road_1"),
    "non_ego_2": ("road", "road_0", "[60.0, 70.0]"),
    "non_ego_3": ("road", "road_1", "[60.0, 70.0]"),
    "goal": "road",
}
RIGHT_Y, LEFT_Y = -4.8, -1.6  # centre lines of its lanes

CROSSING_NODES = "".join(
    f'<node id="{name}" x="{x}" y="{y}" type="priority"/>'
    for name, x, y in (("w", -100, 0), ("c", 0, 0), ("e", 100, 0), ("s", 0, -100), ("n", 0, 100))
)
CROSSING_EDGES = "".join(
    f'<edge id="{a}{b}" from="{a}" to="{b}" numLanes="1" speed="13.89" spreadType="right" priority="{priority}"/>'
    for a, b, priority in (("w", "c", 2), ("c", "e", 2), ("s", "c", 1), ("c", "n", 1))
)
CROSSING = {"ego": ("wc ce", "wc_0"), "non_ego": ("sc ce", "sc_0"), "goal": "ce"}

ZIPPER_NODES = '<node id="a" x="0" y="0"/><node id="z" x="150" y="0" type="zipper"/><node id="b" x="300" y="0"/>'
ZIPPER_EDGES = (
    '<edge id="wide" from="a" to="z" numLanes="3" speed="13.89" spreadType="right"/>'
    '<edge id="narrow" from="z" to="b" numLanes="2" speed="13.89" spreadType="right"/>'
)
ZIPPER = {"ego": ("wide narrow", "wide_2"), "non_ego": ("wide narrow", "wide_1"), "goal": "narrow"}

CARS = """
    <vType id="ego_car" length="4.6" width="1.8" maxSpeed="40" speedFactor="1.0" speedDev="0.0"/>
    <vType id="person_car" length="4.6" width="1.8" maxSpeed="40" speedFactor="1.0" speedDev="0.0" sigma="0"/>
    <vType id="van" length="6.0" width="2.0" maxSpeed="30"/>
"""


def run_sumo_program(name: str, options: Sequence[str], folder: Path) -> str:
    """Run a program of the installed SUMO in a folder; it must succeed. What it complained of."""
    done = run_program(name, options, folder, PATIENCE_S)
    assert done is not None
    assert done.returncode == 0, done.stderr
    return done.stderr


def build_scene(
    folder: Path,
    nodes: str = STRAIGHT_NODES,
    edges: str = STRAIGHT_EDGES,
    places: Mapping[str, Sequence[str]] = STRAIGHT,
    others: str = "",
    cars: str = CARS,
    goal_m: float = 250.0,
    time_limit_s: float = 20.0,
    followed_share: float = 0.0,
    net_options: Sequence[str] = (),
) -> OpenScene:
    """Write a scene's folder with a net built by netconvert, and open it.

    `places` are the players' edges, lanes and, if not 30 to 40 m, ranges of their starts; and the edge of the goal.
    """
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "n.nod.xml").write_text(f"<nodes>{nodes}</nodes>")
    (folder / "n.edg.xml").write_text(f"<edges>{edges}</edges>")
    files = ("-n", "n.nod.xml", "-e", "n.edg.xml", "-o", "n.net.xml")
    run_sumo_program("netconvert", [*files, *net_options], folder)
    players = {name: place for name, place in places.items() if name != "goal"}
    vehicles = "".join(
        f"""<vehicle id="{name}" type="{"ego" if name == "ego" else "person"}_car" depart="0">
        <route edges="{place[0]}"/></vehicle>"""
        for name, place in players.items()
    )
    (folder / "n.rou.xml").write_text(f"<routes>{cars}{vehicles}{others}</routes>")
    starts = {
        name: f"""{{ vehicle = "{name}", lane = "{place[1]}", position_m = {[*place, "[30.0, 40.0]"][2]}, """
        "speed_mps = [8.0, 12.0] }"
        for name, place in players.items()
    }
    people = [start for name, start in starts.items() if name != "ego"]
    (folder / "scene.toml").write_text(
        f"""name = "small"
net = "n.net.xml"
routes = "n.rou.xml"
time_limit_s = {time_limit_s}
followed_share = {followed_share}
goal = {{ edge = "{places["goal"]}", position_m = {goal_m} }}
ego = {starts["ego"]}
non_ego = [{", ".join(people)}]
"""
    )
    return open_scene(folder)


def drawn(scene: OpenScene, *parts: str | int, present: Sequence[float] | None = None) -> InitialState:
    """An initial state drawn from named parts."""
    players = len(scene.world.roles)
    starts = scene.start_distribution([HumanFactors()] * players, present or [1.0] * players)
    return draw_initial_state(starts, *parts)


def placed(scene: OpenScene, *poses: tuple[float, float, float, float] | None) -> InitialState:
    """An initial state with the players' centres at x_m, y_m, heading_rad, speed_mps; None: the player is absent."""
    start = drawn(scene, "placed")
    values = np.array([pose or (40.0, LEFT_Y, 0.0, 0.0) for pose in poses])
    return replace(
        start,
        x_m=values[:, 0],
        y_m=values[:, 1],
        heading_rad=values[:, 2],
        speed_mps=values[:, 3],
        position_m=values[:, 0] + 0.5 * scene.world.length_m,
        station_m=nearest_station_m(scene.world.road.routes, values[None, :, 0], values[None, :, 1])[0],
        present=np.array([pose is not None for pose in poses]),
    )
