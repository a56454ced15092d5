"""Ray clusters on this machine: a head without cores, as a laptop is, and nodes of one core."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from tests.support.processes import children_of, command_of

_QUICK = {"health_check_initial_delay_ms": 0, "health_check_period_ms": 500, "health_check_failure_threshold": 3}
_SMALL = {"object_store_memory": 80_000_000, "include_dashboard": False}


@contextmanager
def cluster_of(nodes: int) -> Iterator[Any]:
    """A `ray.cluster_utils.Cluster` with a head and this many nodes of one core."""
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    os.environ.setdefault("RAY_AUTH_MODE", "disabled")
    from ray.cluster_utils import Cluster

    cluster = Cluster()
    try:
        _start(cluster, num_cpus=0, _system_config=_QUICK)
        for _ in range(nodes):
            add_node(cluster)
        yield cluster
    finally:
        cluster.shutdown()


def add_node(cluster: Any, **options: Any) -> Any:
    """Add a node of one core."""
    return _start(cluster, num_cpus=1, **options)


def busy_process(node: Any) -> int | None:
    """The process of a node that carries a stage out; None if there is none."""
    (raylet,) = node.all_processes["raylet"]
    busy = [pid for pid in children_of(raylet.process.pid) if b"_carry_out" in command_of(pid)]
    return busy[0] if busy else None


def pull_the_plug(cluster: Any, node: Any) -> None:
    """End a node as a power failure does: its worker stops in the middle of what it does, and nothing is said."""
    (raylet,) = node.all_processes["raylet"]
    processes = children_of(raylet.process.pid)
    for pid in processes:
        os.kill(pid, signal.SIGSTOP)
    cluster.remove_node(node, allow_graceful=False)
    for pid in processes:
        os.kill(pid, signal.SIGKILL)


def _start(cluster: Any, **options: Any) -> Any:
    """Start a node. Ray gives up after 30 s, which a busy machine may need: it is tried three times."""
    for _ in range(2):
        try:
            return cluster.add_node(**_SMALL, **options)
        except Exception as error:
            if "timed out during startup" not in str(error):
                raise
    return cluster.add_node(**_SMALL, **options)
