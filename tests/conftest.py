"""Fixtures that more than one test file uses."""

from __future__ import annotations

import gc
from collections.abc import Callable, Generator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, settings

from harness.game.arrays import FloatArray
from harness.game.quantities import Quantities
from harness.game.state import Bodies, State
from harness.game.world import World
from harness.road.scene.open_scene import OpenScene, open_scene
from tests.support.forked_command import remember_environment
from tests.support.repository import REPOSITORY, slow_tests
from tests.support.roads import nearest_station_m
from tests.support.scenes import build_scene, run_sumo_program
from tests.support.shared import shared_folder

# A busy machine exceeds any deadline now and then, and makes examples slowly. They are the same in every run.
settings.register_profile("harness", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("harness")


def pytest_configure() -> None:
    """Make the session's shared folder in the first process, before pytest-xdist starts others."""
    shared_folder()


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Exclude what collection has loaded from garbage collection, which takes long to go through it."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()
        gc.freeze()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests of tests/slow_tests.txt as slow."""
    slow = slow_tests()
    for item in items:
        test = item.nodeid.partition("[")[0]
        if test in slow or test.partition("::")[0] in slow:
            item.add_marker(pytest.mark.slow)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup() -> None:
    """Let what libraries and earlier tests have set in the environment be part of what commands are forked in."""
    remember_environment()


@pytest.fixture(scope="session")
def repository() -> Path:
    """The top level of the repository: networks/, personas/ and campaigns/ lie in it."""
    return REPOSITORY


@pytest.fixture(scope="session")
def merge(repository: Path) -> OpenScene:
    """The scene tests/data/merge, opened: a merge whose numbers stay while networks/merge is worked on."""
    return open_scene(repository / "tests" / "data" / "merge")


@pytest.fixture(scope="session")
def straight(tmp_path_factory: pytest.TempPathFactory) -> OpenScene:
    """A road of 300 m with two lanes and the two players."""
    return build_scene(tmp_path_factory.mktemp("scenes") / "straight")


@pytest.fixture(scope="session")
def build_net(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """`build_net(nodes, edges, connections="", *options)`: a net made by netconvert of the insides of its sources."""

    def build(nodes: str, edges: str, connections: str = "", *options: str) -> Path:
        folder = tmp_path_factory.mktemp("net")
        sources = {"nodes": nodes, "edges": edges, "connections": connections}
        for tag, text in sources.items():
            (folder / f"{tag}.xml").write_text(f"<{tag}>{text}</{tag}>", encoding="utf-8")
        given = ["-n", "nodes.xml", "-e", "edges.xml", "-x", "connections.xml", *options]
        run_sumo_program("netconvert", [*given, "-o", "net.net.xml"], folder)
        return folder / "net.net.xml"

    return build


@pytest.fixture(scope="session")
def generate_net(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """`generate_net(*options)`: a net made by netgenerate."""

    def generate(*options: str) -> Path:
        folder = tmp_path_factory.mktemp("net")
        run_sumo_program("netgenerate", [*options, "-o", "net.net.xml"], folder)
        return folder / "net.net.xml"

    return generate


@pytest.fixture(scope="session")
def moment() -> Callable[..., Quantities]:
    """`moment(world, players, others=())`: the quantities of one game, of cars given as dicts.

    A car has x_m and y_m, and where it is not the usual heading_rad, speed_mps, acceleration_mps2, steering_rad,
    outcome, present, length_m, width_m (the size of a player is the world's).
    """

    def make(world: World, players: Sequence[dict[str, Any]], others: Sequence[dict[str, Any]] = ()) -> Quantities:
        state = State.empty(1, len(players))
        state.present[:] = True
        state.speed_mps[:], state.friction[:] = 10.0, world.actuators.friction
        for p, car in enumerate(players):
            for name, value in car.items():
                getattr(state, name)[0, p] = value
        usual = {"heading_rad": 0.0, "speed_mps": 10.0, "length_m": 4.6, "width_m": 1.8, "present": True}
        more = [{**usual, **other} for other in others]

        def column(name: str, own: FloatArray) -> FloatArray:
            return np.concatenate((own, [other[name] for other in more]))[None].astype(own.dtype)

        bodies = Bodies(
            column("x_m", state.x_m[0]),
            column("y_m", state.y_m[0]),
            column("heading_rad", state.heading_rad[0]),
            column("speed_mps", state.speed_mps[0]),
            column("length_m", world.length_m),
            column("width_m", world.width_m),
            column("present", state.present[0]),
        )
        routes, where = world.road.routes, (state.x_m, state.y_m)
        state.station_m, offset = routes.locate(*where, nearest_station_m(routes, *where))
        return Quantities(world, state, bodies, np.zeros((1, len(players))), offset, np.zeros((1, len(players))))

    return make
