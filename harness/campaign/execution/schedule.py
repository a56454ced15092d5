"""Which stage is carried out next. Pure: it knows stages and their needs, no processes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from graphlib import TopologicalSorter
from typing import Generic, Protocol, TypeVar


class Schedulable(Protocol):
    """What a schedule knows of a stage."""

    @property
    def id(self) -> str: ...
    @property
    def seed(self) -> int: ...
    @property
    def needs(self) -> Sequence[str]: ...


StageT = TypeVar("StageT", bound=Schedulable)


class Schedule(Generic[StageT]):
    """The stages that are left, each handed out when everything that it needs is done.

    Of the stages that are ready, those of the campaign's first seeds come first, so that a seed's results are there
    early; within a seed the one with the longest chain of stages behind it, so that the chain is not what ends last.
    """

    def __init__(self, stages: Sequence[StageT], finished: Iterable[str]) -> None:
        finished = set(finished)
        self._stages = {stage.id: stage for stage in stages if stage.id not in finished}
        needs = {name: [each for each in stage.needs if each not in finished] for name, stage in self._stages.items()}
        self._needed_by: dict[str, list[str]] = {name: [] for name in needs}
        for name, each in needs.items():
            for needed in each:
                self._needed_by[needed].append(name)
        self._sorter = TopologicalSorter(needs)
        self._sorter.prepare()
        self._priorities = _priorities(list(self._stages.values()), self._needed_by)
        self._ready: list[str] = []
        self._failed: set[str] = set()
        self._collect_ready()

    def take(self) -> StageT | None:
        """The next stage to carry out; None if none is ready."""
        return self._stages[self._ready.pop(0)] if self._ready else None

    def put_back(self, stage: StageT) -> None:
        """A stage that was taken is to be carried out again, before any other."""
        self._ready.insert(0, stage.id)

    def done(self, stage: str) -> None:
        """A stage that was taken is done: others may be ready now."""
        self._sorter.done(stage)
        self._collect_ready()

    def fail(self, stage: str) -> dict[str, list[str]]:
        """A stage that was taken has failed. Returns the stages that are skipped because of it, each with the failed or
        skipped stages that it needs."""
        self._failed.add(stage)
        skipped: dict[str, list[str]] = {}
        for name in self._needed_by[stage]:
            if name not in self._failed:
                skipped[name] = [each for each in self._stages[name].needs if each in self._failed]
                skipped |= self.fail(name)
        return skipped

    def _collect_ready(self) -> None:
        self._ready += self._sorter.get_ready()
        self._ready.sort(key=self._priorities.__getitem__)


def _priorities(
    stages: Sequence[Schedulable], needed_by: Mapping[str, Sequence[str]]
) -> dict[str, tuple[int, int, int]]:
    """Of each stage: the place of its seed, the length of the chain behind it (longer first), its place in the plan."""

    @cache
    def chain(name: str) -> int:
        return 1 + max(map(chain, needed_by[name]), default=0)

    seeds = list(dict.fromkeys(stage.seed for stage in stages))
    return {stage.id: (seeds.index(stage.seed), -chain(stage.id), place) for place, stage in enumerate(stages)}
