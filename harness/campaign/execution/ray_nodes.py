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

from harness.campaign.execution.run_context import RunContext
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
    """A node, and what runs on it."""

    id: str
    name: str
    """Its address, or the name that `ray start --node-name` gave it."""
    cpus: int
    running: int = 0
    """Number of stages."""


@dataclass(frozen=True, kw_only=True)
class NodeAnswer:
    """What a node answers to a check."""

    versions: Mapping[str, str]
    token: str
    """What it read in the run folder."""
    lock_held: bool
    """Whether it finds the lock of the run folder held."""
    missing: tuple[str, ...]
    """Files that it needs and does not see."""


@dataclass(frozen=True, kw_only=True)
class _Check:
    node: Node
    until_s: float


@dataclass(kw_only=True)
class Nodes:
    """The nodes of the cluster that `ray` is connected to, for a run."""

    ray: Any
    context: RunContext
    token: str
    """Is in `token_file(folder)` as long as the run lasts."""
    usable: dict[str, Node] = field(default_factory=dict)
    _checks: dict[Any, _Check] = field(default_factory=dict)
    _refused: set[str] = field(default_factory=set)

    def look(self) -> None:
        """Start a check of every node that is new, and forget those that are dead."""
        alive = {each["NodeID"]: each for each in self.ray.nodes() if each["Alive"]}
        self.usable = {name: node for name, node in self.usable.items() if name in alive}
        checked = {check.node.id for check in self._checks.values()}
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
        late = [ref for ref, check in self._checks.items() if time.monotonic() > check.until_s and ref not in ended]
        return [problem for ref in (*ended, *late) if (problem := self._end_check(ref, late=ref in late)) is not None]

    @property
    def waiting(self) -> bool:
        """Whether checks have not ended."""
        return bool(self._checks)

    def _start_check(self, node: Node) -> None:
        task = self.ray.remote(num_cpus=0, max_retries=0, scheduling_strategy=pinned(node.id))(answer_of_node)
        ref = task.remote(self.context.folder, _needed_files(self.context))
        self._checks[ref] = _Check(node=node, until_s=time.monotonic() + _ANSWER_S)

    def _end_check(self, ref: Any, late: bool) -> Problem | None:
        check = self._checks.pop(ref)
        problem: Problem | None
        try:
            if late:
                problem = _problem(check.node, f"does not answer within {_ANSWER_S:g} s", _RESTART)
            else:
                problem = problem_of(check.node, self.ray.get(ref), self.context, self.token)
        except self.ray.exceptions.RayTaskError as error:
            last_line = str(error).strip().splitlines()[-1]
            problem = _problem(check.node, f"can't run the harness: {last_line}", _INSTALL)
        except self.ray.exceptions.RayError:  # the node is dead
            return None
        if problem is None:
            self.usable[check.node.id] = check.node
            return None
        self._refused.add(check.node.id)
        return problem


def pinned(node: str) -> Any:
    """The scheduling strategy of what runs on this node or not at all."""
    from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

    return NodeAffinitySchedulingStrategy(node, soft=False)


def token_file(run: Path) -> Path:
    """The file by which a node recognises the run folder."""
    return RunFolder(run).scratch / "token"


def answer_of_node(run: Path, files: Iterable[Path]) -> NodeAnswer:
    """A node's answer to a check. It runs there."""
    try:
        token = token_file(run).read_text(encoding="utf-8")
    except OSError:
        token = ""
    return NodeAnswer(
        versions=versions_of_numbers(),
        token=token,
        lock_held=bool(token) and is_held(RunFolder(run).lock),
        missing=tuple(str(file) for file in files if not file.exists()),
    )


def _needed_files(context: RunContext) -> list[Path]:
    """What stages read outside of the run folder."""
    drivers = [each for each in (context.ego_driver, *context.other_egos.values()) if each is not None]
    policies = [context.policies] if context.policies is not None else []
    return [*policies, *(Path(file) for driver in drivers for file in driver.files)]


def problem_of(node: Node, answer: NodeAnswer, context: RunContext, token: str) -> Problem | None:
    """What is wrong with a node; None if it can be used."""
    pairs = [(name, answer.versions.get(name), ours) for name, ours in versions_of_numbers().items()]
    other = [f"{name} {theirs}, here {ours}" for name, theirs, ours in pairs if theirs != ours]
    if other:
        return _problem(node, f"has other versions than this machine: {'; '.join(other)}", _INSTALL)
    if answer.token != token:
        return _problem(node, f"does not see the run folder {context.folder}", _SHARE)
    if answer.missing:
        return _problem(node, f"does not see {', '.join(answer.missing)}", _SHARE)
    if not answer.lock_held:
        return _problem(node, f"the lock of the run folder {context.folder} does not hold there", _LOCKS)
    return None


def _problem(node: Node, message: str, remedy: str) -> Problem:
    return Problem(OPTION, f"node {node.name}", message, remedy)
