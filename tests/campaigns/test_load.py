"""Long work in a process of its own, weighed as it goes: memory, open files and threads stay what they were. And a
report of ten thousand episodes, which opens all the same.

Memory is what the C library's allocator has given out and not got back, Python's objects and Arrow's tables included:
what the system counts for the process also depends on how the allocator cuts its pages. libsumo itself keeps about a
kilobyte each time a simulation is loaded, in one process and however it is closed. It is weighed beside the harness, so
that what the harness adds is known.
"""

from __future__ import annotations

import ctypes
import gc
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import libsumo
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from harness.campaign.results.recorded_games import recorded_games, scene_drawing
from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.drivers.sumo import SumoDriver
from harness.environments.arena import Arena, Seat
from harness.evaluation.comparisons.summary import summarise
from harness.evaluation.tables import table_of, typed
from harness.evaluation.trace_file import SCHEMA, trace_writer
from harness.evaluation.worst_first import MOST_FAILURES_PER_ARM, choose_games, replay_name
from harness.game.arrays import FloatArray, IntArray
from harness.game.outcome import Outcome
from harness.reports.manoeuvres import MOST_LISTED
from harness.road.scene.open_scene import OpenScene, open_scene
from tests.support.chromium import launched, opener, ready_s, until
from tests.support.pages import campaign, rendered
from tests.support.rollouts import Steady, arm, assess, play
from tests.support.scenes import build_scene, drawn
from tests.support.tiny import PAPER_MERGE, SPEEDY
from tests.support.work import assert_work

C_LIBRARY = ctypes.CDLL(None)
weighing = pytest.mark.skipif(
    not hasattr(C_LIBRARY, "mallinfo2") or not Path("/proc/self/fd").is_dir(),
    reason="the system does not say what a process holds",
)

GAMES = 64  # as many as campaigns train on
GAME_STEPS = 1_000_000
SEGMENT_STEPS = 131_072  # a training starts SUMO anew as often
ASSESSED = 1_000
GAMES_PER_FILE = 50
WEIGHED = 20  # times, while it goes on; the first quarter warms up

SOAK_MB = 0.5  # what a million game-steps may add: 0.1 MB was measured
ASSESSMENT_KB_PER_GAME = 0.5  # beyond what libsumo keeps per load: 0.2 kB were measured


COUNTERS = ("arena", "ordblks", "smblks", "hblks", "hblkhd", "usmblks", "fsmblks", "uordblks", "fordblks", "keepcost")


class AllocatorSays(ctypes.Structure):
    """`struct mallinfo2` of glibc: `uordblks` bytes in use, and `hblkhd` in blocks mapped one by one."""

    _fields_ = [(name, ctypes.c_size_t) for name in COUNTERS]


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
        C_LIBRARY.mallinfo2.restype = AllocatorSays
        says = C_LIBRARY.mallinfo2()
        files, threads = (len(os.listdir(f"/proc/self/{kind}")) for kind in ("fd", "task"))
        return cls(done, (says.uordblks + says.hblkhd) / 1e6, files, threads)


# --- the work, in a process of its own --------------------------------------------------------------------------------


def soak() -> Iterator[Weight]:
    """A million game-steps of an arena whose players drive at random, and begin anew wherever a game ends."""
    scene, persona = open_scene(PAPER_MERGE), read_document(SPEEDY, Persona)
    arena = Arena(scene, GAMES, [Seat(None, persona.payoff), Seat(None, persona.payoff)])
    chance = np.random.default_rng(1)
    actions = np.clip(chance.normal([0.1, 0.0], [0.4, 0.3], (509, GAMES, 2, 2)), -1.0, 1.0)
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
            arena.reset({int(game): drawn(scene, "soak", int(game), step) for game in ended})
            played += len(ended)
        arena.step(actions[step % len(actions)])
    assert played > 10_000
    assert outcomes >= {Outcome.GOAL, Outcome.COLLISION, Outcome.RAIL}
    arena.close()


def assessment() -> Iterator[Weight]:
    """A thousand short games, each with a simulation of its own load, and their traces, fifty games to a file."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        games = assess(arm(build_scene(folder / "road", goal_m=60.0), Steady(), SumoDriver()), range(ASSESSED))
        for first in range(0, ASSESSED, GAMES_PER_FILE):
            if first % (ASSESSED // WEIGHED) == 0:
                yield Weight.now(first)
            with trace_writer(folder / "traces.parquet", SCHEMA) as add_trace:
                for _ in range(GAMES_PER_FILE):
                    game = next(games)
                    assert game.record["ego_outcome"] == "goal"
                    assert game.trace is not None
                    add_trace(game.trace)
        yield Weight.now(ASSESSED)
        games.close()  # type: ignore[attr-defined]


def bare_libsumo() -> Iterator[Weight]:
    """The simulations of so many games, loaded and stepped, without the harness."""
    net = PAPER_MERGE / "paper_merge.net.xml"
    options = ["--net-file", str(net), "--step-length", "0.1", "--no-step-log", "--no-warnings"]
    libsumo.start(["sumo", *options])
    for game in range(ASSESSED + 1):
        if game % (ASSESSED // WEIGHED) == 0:
            yield Weight.now(game)
        libsumo.load([*options, "--seed", str(game)])
        for _ in range(10):
            libsumo.simulationStep()
    libsumo.close()


WORK = {work.__name__: work for work in (soak, assessment, bare_libsumo)}


def weighed(work: str) -> list[Weight]:
    """What the work weighed once it was warm."""
    one_allocator = {"PYTHONMALLOC": "malloc", "ARROW_DEFAULT_MEMORY_POOL": "system"}
    environment = os.environ | one_allocator | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    command = [sys.executable, __file__, work]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    assert done.returncode == 0, done.stderr
    weights = [Weight(**json.loads(line)) for line in done.stdout.splitlines()]
    assert len(weights) == WEIGHED + 1
    return weights[WEIGHED // 4 :]


def growth_mb(weights: list[Weight]) -> float:
    """How much heavier the work became, by the medians of either end: what is taken and given back is no growth."""
    first, last = (float(np.median([each.memory_mb for each in end])) for end in (weights[:5], weights[-5:]))
    return last - first


# --- what must be true ------------------------------------------------------------------------------------------------


def assert_opens_nothing(weights: list[Weight]) -> None:
    """No file is left open and no thread is started."""
    assert len({(each.files, each.threads) for each in weights}) == 1


@weighing
@pytest.mark.slow
def test_soak__a_million_game_steps_leave_memory_as_it_was_and_open_nothing() -> None:
    weights = weighed("soak")
    assert weights[-1].done >= 0.99 * GAME_STEPS
    assert growth_mb(weights) <= SOAK_MB
    assert_opens_nothing(weights)


@weighing
@pytest.mark.slow
def test_assessment__a_thousand_games_add_no_memory_beyond_what_libsumo_keeps_and_open_nothing() -> None:
    ours, theirs = weighed("assessment"), weighed("bare_libsumo")
    assert ours[-1].done == theirs[-1].done == ASSESSED
    games = ours[-3].done - ours[2].done  # the medians of either end
    assert growth_mb(ours) - growth_mb(theirs) <= games * ASSESSMENT_KB_PER_GAME / 1000.0
    assert_opens_nothing(ours)


# --- a report of ten thousand episodes --------------------------------------------------------------------------------

EPISODES = 10_000
LARGE = ("naive_vs_speedy", "retrained_vs_speedy")
READY_S = 3.0  # until the page's player can be used


class Restless(Steady):
    """Straight on, never at the same speed: its games take as much room on a page as a person's."""

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        return np.clip(0.5 * noise * [1.0, 0.0], -1.0, 1.0)


@pytest.fixture(scope="module")
def large() -> dict[str, Any]:
    """The tables of a campaign in which two arms have ten thousand episodes: a hundred, again and again."""
    found = campaign(personas=["speedy"], games=100)
    rows = found["episodes"]
    some = rows[rows["arm"].isin(LARGE)]
    again = [some.assign(episode=some["episode"] + 100 * k) for k in range(EPISODES // 100)]
    episodes = typed(pd.concat([rows[~rows["arm"].isin(LARGE)], *again], ignore_index=True))
    chosen = choose_games(episodes)[["arm", "seed", "episode"]]
    replays = [replay_name(*game) for game in chosen.itertuples(index=False)]
    return found | {"episodes": episodes, "summary": summarise(episodes), "replays": replays}


@pytest.fixture(scope="module")
def traces(merge: OpenScene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The traces of that many episodes, fifty to a row group: some that were really played, again and again."""
    file = tmp_path_factory.mktemp("traces") / "traces.parquet"
    games = [pa.table(dict(game.trace or {})) for game in play(arm(merge, Restless(), Restless()), 5)]
    with pq.ParquetWriter(file, SCHEMA, compression="zstd") as writer:
        for first in range(0, EPISODES, GAMES_PER_FILE):
            numbered = []
            for episode in range(first, first + GAMES_PER_FILE):
                game = games[episode % len(games)]
                numbered.append(game.set_column(0, "episode", pa.array([episode] * len(game))))
            writer.write_table(pa.concat_tables(numbered).select(SCHEMA.names).cast(SCHEMA))
    return file


@pytest.mark.slow
def test_report__of_ten_thousand_episodes_fits_a_page_and_opens(
    large: dict[str, Any], traces: Path, merge: OpenScene, tmp_path: Path
) -> None:
    episodes = large["episodes"]
    assert int((episodes["ego_failed"] == 1).sum()) > 1_000
    assert len(large["replays"]) < 3 * MOST_FAILURES_PER_ARM

    games = recorded_games(episodes[episodes["arm"].isin(LARGE)], {}, lambda arm, seed: traces, merge)
    html = rendered(**large, games=games, scene=scene_drawing(merge))
    assert len(html.encode()) <= 3_000_000
    assert "300 of the 10,000 episodes are drawn" in html
    assert f"{len(episodes)} games are too many for a page" in html

    file = tmp_path / "report.html"
    file.write_text(html, encoding="utf-8")
    with launched() as browser, opener(browser, file) as open_page:
        page = open_page()
        assert_work(ready_s(page), READY_S)
        arms = page.locator("[data-is=arm] option").evaluate_all("options => options.map(each => each.value)")
        assert all(any(name in each for each in arms) for name in LARGE)
        page.locator("[data-is=arm]").select_option("")
        until(page, "() => document.querySelector('[data-is=place]').textContent.startsWith('1 of ')")
        listed: list[str] = page.evaluate(
            "() => new DataTable.Api('#games').rows().data().toArray().map(row => `${row.arm}: ${row.outcome}`)"
        )
        assert all(sum(name in each for each in listed) >= 100 for name in LARGE)
        intro = page.locator("#player-intro").inner_text()
        assert intro.startswith(f"{len(listed)} recorded games")
        assert f"{len(episodes) - len(listed)} more games do not fit into the page" in intro
        for outcome in ("collision", "goal"):  # the worst, and what went well
            assert any(outcome in each for each in listed), outcome
        before = page.locator(".player").get_attribute("data-time")
        page.locator(".player").focus()
        page.keyboard.press("End")
        until(page, "before => document.querySelector('.player').dataset.time !== before", before)
        assert page.seen == []


def test_report__a_cause_lists_no_more_games_than_can_be_read(large: dict[str, Any]) -> None:
    failed = large["episodes"][large["episodes"]["ego_failed"] == 1].to_dict("records")
    event = {"other": "non_ego", "event": "cut_in", "deed": "cuts in", "time_s": 1.0, "time_left_s": 0.5}
    causes = table_of("causes", [game | event for game in failed])
    html = rendered(**large, manoeuvres=table_of("manoeuvres"), causes=causes)
    listed = html.split('id="pair-1"')[1].split("</details>")[0]
    assert listed.count("<li>") == MOST_LISTED
    assert "more: <code>causes.csv</code>" in listed


if __name__ == "__main__":
    for weight in WORK[sys.argv[1]]():
        print(json.dumps(asdict(weight)), flush=True)
