"""The loop that carries a plan out, with workers that are a list of events: no process is started."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import pytest

from harness.campaign.execution.run_stages import MOST_CRASHES, Attempt, run_stages
from harness.campaign.execution.stage_run import Event
from harness.campaign.plan.stages import Stage
from tests.support.plans import training_of as stage


class Scripted:
    """Workers that report, of each attempt at a stage, what a script says; by default that it is done."""

    def __init__(self, capacity: int, script: Mapping[str, Sequence[Sequence[Event]]] | None = None) -> None:
        self.capacity, self.most_running = capacity, 0
        self._script = {f"{name}-seed1": list(attempts) for name, attempts in (script or {}).items()}
        self.running: list[str] = []
        self.attempts: list[Attempt] = []
        self.entered = self.left = False

    def submit(self, stage: Stage, attempt: Attempt) -> None:
        assert self.entered
        self.running.append(stage.id)
        self.most_running = max(self.most_running, len(self.running))
        self.attempts.append(attempt)

    def next_events(self) -> list[Event]:
        name = self.running.pop(0)
        script = self._script.get(name)
        return list(script.pop(0)) if script else [Event(kind="done", stage=name)]

    def __enter__(self) -> Scripted:
        self.entered = True
        return self

    def __exit__(self, *exception: object) -> None:
        self.left = True


def event(kind: str, name: str, **values: object) -> Event:
    return Event(kind=kind, stage=f"{name}-seed1", **values)  # type: ignore[arg-type]


def run(stages: list[Stage], workers: Scripted, finished: Sequence[str] = ()) -> list[str]:
    """What is emitted, in words."""
    events: list[Event] = []
    run_stages(stages, [f"{name}-seed1" for name in finished], workers, events.append)
    assert workers.left
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


def test_run_stages__workers_end_where_an_event_can_not_be_emitted() -> None:
    workers = Scripted(capacity=1)

    def no_room(event: Event) -> None:
        raise OSError("no space left on device")

    with pytest.raises(OSError, match="no space left"):
        run_stages([stage("a")], [], workers, no_room)
    assert workers.left
