"""A game played twice by a driver in a process of its own: the process that checks a campaign loads no SUMO."""

from __future__ import annotations

import json
import os
import pickle
import subprocess
import sys
from pathlib import Path

from harness.drivers.external import ExternalDriver

LONGEST_S = 600.0
"""A game that takes longer is not repeated: programs have deadlines of their own."""
_PROGRAM = "import json, sys; sys.path[:] = json.loads(sys.argv[1]); from {0} import serve; serve()"


def difference_when_repeated(driver: ExternalDriver, scene: Path, sampled: bool) -> str:
    """What an external driver decides otherwise when the same game on a scene's folder is played again, in words; empty
    if nothing, or if the game can't be played: what prevents it is told where the games of an arm are."""
    path = json.dumps([os.path.abspath(each) for each in sys.path])
    command = [sys.executable, "-c", _PROGRAM.format(__name__), path]
    try:
        done = subprocess.run(
            command, input=pickle.dumps((driver, scene.resolve(), sampled)), capture_output=True, timeout=LONGEST_S
        )
        return str(json.loads(done.stdout)["difference"])
    except (subprocess.TimeoutExpired, ValueError, LookupError):
        return ""


def serve() -> None:
    """Answer the one question on the standard input. What the process runs."""
    from harness.assessment.conformance import difference_of
    from harness.drivers.car import car_of
    from harness.errors import HarnessError
    from harness.game.roles import EGO
    from harness.road.scene.open_scene import open_scene

    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what a driver prints must not reach the answer
    driver, folder, sampled = pickle.load(sys.stdin.buffer)
    try:
        scene = open_scene(folder, driver.vehicle_type)
        difference = difference_of(driver.make(car_of(scene.world, EGO), sampled), scene)
    except HarnessError:
        difference = ""
    answers.write(json.dumps({"difference": difference}))
    answers.flush()
