"""The environments in a worker of Ray that imports nothing but Gymnasium."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from tests.support.repository import REPOSITORY

pytestmark = pytest.mark.slow

PROGRAM = """
from harness.campaign.execution.ray_workers import ray_cluster

def play():
    import sys
    import gymnasium
    imported = "harness" in sys.modules
    environment = gymnasium.make("harness:harness/NonEgo-v0")
    environment.reset(seed=1)
    environment.step(environment.action_space.sample())
    many = gymnasium.make_vec("harness:harness/Ego-v0", num_envs=2)
    many.reset(seed=1)
    made = [type(each.unwrapped).__name__ for each in (environment, many)]
    environment.close()
    many.close()
    return imported, *made

with ray_cluster("local", 1) as ray:
    print(ray.get(ray.remote(play).remote(), timeout=300))
"""


def test_ray__a_worker_makes_the_environments_by_their_names() -> None:
    variables = {**os.environ, "PYTHONPATH": str(REPOSITORY)}
    done = subprocess.run([sys.executable, "-c", PROGRAM], env=variables, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "(False, 'DrivingEnv', 'VectorDrivingEnv')"
