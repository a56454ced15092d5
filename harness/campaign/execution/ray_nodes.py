"""The nodes of a Ray cluster that carry stages out: they see the run folder and have the versions of this machine.

Each node is checked before its first stage, also one that joins later, and again after a worker on it has died: the
node may be dead, and Ray notices that only after a while. A node that dies is not used any more.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from harness.campaign.execution.stage_run import RunContext
from harness.campaign.storage.locks import is_held
from harness.campaign.storage.run_folder import RunFolder
from harness.campaign.storage.versions import versions_of_numbers
from harness.errors import Problem

OPTION = "--ray"
_ANSWER_S = 120.0  # the time that a node has to answer: a busy one imports the harness slowly
_INSTALL = "install the versions of requirements.lock on every node"
_SHARE = "use a folder that all nodes share under the same path; --out names the run folder"
_RESTART = "stop Ray on it, or restart it"
_LOCKS = "mount the file system with locks (NFS without local_lock and nolock, Lustre with flock)"


@dataclass(kw_only=True)
class Node:
    id: str
    name: str
    """Its address, or the name that `ray start --node-name` gave it."""
    cpus: int
    running: int = 0
    """Number of stages."""


@dataclass(kw_only=True)
class Nodes:
    """The nodes of the cluster that `ray` is connected to, for a run."""

    ray: Any
    context: RunContext
    token: str
    """Is in `token_file(folder)` as long as the run lasts."""
    usable: dict[str, Node] = field(default_factory=dict)
    _checks: dict[Any, tuple[Node, float]] = field(default_factory=dict)
    """The checks that have not ended: of which node, and the time at which it is late."""
    _refused: set[str] = field(default_factory=set)

    def look(self) -> None:
        """Start a check of every node that is new, and forget those that are dead."""
        alive = {each["NodeID"]: each for each in self.ray.nodes() if each["Alive"]}
        self.usable = {name: node for name, node in self.usable.items() if name in alive}
        checked = {node.id for node, _ in self._checks.values()}
        for name in alive.keys() - self.usable.keys() - checked - self._refused:
            each = alive[name]
            if cpus := int(each["Resources"].get("CPU", 0)):
                self._start_check(Node(id=name, name=each["NodeName"] or each["NodeManagerAddress"], cpus=cpus))

    def suspect(self, node: Node) -> None:
        """Use a node again only after it has answered."""
        if self.usable.pop(node.id, None) is not None:
            self._start_check(node)

    def settle(self, timeout_s: float) -> list[Problem]:
        """Wait for at most `timeout_s` until a check ends. Returns what is wrong with nodes that are refused."""
        if not self._checks:
            return []
        ended, _ = self.ray.wait(list(self._checks), num_returns=1, timeout=timeout_s)
        now_s = time.monotonic()
        late = [ref for ref, (_, until_s) in self._checks.items() if now_s > until_s and ref not in ended]
        return [problem for ref in (*ended, *late) if (problem := self._end_check(ref, late=ref in late)) is not None]

    @property
    def waiting(self) -> bool:
        return bool(self._checks)

    def _start_check(self, node: Node) -> None:
        task = self.ray.remote(num_cpus=0, max_retries=0, scheduling_strategy=pinned(node.id))(wrong_here)
        ref = task.remote(self.context.folder, self.token, _needed_files(self.context), versions_of_numbers())
        self._checks[ref] = node, time.monotonic() + _ANSWER_S

    def _end_check(self, ref: Any, late: bool) -> Problem | None:
        node, _ = self._checks.pop(ref)
        try:
            wrong = (f"does not answer within {_ANSWER_S:g} s", _RESTART) if late else self.ray.get(ref)
        except self.ray.exceptions.RayTaskError as error:
            wrong = f"can't run the harness: {str(error).strip().splitlines()[-1]}", _INSTALL
        except self.ray.exceptions.RayError:  # the node is dead
            return None
        if wrong is None:
            self.usable[node.id] = node
            return None
        self._refused.add(node.id)
        return Problem(OPTION, f"node {node.name}", *wrong)


def pinned(node: str) -> Any:
    """The scheduling strategy of what runs on this node or not at all."""
    from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

    return NodeAffinitySchedulingStrategy(node, soft=False)


def token_file(run: RunFolder) -> Path:
    """The file by which a node recognises the run folder."""
    return run.scratch / "token"


def _needed_files(context: RunContext) -> list[Path]:
    drivers = [each for each in (context.ego_driver, *context.other_egos.values()) if each is not None]
    policies = [context.policies] if context.policies is not None else []
    return [*policies, *(Path(file) for driver in drivers for file in driver.files)]


def wrong_here(
    run: RunFolder, token: str, files: Iterable[Path], versions: Mapping[str, str]
) -> tuple[str, str] | None:
    """What is wrong with the node on which this runs, and the remedy; None if it can be used.

    `token`, `files` and `versions` are what the command has written into the run folder, what it needs, and has itself.
    """
    other = [
        f"{name} {theirs}, here {versions.get(name)}"
        for name, theirs in versions_of_numbers().items()
        if theirs != versions.get(name)
    ]
    if other:
        return f"has other versions than this machine: {'; '.join(other)}", _INSTALL
    try:
        found = token_file(run).read_text(encoding="utf-8")
    except OSError:
        found = ""
    if found != token:
        return f"does not see the run folder {run.path}", _SHARE
    if missing := [str(file) for file in files if not file.exists()]:
        return f"does not see {', '.join(missing)}", _SHARE
    if not is_held(run.lock):
        return f"the lock of the run folder {run.path} does not hold there", _LOCKS
    return None
