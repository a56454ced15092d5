"""Carrying a plan out: what is ready is submitted to workers, and what they report decides what follows.

It knows no processes: `Workers` has two implementations, the processes of this machine (`worker_pool`) and a Ray
cluster (`ray_workers`).

A worker that crashes affects no other: its stage continues from its last segment in another one. After `MOST_CRASHES`
crashes in the same segment a training has failed, by name, and the stages that don't need it continue; after as many in
the same game an arm continues without that game, which is an error.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from typing import Protocol, TypeAlias

from harness.campaign.execution.schedule import Schedule
from harness.campaign.execution.stage_run import Attempt, Emit, Event, RunContext
from harness.campaign.plan.stages import AssessmentStage, PreventabilityStage, Stage

MOST_CRASHES = 3
"""Crashes of one segment or game after which it is not tried again."""
MOST_ABANDONED = 20
"""Games of an arm that may be abandoned in one run of the command. With more, the scene is at fault and not a game."""


class Workers(Protocol):
    """What carries stages out. Workers exist inside the `with` block; none is left after it, however it ends."""

    @property
    def capacity(self) -> int:
        """Number of stages that they can carry out at a time now."""
        ...

    def submit(self, stage: Stage, attempt: Attempt) -> None:
        """Start a stage. It is called only while fewer than `capacity` stages are running."""
        ...

    def next_events(self) -> Sequence[Event]:
        """Wait until something happens to a running stage; the events in their order, possibly none.

        A stage ends with done, failed or crashed. After crashed, nothing of that attempt is reported any more.
        """
        ...

    def __enter__(self) -> Workers: ...
    def __exit__(self, *exception: object) -> None: ...


StartWorkers: TypeAlias = Callable[[RunContext, int], Workers]
"""Makes the workers of a run, from what its stages share and the number of stages that are left."""


class Crashes:
    """Counts crashes by place: a segment of a training, a game of an arm, or the way there (None).

    Only the crashes of this run of the command count: where the whole command was killed, no game is to blame.
    """

    def __init__(self) -> None:
        self._attempted: set[str] = set()
        self._place: dict[str, int] = {}
        self._farthest: dict[str, int] = {}
        self._counts: Counter[tuple[str, int | None]] = Counter()
        self._abandoned: dict[str, dict[int, str]] = {}

    def next_attempt(self, stage: Stage) -> Attempt:
        """What the worker that gets a stage has to know."""
        first = stage.id not in self._attempted
        self._attempted.add(stage.id)
        self._place.pop(stage.id, None)
        return Attempt(first=first, abandoned=dict(self._abandoned.get(stage.id, {})))

    def note_start(self, stage: str, place: int) -> None:
        """A worker starts a segment, game or trial."""
        self._place[stage] = place
        if place > self._farthest.get(stage, -1):  # it got farther: crashes on the way there no longer count
            self._farthest[stage] = place
            del self._counts[stage, None]

    def note_crash(self, stage: Stage, cause: str) -> Event:
        """A worker crashed in a stage, of `cause`. Returns what this means for the stage: crashed, to be tried again,
        or failed."""
        place = self._place.get(stage.id)
        self._counts[stage.id, place] += 1
        if self._counts[stage.id, place] < MOST_CRASHES:
            return Event(kind="crashed", stage=stage.id, message=cause)
        often = f"{cause}, {MOST_CRASHES} times"
        if place is None or not isinstance(stage, AssessmentStage | PreventabilityStage):
            return Event(kind="failed", stage=stage.id, message=often)
        abandoned = self._abandoned.setdefault(stage.id, {})
        abandoned[place] = often
        if len(abandoned) > MOST_ABANDONED:
            message = f"{len(abandoned)} games crashed; the last: {often}"
            return Event(kind="failed", stage=stage.id, message=message)
        return Event(kind="crashed", stage=stage.id, message=f"{often} in game {place}, which is abandoned")


def run_stages(stages: Sequence[Stage], finished: Iterable[str], workers: Workers, emit: Emit) -> None:
    """Carry out every stage that is not finished, each after the stages that it needs.

    Everything that happens is emitted; nothing is raised for a stage that fails. Raises PlanError where the stages
    can't all be carried out in some order.
    """
    schedule, crashes, running = Schedule(stages, finished), Crashes(), dict[str, Stage]()

    def handle(event: Event) -> None:
        """Let schedule and crash counts follow an event of a running stage, and emit it."""
        if event.kind == "segment":
            crashes.note_start(event.stage, event.done)
            return
        if event.kind == "crashed":
            event = crashes.note_crash(running[event.stage], event.message)
        emit(event)
        if event.kind == "progress":
            return
        stage = running.pop(event.stage)
        match event.kind:
            case "crashed":
                schedule.put_back(stage)
            case "failed":
                for skipped, failed in schedule.fail(stage.id).items():
                    emit(Event(kind="skipped", stage=skipped, message=f"needs {', '.join(failed)}, which failed"))
            case _:
                schedule.done(stage.id)

    with workers:
        while True:
            while len(running) < workers.capacity and (stage := schedule.take()) is not None:
                running[stage.id] = stage
                workers.submit(stage, crashes.next_attempt(stage))
                emit(Event(kind="started", stage=stage.id))
            if not running:
                return
            for event in workers.next_events():
                handle(event)
