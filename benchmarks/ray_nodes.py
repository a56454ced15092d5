"""What Ray costs: a small campaign on two local nodes of one core, against the same one on two local workers."""

from __future__ import annotations

import io
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console

from benchmarks.budget import Budget
from benchmarks.campaign import write_document
from benchmarks.figures import Measured
from benchmarks.sides import LapTimer, OnProgress, Side, raw_numbers, running_sides
from harness.campaign.execution.ray_workers import RayWorkers, ray_cluster
from harness.campaign.execution.run_campaign import run_campaign
from harness.campaign.execution.run_stages import StartWorkers
from harness.campaign.execution.worker_pool import WorkerPool
from harness.campaign.preflight import open_campaign
from harness.campaign.storage.run_folder import RunFolder

_WORKERS = 2
_NODE = {"num_cpus": 1, "object_store_memory": 80_000_000, "include_dashboard": False}


@contextmanager
def _two_nodes() -> Iterator[str]:
    """The address of a cluster of two nodes of one core on this machine."""
    os.environ |= {"RAY_AUTH_MODE": "disabled", "RAY_USAGE_STATS_ENABLED": "0"}
    from ray.cluster_utils import Cluster

    cluster: Any = Cluster(initialize_head=True, head_node_args=_NODE)
    try:
        cluster.add_node(**_NODE)
        yield cluster.address
    finally:
        cluster.shutdown()


def workers_side(timer: LapTimer, steps: int, episodes: int) -> None:
    """The campaign on workers of this machine, once."""
    timer.ready()
    _run(partial(WorkerPool, jobs=_WORKERS), steps, episodes)
    timer.finish_lap(1.0)


def ray_side(timer: LapTimer, steps: int, episodes: int) -> None:
    """The campaign on a cluster that is running, once. The lap includes the connection."""
    with _two_nodes() as address:
        timer.ready()
        with ray_cluster(address, None) as ray:
            _run(partial(RayWorkers, ray=ray, jobs=None, warn=_fail), steps, episodes)
        timer.finish_lap(1.0)


def ray_two_nodes(budget: Budget, on_progress: OnProgress) -> Measured:
    """Wall time on two nodes as a multiple of that on two workers."""
    arguments = (budget.ray_steps, budget.ray_episodes)
    sides = {"workers": Side(run=workers_side, arguments=arguments), "ray": Side(run=ray_side, arguments=arguments)}
    laps = {}
    with running_sides(sides, lap_s=0.0) as runners:
        for done, (name, runner) in enumerate(runners.items(), start=1):
            laps[name] = [runner.lap()]
            on_progress(done / len(runners))
    ratio = laps["ray"][0].seconds / laps["workers"][0].seconds
    return {"ray_two_nodes": ratio}, {"unit": "campaigns", **raw_numbers(laps)}


def _run(start_workers: StartWorkers, steps: int, episodes: int) -> None:
    with tempfile.TemporaryDirectory(prefix="benchmark-") as scratch:
        campaign = open_campaign(write_document(Path(scratch), steps, episodes))
        console = Console(file=io.StringIO())
        outcome = run_campaign(campaign, RunFolder(Path(scratch) / "run"), start_workers, console)
    if outcome.failed_stages or outcome.error_games:
        raise RuntimeError(f"failed: {outcome.failed_stages}; games in error: {outcome.error_games}")


def _fail(line: str) -> None:
    raise RuntimeError(line)
