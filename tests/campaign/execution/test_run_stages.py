"""The loop that carries a plan out, with workers that are a list of events: no process is started."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import count

import pytest

from harness.campaign.execution.run_stages import HELPED_AFTER_S, MOST_CRASHES, Attempt, run_stages
from harness.campaign.execution.stage_run import SEGMENT_EPISODES, Event, Task
from harness.campaign.plan.stages import AssessmentStage, Stage
from harness.evaluation.strategies import Arm, NaiveEgo
from tests.support.plans import training_of as stage


class Scripted:
    """Workers that report, of each attempt at a stage, what a script says; by default that it is done."""

    def __init__(self, capacity: int, script: Mapping[str, Sequence[Sequence[Event]]] | None = None) -> None:
        self.capacity, self.most_running = capacity, 0
        self._script = {f"{name}-seed1": list(attempts) for name, attempts in (script or {}).items()}
        self.running: list[str] = []
        self.submitted: list[str] = []
        self.attempts: list[Attempt] = []

    def submit(self, task: Task, attempt: Attempt) -> None:
        self.running.append(task.id)
        self.submitted.append(task.id)
        self.most_running = max(self.most_running, len(self.running))
        self.attempts.append(attempt)

    def next_events(self) -> list[Event]:
        name = self.running.pop(0)
        script = self._script.get(name)
        return list(script.pop(0)) if script else [Event(kind="done", stage=name)]


def event(kind: str, name: str, **values: object) -> Event:
    return Event(kind=kind, stage=f"{name}-seed1", **values)  # type: ignore[arg-type]


def run(stages: list[Stage], workers: Scripted, finished: Sequence[str] = ()) -> list[str]:
    """What is emitted, in words."""
    events: list[Event] = []
    run_stages(stages, [f"{name}-seed1" for name in finished], workers, events.append)
    return [f"{each.kind} {each.stage.removesuffix('-seed1')}" for each in events]


CRASH = Event(kind="crashed", stage="a-seed1", message="the worker died")


def test_run_stages__as_many_at_a_time_as_the_workers_take() -> None:
    workers = Scripted(capacity=2)
    said = run([stage(name) for name in "abcde"], workers)
    assert workers.most_running == 2
    assert said[:3] == ["started a", "started b", "done a"]
    assert sorted(said) == sorted(f"{kind} {name}" for kind in ("started", "done") for name in "abcde")


def test_run_stages__workers_may_become_fewer() -> None:
    """As on a cluster that loses a node: what is ready waits for the workers that are left."""
    workers = Scripted(capacity=2, script={"a": [[CRASH]]})
    workers.next_events, report = lambda: setattr(workers, "capacity", 1) or report(), workers.next_events  # type: ignore
    said = run([stage("a"), stage("b")], workers)
    assert said == ["started a", "started b", "crashed a", "done b", "started a", "done a"]


def test_run_stages__a_crash_is_tried_again_and_counted_by_segment() -> None:
    """Two crashes in segment 0 and two in segment 1 are no failure: the stage got farther in between."""
    first, second = ([event("segment", "a", done=place), CRASH] for place in (0, 1))
    workers = Scripted(capacity=1, script={"a": [first, first, second, second]})
    said = run([stage("a")], workers)
    assert said == [*["started a", "crashed a"] * 4, "started a", "done a"]
    assert [attempt.first for attempt in workers.attempts] == [True, False, False, False, False]


def test_run_stages__too_many_crashes_fail_the_stage_and_skip_what_needs_it() -> None:
    workers = Scripted(capacity=1, script={"a": [[CRASH]] * MOST_CRASHES})
    said = run([stage("a"), stage("b", "a"), stage("c")], workers)
    assert said.count("crashed a") == MOST_CRASHES - 1
    assert said[-4:] == ["failed a", "skipped b", "started c", "done c"]


ARM = AssessmentStage(seed=1, persona="", arm=Arm(ego=NaiveEgo()), ego=(), non_ego=())


def helped_arm(left: int, *ends: Event, after_s: float = HELPED_AFTER_S) -> tuple[list[str], list[str]]:
    """An arm that reports how many games are left, in a pool of four; its helpers end as given, then it does. So much
    time passes from one look at the clock to the next. What is emitted, and what is submitted."""
    progress = Event(kind="progress", stage=ARM.id, done=100 - left, total=100)
    reports, workers, events = [progress, *ends, Event(kind="done", stage=ARM.id)], Scripted(4), list[Event]()
    workers.next_events = lambda: [reports.pop(0)]  # type: ignore[method-assign]
    run_stages([ARM], [], workers, events.append, clock=count(0.0, after_s).__next__)
    assert not reports
    return [f"{each.kind} {each.stage}" for each in events if each.kind != "progress"], workers.submitted


def helper(number: int, kind: str, **info: int) -> Event:
    return Event(kind=kind, stage=f"{ARM.id}+{number}", info=info)  # type: ignore[arg-type]


def test_idle_workers__help_with_an_arm_by_no_more_than_its_segments() -> None:
    nothing = [helper(number, "done", segments=0) for number in (1, 2, 3)]
    emitted, submitted = helped_arm(100, *nothing)
    assert emitted == [f"started {ARM.id}", f"done {ARM.id}"]
    assert submitted == [ARM.id, *(f"{ARM.id}+{number}" for number in (1, 2, 3))]
    assert helped_arm(SEGMENT_EPISODES + 1, nothing[0])[1] == [ARM.id, f"{ARM.id}+1"]
    assert helped_arm(SEGMENT_EPISODES)[1] == [ARM.id]


def test_idle_workers__help_with_no_arm_that_has_just_begun() -> None:
    """The start of a worker would take longer than the arm."""
    assert helped_arm(100, after_s=0.9 * HELPED_AFTER_S)[1] == [ARM.id]


def test_idle_workers__help_again_while_there_are_segments() -> None:
    _, submitted = helped_arm(2 * SEGMENT_EPISODES, helper(1, "done", segments=1), helper(2, "done", segments=0))
    assert submitted == [ARM.id, f"{ARM.id}+1", f"{ARM.id}+2"]


@pytest.mark.parametrize("kind", ["crashed", "failed"])
def test_idle_workers__that_crash_or_fail_are_told_and_their_arm_goes_on_alone(kind: str) -> None:
    emitted, submitted = helped_arm(2 * SEGMENT_EPISODES, helper(1, kind))
    assert emitted == [f"started {ARM.id}", f"crashed {ARM.id}+1", f"done {ARM.id}"]
    assert submitted == [ARM.id, f"{ARM.id}+1"]
