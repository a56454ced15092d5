"""A second simulation of a process: a child process with the same numbers, which never outlives its parent."""

from __future__ import annotations

import gc
import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import libsumo
import numpy as np
import pytest

from harness.drivers.sumo import SumoDriver
from harness.environments.arena import Arena, Seat
from harness.errors import SimulationError
from harness.road.demand.route_file import Departure
from harness.road.scene.open_scene import OpenScene
from harness.sumo import subprocess_simulation
from harness.sumo.libsumo_simulation import LibsumoSimulation
from harness.sumo.subprocess_simulation import SubprocessSimulation, open_simulations
from tests.support.processes import is_running
from tests.support.repository import REPOSITORY
from tests.support.scenes import LEFT_Y, ZIPPER, ZIPPER_EDGES, ZIPPER_NODES, build_scene, drawn, placed
from tests.support.simulations import games_of, stepped
from tests.support.tiny import wait_for

FLOW = '<flow id="f" type="van" begin="0" period="3" departLane="random"><route edges="road"/></flow>'


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> OpenScene:
    return build_scene(tmp_path_factory.mktemp("scenes") / "straight", others=FLOW)


@pytest.fixture
def far(scene: OpenScene) -> Iterator[SubprocessSimulation]:
    [simulation] = SubprocessSimulation.side_by_side([games_of(scene)], 1)
    with closing(simulation):
        yield simulation


def test_open__one_simulation_at_a_time_is_local(scene: OpenScene) -> None:
    [first] = open_simulations([games_of(scene)], seed=1)
    [second] = open_simulations([games_of(scene)], seed=1)
    first.close()
    [third] = open_simulations([games_of(scene)], seed=1)
    kinds = [type(each) for each in (first, second, third)]
    for each in (second, third):
        each.close()
    assert kinds == [LibsumoSimulation, SubprocessSimulation, LibsumoSimulation]
    assert not libsumo.isLoaded()


def test_both__give_the_same_numbers(scene: OpenScene) -> None:
    arenas = [Arena(scene, 2, [Seat(None), Seat(SumoDriver())], seed=3) for _ in range(2)]
    assert isinstance(arenas[1].simulation, SubprocessSimulation)
    actions = np.random.default_rng(0).normal(0.0, 0.1, (120, 2, 2, 2))

    def played(arena: Arena) -> bytes:
        results = []
        for seed in (1, 2):
            arena.reload(seed)
            starts = {game: drawn(scene, "both", game) for game in range(2)}
            arena.reset(starts, {game: scene.departures(game) for game in range(2)})
            for action in actions:
                arena.step(action)
                results += [arena.observation.tobytes(), arena.state.x_m.tobytes(), arena.state.outcome.tobytes()]
                assert arena.reading is not None
                results += [arena.reading.x_m.tobytes(), repr(arena.reading.names.tolist()).encode()]
        return b"".join(results)

    local, remote = (played(arena) for arena in arenas)
    for arena in arenas:
        arena.close()
    assert local == remote


def test_refusal__in_the_child_is_an_error_and_the_child_continues(scene: OpenScene, far: SubprocessSimulation) -> None:
    start = placed(scene, (40, LEFT_Y, 0, 0), None)
    refused = Departure(
        name="refused", vehicle_type="van", edges=("road",), depart_s=0.0, lane="7", position="base", speed="0"
    )
    with pytest.raises(SimulationError, match=r"reset game 0.*departLane.*refused"):
        far.reset(0, start, [refused])
    far.reload(1)
    far.reset(0, start, [])
    assert stepped(far, start.x_m[None], start.y_m[None], start.heading_rad[None]).names.tolist() == [[]]


def test_refusal__to_load_leaves_no_child(scene: OpenScene, tmp_path: Path) -> None:
    broken = build_scene(tmp_path)
    broken.net_file.write_text("<net")
    with pytest.raises(SimulationError, match=r"n\.net\.xml"):
        SubprocessSimulation.side_by_side([games_of(broken)], 1)


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_crash__of_the_child_is_an_error_that_names_the_signal(far: SubprocessSimulation) -> None:
    os.kill(far.child.process.pid, signal.SIGSEGV)
    for _ in range(2):
        with pytest.raises(SimulationError, match="SIGSEGV"):
            far.reload(1)


def test_interrupt__ends_the_child(far: SubprocessSimulation, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patched:

        def interrupted(stream: Any, message: Any) -> None:
            raise KeyboardInterrupt

        patched.setattr(subprocess_simulation, "_send", interrupted)
        with pytest.raises(KeyboardInterrupt):
            far.reload(1)
    with pytest.raises(SimulationError, match="SIGKILL"):
        far.reload(2)


def test_close__ends_the_child_and_may_be_repeated(far: SubprocessSimulation) -> None:
    far.close()
    assert far.child.process.poll() == 0
    far.close()
    with pytest.raises(SimulationError, match="closed"):
        far.reload(1)


def test_garbage__ends_the_child(scene: OpenScene) -> None:
    [simulation] = SubprocessSimulation.side_by_side([games_of(scene)], 1)
    process = simulation.child.process
    del simulation
    gc.collect()
    assert process.poll() == 0


def test_prints__of_sumo_do_not_enter_the_pipe() -> None:
    program = """
from harness.sumo import libsumo_simulation
from harness.sumo import subprocess_simulation
import os
import pickle
class Printing:
    def __init__(self, *arguments, **options): os.write(1, b"SUMO says"); print("this", flush=True)
    def reload(self, seed): os.write(1, b"and that"); return seed
    def close(self): print("bye", flush=True)
class Kind:
    @staticmethod
    def side_by_side(parts, seed): return [Printing()]
libsumo_simulation.LibsumoSimulation = Kind
subprocess_simulation.serve()
"""
    child = subprocess.Popen(
        [sys.executable, "-c", program],
        cwd=REPOSITORY,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    assert child.stdin is not None
    assert child.stdout is not None
    for message, answer in (((None, 1), None), (("reload", 0, 5), 5)):
        child.stdin.write(pickle.dumps(message))
        child.stdin.flush()
        assert pickle.load(child.stdout) == (answer, None)
    rest, errors = child.communicate(timeout=300)
    assert (rest, errors.split()) == (b"", [b"SUMO", b"saysthis", b"and", b"thatbye"])


SCRIPT = """
import os, pathlib, signal, sys
sys.path.insert(0, {repository!r})
from harness import open_scene
from harness.sumo.scene_games import SceneGames
from harness.sumo.subprocess_simulation import open_simulations
games = SceneGames(scene=open_scene(pathlib.Path("straight")), games=1, taken_over=(True, True))
both = [each for _ in range(2) for each in open_simulations([games], seed=1)]
os.chdir("/")
both[1].reload(2)
print(both[1].child.process.pid, flush=True)
{end}
"""


@pytest.mark.skipif(os.name != "posix", reason="signals")
@pytest.mark.parametrize("end", ["", "raise RuntimeError", "os.kill(os.getpid(), signal.SIGKILL)", "os._exit(3)"])
def test_parent__a_script_without_a_main_guard_leaves_no_orphan(scene: OpenScene, tmp_path: Path, end: str) -> None:
    script = tmp_path / "script.py"
    script.write_text(SCRIPT.format(repository=str(REPOSITORY), end=end))
    run = subprocess.run(
        [sys.executable, str(script)], cwd=scene.folder.parent, capture_output=True, text=True, timeout=300
    )
    assert run.stdout.strip().isdigit(), run.stderr
    wait_for(lambda: not is_running(int(run.stdout)), "the end of the child")
    assert run.returncode == 0 or end


def test_soak__players_off_the_road_near_a_zipper_junction_do_not_crash_sumo(tmp_path: Path) -> None:
    """SUMO 1.28 crashes (SIGSEGV within a thousand steps) if lane changes take time, and with its sublane model."""
    scene = build_scene(tmp_path, ZIPPER_NODES, ZIPPER_EDGES, ZIPPER, goal_m=100.0)
    generator = np.random.default_rng(0)
    [simulation] = SubprocessSimulation.side_by_side([games_of(scene, 4)], 1)
    with closing(simulation):
        for episode in range(14):
            x, y = generator.uniform(90, 150, (4, 2)), generator.uniform(-9, 0, (4, 2))
            heading, turning = np.zeros((4, 2)), generator.normal(0.0, 0.03, (4, 2))
            for game in range(4):
                simulation.reset(game, drawn(scene, episode, game), [])
            for _ in range(250):
                heading = heading + turning + generator.normal(0.0, 0.05, (4, 2))
                x, y = x + 0.6 * np.cos(heading), y + 0.6 * np.sin(heading)
                stepped(simulation, x, y, heading)
