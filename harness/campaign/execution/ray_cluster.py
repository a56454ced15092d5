"""The Ray cluster of one run of the command: started on this machine for the run, or connected to.

Ray is the extra `ray`: it is imported where it is asked for. Ray itself refuses a cluster with another version of Ray
or Python.
"""

from __future__ import annotations

import contextlib
import os
import secrets
import shutil
import signal
import socket
import tempfile
import threading
from collections.abc import Iterator
from typing import Any

from harness.campaign.execution.ray_nodes import OPTION
from harness.campaign.execution.worker_pool import cores
from harness.errors import UsageError

LOCAL, AUTO = "local", "auto"
_ANSWER_S = 5.0  # the time that a cluster has to accept a connection; Ray itself waits for minutes
_OBJECTS_BYTES = 80_000_000  # the smallest object store: stages exchange files, and /dev/shm of a container is small
_QUIET = {"include_dashboard": False, "log_to_driver": False, "logging_level": "ERROR"}
_START = "start one with: ray start --head --port=6379"


@contextlib.contextmanager
def ray_cluster(address: str, jobs: int | None) -> Iterator[Any]:
    """Ray, connected to a cluster during the block: `local`, `auto` (the one that runs on this machine, or that
    RAY_ADDRESS names) or `host:port`. `local` has `jobs` cores, by default those of this machine.

    Raises UsageError where Ray is not installed, or there is no such cluster.
    """
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    if address == LOCAL and "RAY_AUTH_MODE" not in os.environ:  # a token that only this command and its processes know
        os.environ.update(RAY_AUTH_MODE="token", RAY_AUTH_TOKEN=secrets.token_hex(32))  # Ray reads it when imported
    try:
        import ray
    except ImportError:
        remedy = "pip install 'safedriverl-harness[ray]'"
        raise UsageError.of(OPTION, address, "needs Ray, which is not installed", remedy) from None
    with contextlib.ExitStack() as stack:
        if address == LOCAL:
            options = _local_options(stack, jobs or cores())
        else:
            _check_address(address)
            options = {"address": address, "log_to_driver": False, "logging_level": "ERROR"}
        stack.callback(ray.shutdown)
        with _handlers_kept():
            try:
                ray.init(**options)
            except Exception as error:  # Ray raises errors of many kinds here, and `Exception` itself
                message = f"no connection to Ray: {' '.join(str(error).split())}"
                raise UsageError.of(OPTION, address, message, _START) from None
        yield ray


def _local_options(stack: contextlib.ExitStack, jobs: int) -> dict[str, Any]:
    """A cluster of this machine alone, the files of which are removed at the end."""
    parent = "/tmp" if os.path.isdir("/tmp") else None  # names of sockets below it must stay short
    folder = tempfile.mkdtemp(prefix="harness-ray-", dir=parent)
    stack.callback(shutil.rmtree, folder, ignore_errors=True)
    return {
        **_QUIET,
        "address": "local",
        "num_cpus": jobs,
        "num_gpus": 0,
        "object_store_memory": _OBJECTS_BYTES,
        "_temp_dir": folder,
    }


def _check_address(address: str) -> None:
    """Raises UsageError where an address is none, or nothing accepts connections there."""
    if address == AUTO:
        return
    host, _, port = address.rpartition(":")
    if not host or not port.isdecimal():
        remedy = f"write {LOCAL}, {AUTO} or HOST:PORT, such as 127.0.0.1:6379"
        raise UsageError.of(OPTION, address, "is not an address of a Ray cluster", remedy)
    try:
        socket.create_connection((host.strip("[]"), int(port)), timeout=_ANSWER_S).close()
    except (OSError, OverflowError) as error:
        raise UsageError.of(OPTION, address, f"no Ray cluster answers: {error}", _START) from None


@contextlib.contextmanager
def _handlers_kept() -> Iterator[None]:
    """Undo what the block does to the handling of termination: `ray.init` replaces it."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.getsignal(signal.SIGTERM)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
