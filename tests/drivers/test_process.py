"""Programs as drivers: a line of JSON per message and answer. A crash, a delay or an invalid answer costs one game."""

from __future__ import annotations

import gc
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from harness.drivers.car import Car
from harness.drivers.process import ProcessDriver
from harness.errors import DriverError
from harness.game.observation_layout import LAYOUT, SIZE
from harness.road.scene.open_scene import OpenScene
from tests.support.processes import driver, is_running, started
from tests.support.repository import REPOSITORY
from tests.support.rollouts import arm, play
from tests.support.tiny import wait_for

GAMES = np.array([3, 7])
SEEN = np.linspace(-1.0, 1.0, 2 * SIZE, dtype=np.float32).reshape(2, SIZE)
NOISE = np.array([[0.5, -0.5], [1.0, 2.0]])


def refusal(driver: ProcessDriver) -> str:
    def drive() -> None:
        driver.reset(GAMES)
        driver.decide(GAMES, SEEN, NOISE)

    with pytest.raises(DriverError) as caught:
        drive()
    return str(caught.value)


def test_process__receives_all_messages_and_decides_in_si_units(tmp_path: Path, car: Car) -> None:
    mine = driver(tmp_path, car, 'open("received.jsonl", "a").write(line)')
    mine.reset(GAMES)
    actions = mine.decide(GAMES, SEEN, NOISE)
    np.testing.assert_array_equal(actions, car.actions(np.array([1.0, 1.0]), np.array([0.01, 0.01]), SEEN))

    hello, reset, decide = map(json.loads, (tmp_path / "received.jsonl").read_text().splitlines())
    assert hello["layout"] == list(LAYOUT)
    assert hello["step_s"] == 0.1
    assert hello["limits"]["max_braking_mps2"] == 8.0
    assert hello["limits"]["length_m"] == 4.6
    assert reset == {"type": "reset", "games": [3, 7]}
    assert decide["games"] == [3, 7]
    np.testing.assert_array_equal(decide["observation"], car.physical(SEEN))
    np.testing.assert_array_equal(decide["noise"], NOISE)


def test_process__temporary_files_of_a_program_are_removed_with_it(tmp_path: Path, car: Car) -> None:
    mine = driver(tmp_path, car, 'import tempfile; open("made", "w").write(tempfile.mkdtemp())')
    mine.reset(GAMES)
    made = Path((tmp_path / "made").read_text())
    assert made.is_dir()
    mine.close()
    assert not made.parent.exists()


def test_process__scaled_units_are_those_of_policies(tmp_path: Path, car: Car) -> None:
    change = 'if games and message["type"] == "decide": answer["actions"] = [row[:2] for row in message["observation"]]'
    mine = driver(tmp_path, car, change, units="scaled")
    mine.reset(GAMES)
    np.testing.assert_array_equal(mine.decide(GAMES, SEEN, NOISE), SEEN[:, :2])
    assert "pedals or a wheel of 1e+09 (-1 to 1 is possible)" in refusal(
        driver(tmp_path, car, "if number == 2: answer['actions'][1] = [1e9, 0]", units="scaled")
    )


INVALID = [
    ("if number == 2: sys.exit('no petrol')", "exit code 1 (message: decide); on its standard error: no petrol"),
    ("if number == 2: os.kill(os.getpid(), 11)", "was killed by SIGSEGV"),
    ("if number == 0: sys.exit(0)", "ended with exit code 0 (message: hello)"),
    ("if number == 2: sys.stdout.close(); os.close(1); time.sleep(60)", "closed its standard output"),
    ("if number == 2: print('{', flush=True); continue", "not JSON"),
    ("if number == 2: answer = [1]", "answered decide with [1], not with an object"),
    ("if number == 2: answer = {}", "2 pairs of numbers are needed, not None"),
    ("if number == 2: answer['actions'] = [[0, 0]]", "2 pairs of numbers are needed"),
    ("if number == 2: answer['actions'][1] = [0, 0, 0]", "each must be a pair of numbers, not [0, 0, 0]"),
    ("if number == 2: answer['actions'][1] = ['0', 0]", "each must be a pair of numbers"),
    ("if number == 2: answer['actions'][1] = [float('nan'), 0]", "is not finite"),
    ("if number == 2: answer['actions'][1] = [10**400, 0]", "too large"),
    ("if number == 2: answer['actions'][1] = [1e9, 0]", "an acceleration of 1e+09 m/s², which is beyond ±100"),
    ("if number == 2: answer['actions'][1] = [0, -9.0]", "a road wheel angle of 9 rad, which is beyond ±6.283"),
    ("if number == 2: answer = {'error': 'no such lane'}", "reports an error: 'no such lane'"),
    ("if number == 0: answer = {'protocol': 1}", "does not support protocol 2"),
    ("if number == 1: print('{}', flush=True)", "answered"),
    ("if number == 2: os.write(1, b'[' * 11_000_000)", "answers with more than 10,000,000 bytes"),
]


@pytest.mark.parametrize(("change", "message"), INVALID)
def test_process__an_invalid_answer_is_an_error(change: str, message: str, tmp_path: Path, car: Car) -> None:
    assert message in refusal(driver(tmp_path, car, change))


@pytest.mark.parametrize("change", ["time.sleep(600)", "os.write(1, b'{'); time.sleep(600)", "any(iter(int, 1))"])
def test_process__a_late_answer_is_an_error(change: str, tmp_path: Path, car: Car) -> None:
    mine = driver(tmp_path, car, f"if number == 2: {change}", deadline_s=0.3)
    mine.reset(GAMES)
    began = time.monotonic()
    with pytest.raises(DriverError, match=r"did not answer within 0.3 s \(message: decide\)"):
        mine.decide(GAMES, SEEN, NOISE)
    assert time.monotonic() - began < 60.0  # it would sleep for 600


def test_process__a_program_that_never_reads_misses_the_deadline(tmp_path: Path, car: Car) -> None:
    many = np.arange(500)
    mine = driver(tmp_path, car, "if number == 1: print('{}', flush=True); time.sleep(600)", deadline_s=0.3)
    mine.reset(many)
    with pytest.raises(DriverError, match="did not answer within"):
        mine.decide(many, np.zeros((500, SIZE), dtype=np.float32), np.zeros((500, 2)))


def test_process__a_long_standard_error_does_not_block(tmp_path: Path, car: Car) -> None:
    mine = driver(tmp_path, car, "sys.stderr.write('blah ' * 100_000 + chr(10)); sys.stderr.flush()")
    for _ in range(3):
        mine.reset(GAMES)
        mine.decide(GAMES, SEEN, NOISE)


def test_process__a_program_that_cannot_be_started_is_an_error(tmp_path: Path, car: Car) -> None:
    mine = ProcessDriver(["./nowhere"], tmp_path, car, units="si", deadline_s=1.0, start_deadline_s=5.0)
    with pytest.raises(DriverError, match=r"\./nowhere ended with exit code 1.*FileNotFoundError"):
        mine.reset(GAMES)


def test_process__ends_with_its_driver(tmp_path: Path, car: Car) -> None:
    mine, pid = started(tmp_path, car)
    assert is_running(pid)
    del mine
    gc.collect()
    wait_for(lambda: not is_running(pid), "the end of the program")


@pytest.mark.skipif(sys.platform != "linux", reason="PR_SET_PDEATHSIG exists on Linux only")
def test_process__ends_when_the_harness_is_killed(tmp_path: Path) -> None:
    """Also a program that never reads its input."""
    script = f"""
import pathlib, numpy as np, sys, time
sys.path.insert(0, {str(REPOSITORY)!r})
from harness.road.scene.open_scene import open_scene
from harness.drivers.car import car_of
from tests.support.processes import started
mine, pid = started(pathlib.Path({str(tmp_path)!r}),
    car_of(open_scene(pathlib.Path({str(REPOSITORY / "networks" / "merge")!r})).world, 0),
    "number == 1 and (print(json.dumps(answer), flush=True), time.sleep(600))")
time.sleep(600)
"""

    parent = subprocess.Popen([sys.executable, "-c", script])
    try:
        wait_for(lambda: (tmp_path / "pid").exists() and (tmp_path / "pid").read_text(), "the program's start")
        pid = int((tmp_path / "pid").read_text())
        assert is_running(pid)
    finally:
        parent.send_signal(signal.SIGKILL)
        parent.wait()
    wait_for(lambda: not is_running(pid), "the end of the program")


def test_process__a_crash_costs_one_game(tmp_path: Path, merge: OpenScene, car: Car) -> None:
    """The program ends in the fourth decision of the second game; a new process plays the third and fourth game."""
    counts = (
        "path = os.path.join(os.getcwd(), 'games'); n = (len(open(path).read()) if os.path.exists(path) else 0);"
        "message['type'] == 'reset' and open(path, 'a').write('x');"
        "globals().__setitem__('steps', 0 if message['type'] == 'reset' else globals().get('steps', 0) + 1);"
        "n == 2 and message['type'] == 'decide' and steps == 4 and sys.exit('flat tyre')"
    )
    games = [game.record for game in play(arm(merge, driver(tmp_path, car, counts), None), 4)]
    assert [game["ego_outcome"] == "error" for game in games] == [False, True, False, False]
    assert "DriverError" in games[1]["error"]
    assert "flat tyre" in games[1]["error"]
    assert not os.path.exists(tmp_path / "core")


def test_process__the_example_in_perl_reaches_its_goal(merge: OpenScene, car: Car) -> None:
    folder = REPOSITORY / "egos" / "examples" / "process"
    mine = ProcessDriver(["perl", "drive.pl"], folder, car, units="si", deadline_s=5.0, start_deadline_s=20.0)
    games = play(arm(merge, mine, None), 4)
    assert [(game.record["error"], game.record["ego_outcome"]) for game in games] == [("", "goal")] * 4
