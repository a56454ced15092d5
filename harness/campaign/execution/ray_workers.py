"""Workers on the nodes of a Ray cluster, which is started on this machine for one run of the command or connected to.

Each task takes one core, on a node that was checked. Ray repeats no task: what follows from a death is decided
by `run_stages`, as on one machine. A process of Ray carries several of them out, one after the other, as a worker of
`worker_pool` does.

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
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from harness.campaign.execution.ray_nodes import OPTION, Node, Nodes, pinned, token_file
from harness.campaign.execution.run_stage import carry_out
from harness.campaign.execution.stage_run import Attempt, Event, RunContext, Task, Work, carry_out_in_worker
from harness.campaign.execution.worker_pool import cores
from harness.campaign.storage.run_folder import RunFolder
from harness.errors import UsageError
from harness.files import make_folder, write_atomically

LOCAL, AUTO = "local", "auto"
_ANSWER_S = 5.0  # the time that a cluster has to accept a connection; Ray itself waits for minutes
_OBJECTS_BYTES = 80_000_000  # the smallest object store: stages exchange files, and /dev/shm of a container is small
_QUIET = {"log_to_driver": False, "logging_level": "ERROR"}
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
            options = {**_QUIET, "address": address}
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
        "include_dashboard": False,
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


_POLL_S = 0.25
_LOOK_EVERY_S = 5.0  # for nodes that joined


class Inbox:
    """Keeps the events of all tasks until they are taken. An actor on the node of the command."""

    def __init__(self) -> None:
        self._events: list[tuple[int, Event]] = []

    def send(self, task: int, event: Event) -> None:
        self._events.append((task, event))

    def take(self) -> list[tuple[int, Event]]:
        """The events since the last time."""
        events, self._events = self._events, []
        return events


@dataclass(frozen=True, kw_only=True)
class _Submitted:
    number: int
    task: Task
    node: Node


class RayWorkers:
    """The nodes of a cluster, for at most `jobs` tasks at a time; see `run_stages.Workers`.

    `ray` is connected to the cluster. Entering it checks all nodes, and raises UsageError with what is wrong with them.
    """

    def __init__(
        self,
        context: RunContext,
        *,
        ray: Any,
        jobs: int | None,
        warn: Callable[[str], None],
        work: Work = carry_out,
    ) -> None:
        policies = context.policies.absolute() if context.policies is not None else None
        self._context = replace(context, folder=RunFolder(context.folder.path.absolute()), policies=policies)
        self._ray, self._jobs, self._warn, self._work = ray, jobs, warn, work
        self._nodes = Nodes(ray=ray, context=self._context, token=f"{os.getpid()} {time.time_ns()}")
        self._remote = ray.remote(num_cpus=1, max_retries=0)(_carry_out)
        self._submitted: dict[Any, _Submitted] = {}
        self._started = 0
        self._looked_s = 0.0

    @property
    def capacity(self) -> int:
        """Cores of the nodes that can be used now, at most `jobs`. At least 1: `submit` waits for a node in doubt."""
        cpus = sum(node.cpus for node in self._nodes.usable.values())
        return max(min(self._jobs or cpus, cpus), 1)

    def submit(self, task: Task, attempt: Attempt) -> None:
        """Start a task on the node with most free cores. Raises UsageError if no node is left."""
        while not self._nodes.usable and self._nodes.waiting:
            self._settle(_POLL_S)
        if not self._nodes.usable:
            remedy = "start nodes and run the same command again: finished work is kept"
            raise UsageError.of(OPTION, "", "the cluster has no node with a core", remedy)
        node = max(self._nodes.usable.values(), key=lambda each: each.cpus - each.running)
        submitted = _Submitted(number=self._started, task=task, node=node)
        remote = self._remote.options(scheduling_strategy=pinned(node.id))
        ref = remote.remote(
            task, attempt, context=self._context, work=self._work, number=submitted.number, inbox=self._inbox
        )
        self._submitted[ref] = submitted
        self._started += 1
        node.running += 1

    def next_events(self) -> Sequence[Event]:
        """Wait a moment for the end of a task: what has happened since the last time."""
        ended, _ = self._ray.wait(list(self._submitted), num_returns=1, timeout=_POLL_S)
        running = {each.number for each in self._submitted.values()}
        # what a task sent before it ended is there: of its messages those that matter were acknowledged
        events = [event for number, event in self._ray.get(self._inbox.take.remote()) if number in running]
        events += [self._end_of(ref) for ref in ended]
        if time.monotonic() - self._looked_s > _LOOK_EVERY_S:
            self._looked_s = time.monotonic()
            self._nodes.look()
        self._settle(0.0)
        return events

    def __enter__(self) -> RayWorkers:
        make_folder(token_file(self._context.folder).parent)
        write_atomically(token_file(self._context.folder), self._nodes.token.encode())
        self._nodes.look()
        problems = []
        while self._nodes.waiting:
            problems += self._nodes.settle(_POLL_S)
        if problems:
            raise UsageError(problems)
        here = pinned(self._ray.get_runtime_context().get_node_id())
        self._inbox = self._ray.remote(num_cpus=0, scheduling_strategy=here)(Inbox).remote()
        return self

    def __exit__(self, *exception: object) -> None:
        """Tasks that still run end when the command leaves the cluster: Ray ends its workers. `ray.cancel` is not
        called: Ray aborts the whole process where a task ends at the same moment."""
        self._submitted.clear()
        self._ray.kill(self._inbox)

    def _settle(self, timeout_s: float) -> None:
        for problem in self._nodes.settle(timeout_s):
            self._warn(f"{problem}; it is not used")

    def _end_of(self, ref: Any) -> Event:
        submitted, errors = self._submitted.pop(ref), self._ray.exceptions
        submitted.node.running -= 1
        try:
            return self._ray.get(ref)
        except errors.RayTaskError as error:
            return Event(kind="failed", stage=submitted.task.id, message=str(error))
        except errors.RayError as error:
            self._nodes.suspect(submitted.node)
            return Event(kind="crashed", stage=submitted.task.id, message=_cause(errors, error, submitted.node))


def _cause(errors: Any, error: Exception, node: Node) -> str:
    if isinstance(error, errors.OutOfMemoryError):
        return f"node {node.name} is short of memory"
    if isinstance(error, errors.WorkerCrashedError):
        return f"the worker on node {node.name} died"
    return f"node {node.name} is lost ({type(error).__name__})"


def _carry_out(task: Task, attempt: Attempt, *, context: RunContext, work: Work, number: int, inbox: Any) -> Event:
    import ray

    def send(event: Event) -> None:
        message = inbox.send.remote(number, event)
        if event.kind == "segment":
            ray.get(message)  # if the process dies now, the place is known

    return carry_out_in_worker(task, attempt, context=context, work=work, send=send)
