"""Killed at any moment and run again is uninterrupted: whole campaigns, by the real command."""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import pytest

from tests.support.scenes import build_scene
from tests.support.tiny import (
    CAREFUL,
    SPEEDY,
    TRAINING,
    begin,
    carried_out,
    end,
    numbers,
    wait_until_nothing_is_left,
    workers_of,
    write_campaign,
)

pytestmark = pytest.mark.slow

KILLS = 25
CAMPAIGN: dict[str, Any] = {
    "name": "killed",
    "scene": "scene",  # short games: what takes time is that the command starts 25 times
    "ego": {"driver": "sumo", "persona": str(CAREFUL)},
    "personas": [str(SPEEDY)],
    "training": {**TRAINING, "steps": 3072},
    "assessment": {"episodes": 52},  # a full segment and a bit
}


def kill(process: subprocess.Popen[str], whom: str, chance: random.Random) -> bool:
    """Kill the command, one of its workers, or both; whether there was somebody."""
    workers = workers_of(process.pid)
    victims = [process.pid] if whom in ("command", "both") else []
    if whom in ("worker", "both") and workers:
        victims.append(chance.choice(workers))
    for victim in victims:
        try:
            os.kill(victim, signal.SIGKILL)
        except ProcessLookupError:
            return False
    return bool(victims)


def test_campaign__killed_at_25_random_moments_is_uninterrupted(tmp_path: Path) -> None:
    build_scene(tmp_path / "scene", goal_m=80.0)
    campaign = write_campaign(tmp_path, **CAMPAIGN)
    began = time.monotonic()
    carried_out(campaign, tmp_path / "whole", "--jobs", 2)
    lasts_s = time.monotonic() - began
    expected = numbers(tmp_path / "whole")

    chance, run, kills = random.Random(25), tmp_path / "run", 0
    while kills < KILLS:
        process = begin("campaign", campaign, "--out", run, "--jobs", 2)
        ended = False
        while not ended:
            until = time.monotonic() + chance.uniform(0.0, 0.3 * lasts_s)
            while time.monotonic() < until and process.poll() is None:
                time.sleep(0.01)
            whom = chance.choice(("command", "command", "worker", "both"))
            ended = process.poll() is not None or kills == KILLS
            if not ended and kill(process, whom, chance):
                kills += 1
                ended = whom != "worker"
        printed = end(process)
        assert "Traceback" not in printed, printed
        assert process.returncode in (0, -signal.SIGKILL), printed
        wait_until_nothing_is_left(process)
        if process.returncode == 0:
            assert numbers(run) == expected
            shutil.rmtree(run)
    carried_out(campaign, run, "--jobs", 2)
    assert numbers(run) == expected
    assert not list(run.rglob(".*.part"))
    beside_stages = {each.name for each in (run / ".stages").iterdir() if "-seed" not in each.name}
    assert beside_stages == {"lock", "worker_locks", "results.json"}
