"""Long work in a process of its own, weighed as it goes: memory, open files and threads stay what they were.

libsumo itself keeps about a kilobyte each time a simulation is loaded, in one process and however it is closed. It is
weighed beside the harness, so that what the harness adds is known.
"""

from __future__ import annotations

import gc
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path

import libsumo
import numpy as np
import pytest
from scenes import build_scene, drawn
from test_assessment import Steady, arm
from tiny import MERGE, SPEEDY

from harness.arena import Arena, Seat
from harness.assessment import assess
from harness.documents.persona import Persona
from harness.documents.reading import read_document
from harness.drivers.sumo import SumoDriver
from harness.game.state import Outcome
from harness.trace_file import TraceWriter
from harness.traffic.opening import open_scene

pytestmark = pytest.mark.skipif(
    not Path("/proc/self/statm").is_file(), reason="the system does not tell what it weighs"
)

GAMES = 64  # as many as campaigns train on
GAME_STEPS = 1_000_000
SEGMENT_STEPS = 131_072  # a training starts SUMO anew as often
ASSESSED = 2_000
GAMES_PER_FILE = 50
WEIGHED = 20  # times, while it goes on; the first quarter warms up

SOAK_MB = 2.0  # what a million game-steps may add: 0.1 MB was measured
ASSESSMENT_KB_PER_GAME = 1.0  # beyond what libsumo keeps per load: 0.2 kB were measured


@dataclass(frozen=True)
class Weight:
    """What a process holds after so many units of work."""

    done: int
    memory_mb: float
    files: int
    threads: int

    @classmethod
    def now(cls, done: int) -> Weight:
        gc.collect()
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        files, threads = (len(os.listdir(f"/proc/self/{kind}")) for kind in ("fd", "task"))
        return cls(done, pages * os.sysconf("SC_PAGE_SIZE") / 1e6, files, threads)


# --- the work, in a process of its own --------------------------------------------------------------------------------


def soak() -> Iterator[Weight]:
    """A million game-steps of an arena whose players drive at random, and begin anew wherever a game ends."""
    scene, persona = open_scene(MERGE), read_document(SPEEDY, Persona)
    arena = Arena(scene, GAMES, [Seat(None, persona.payoff), Seat(None, persona.payoff)])
    chance = np.random.default_rng(1)
    actions = np.clip(chance.normal([0.1, 0.0], [0.4, 0.1], (509, GAMES, 2, 2)), -1.0, 1.0)
    played, outcomes = 0, set[int]()
    steps = GAME_STEPS // GAMES
    for step in range(steps + 1):
        if step % (steps // WEIGHED) == 0:
            yield Weight.now(step * GAMES)
        if step % (SEGMENT_STEPS // GAMES) == 0:
            arena.reload(step)
            ended = np.arange(GAMES)
        else:
            ended = np.flatnonzero(~arena.state.running.any(1))
        if len(ended):
            outcomes |= set(arena.state.outcome[ended].ravel().tolist())
            arena.start({int(game): drawn(scene, "soak", int(game), step) for game in ended})
            played += len(ended)
        arena.step(actions[step % len(actions)])
    assert played > 10_000
    assert outcomes >= {Outcome.GOAL, Outcome.COLLISION, Outcome.RAIL}
    arena.close()


def assessment() -> Iterator[Weight]:
    """Two thousand short games, each with a simulation of its own load, and their traces, fifty games to a file."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        games = assess(arm(build_scene(folder / "road", goal_m=60.0), Steady(), SumoDriver()), ASSESSED)
        for first in range(0, ASSESSED, GAMES_PER_FILE):
            if first % (ASSESSED // WEIGHED) == 0:
                yield Weight.now(first)
            with TraceWriter(folder / "traces.parquet") as traces:
                for _ in range(GAMES_PER_FILE):
                    game = next(games)
                    assert game.record["ego_outcome"] == "goal"
                    assert game.trace is not None
                    traces.add(game.trace)
        yield Weight.now(ASSESSED)
        games.close()  # type: ignore[attr-defined]


def bare_libsumo() -> Iterator[Weight]:
    """The simulations of so many games, loaded and stepped, without the harness."""
    options = ["--net-file", str(MERGE / "merge.net.xml"), "--step-length", "0.1", "--no-step-log", "--no-warnings"]
    libsumo.start(["sumo", *options])
    for game in range(ASSESSED + 1):
        if game % (ASSESSED // WEIGHED) == 0:
            yield Weight.now(game)
        libsumo.load([*options, "--seed", str(game)])
        for _ in range(10):
            libsumo.simulationStep()
    libsumo.close()


WORK = {work.__name__: work for work in (soak, assessment, bare_libsumo)}


@cache
def weighed(work: str) -> list[Weight]:
    """What the work weighed once it was warm."""
    done = subprocess.run(
        [sys.executable, __file__, work],
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | {"PYTHONPATH": PATH},
    )
    assert done.returncode == 0, done.stderr
    weights = [Weight(**json.loads(line)) for line in done.stdout.splitlines()]
    assert len(weights) == WEIGHED + 1
    return weights[WEIGHED // 4 :]


PATH = os.pathsep.join(each for each in sys.path if each)


def growth_mb(weights: list[Weight]) -> float:
    """How much heavier the work became, by the medians of either end: what is taken and given back is no growth."""
    first, last = (float(np.median([each.memory_mb for each in end])) for end in (weights[:5], weights[-5:]))
    return last - first


# --- what must be true ------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_soak__a_million_game_steps_leave_memory_as_it_was() -> None:
    weights = weighed("soak")
    assert weights[-1].done >= 0.99 * GAME_STEPS
    assert growth_mb(weights) <= SOAK_MB


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_assessment__thousands_of_games_add_no_memory_beyond_what_libsumo_keeps() -> None:
    ours, theirs = weighed("assessment"), weighed("bare_libsumo")
    assert ours[-1].done == theirs[-1].done == ASSESSED
    games = 0.75 * ASSESSED
    assert growth_mb(ours) - growth_mb(theirs) <= games * ASSESSMENT_KB_PER_GAME / 1000.0


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize("work", ["soak", "assessment"])
def test_long_work__opens_no_files_and_starts_no_threads(work: str) -> None:
    weights = weighed(work)
    assert len({each.files for each in weights}) == 1
    assert len({each.threads for each in weights}) == 1


if __name__ == "__main__":
    for weight in WORK[sys.argv[1]]():
        print(json.dumps(asdict(weight)), flush=True)
