"""Stages in processes: in order, side by side, and whatever dies is named and costs only itself."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path
from typing import Any

import pytest

from harness.campaign.execution.run_stages import MOST_CRASHES, run_stages
from harness.campaign.execution.stage_run import Event, StageRun
from harness.campaign.execution.worker_pool import WorkerPool
from harness.campaign.plan.stages import Stage
from harness.errors import StageFailed
from tests.support.plans import empty_context
from tests.support.plans import training_of as stage
from tests.support.tiny import (
    UNTRAINED,
    assert_interrupted,
    begin_program,
    carried_out,
    tables,
    untrained_run,
    wait_for,
    workers_of,
    write_campaign,
)


def run(folder: Path, stages: list[Stage], work: Any, jobs: int = 2) -> list[Event]:
    events: list[Event] = []
    with WorkerPool(empty_context(folder), jobs, work) as workers:
        run_stages(stages, [], workers, events.append)
    return events


def told(events: list[Event], kind: str) -> list[str]:
    return [event.stage.removesuffix("-seed1") for event in events if event.kind == kind]


# What the workers do here. They are in the processes that run_stages starts, which import this module.


def note(stage: Stage, run: StageRun) -> dict[str, Any]:
    with (run.context.folder.path / "done").open("a") as file:
        file.write(f"{stage.id}\n")
    return {"pid": os.getpid(), "deaf": signal.getsignal(signal.SIGINT) == signal.SIG_IGN}


def report_much(stage: Stage, run: StageRun) -> dict[str, Any]:
    for done in range(1, 1001):
        run.on_progress(done, 1000)
    return {}


def raise_in_b(stage: Stage, run: StageRun) -> dict[str, Any]:
    if stage.id == "b-seed1":
        raise StageFailed("b-seed1: a payoff is not finite")
    if stage.id == "bug-seed1":
        raise KeyError("a bug")
    return {}


def die_in_b(stage: Stage, run: StageRun) -> dict[str, Any]:
    if stage.id == "b-seed1":
        os.kill(os.getpid(), signal.SIGSEGV)
    return {}


def die_when_idle(stage: Stage, run: StageRun) -> dict[str, Any]:
    """Kill whoever else works for the same parent: it has nothing to do."""
    if stage.id == "a-seed1":
        time.sleep(0.5)  # until the other worker has nothing to do
        for pid in workers_of(os.getppid()):
            if pid != os.getpid():
                os.kill(pid, signal.SIGKILL)
    return {}


# ----------------------------------------------------------------------------------------------------------------------


def test_run_stages__each_after_what_it_needs(tmp_path: Path) -> None:
    events = run(tmp_path, [stage("a"), stage("b", "a"), stage("c", "a"), stage("d", "b", "c"), stage("e")], note)
    order = [line.removesuffix("-seed1") for line in (tmp_path / "done").read_text().split()]
    assert order.index("a") < min(order.index("b"), order.index("c"))
    assert order.index("d") > max(order.index("b"), order.index("c"))
    assert sorted(order) == sorted(told(events, "started")) == sorted(told(events, "done")) == ["a", "b", "c", "d", "e"]
    done = [event.info for event in events if event.kind == "done"]
    assert os.getpid() not in {each["pid"] for each in done}
    assert len({each["pid"] for each in done}) <= 2
    assert all(each["deaf"] for each in done)
    assert not workers_of(os.getpid())


def test_of_run__the_same_workers_carry_out_one_run_after_the_other(tmp_path: Path) -> None:
    events: list[Event] = []
    work: Any = note
    with WorkerPool(None, 1, work) as pool:
        for name in ("first", "second"):
            (tmp_path / name).mkdir()
            with pool.of_run(empty_context(tmp_path / name)) as workers:
                run_stages([stage(name)], [], workers, events.append)
        assert len(workers_of(os.getpid())) == 1
    assert len({event.info["pid"] for event in events if event.kind == "done"}) == 1
    assert [(tmp_path / name / "done").read_text() for name in ("first", "second")] == [
        "first-seed1\n",
        "second-seed1\n",
    ]


def test_run_stages__progress_is_told_but_not_all_of_it(tmp_path: Path) -> None:
    events = [event for event in run(tmp_path, [stage("a")], report_much) if event.kind == "progress"]
    assert 1 <= len(events) < 20
    assert (events[-1].done, events[-1].total) == (1000, 1000)


def test_run_stages__a_stage_that_fails_is_named_and_the_rest_goes_on(tmp_path: Path) -> None:
    events = run(tmp_path, [stage("a"), stage("b"), stage("c", "b"), stage("e", "a"), stage("bug")], raise_in_b)
    assert sorted(told(events, "done")) == ["a", "e"]
    messages = {event.stage: event.message for event in events if event.kind in ("failed", "skipped")}
    assert messages["b-seed1"] == "b-seed1: a payoff is not finite"
    assert messages["c-seed1"] == "needs b-seed1, which failed"
    assert "Traceback" in messages["bug-seed1"]
    assert "KeyError: 'a bug'" in messages["bug-seed1"]


def test_run_stages__a_stage_that_always_kills_its_worker_fails_by_name(tmp_path: Path) -> None:
    events = run(tmp_path, [stage("a"), stage("b"), stage("c", "b"), stage("e", "a")], die_in_b, jobs=1)
    assert sorted(told(events, "done")) == ["a", "e"]
    assert told(events, "started").count("b") == MOST_CRASHES
    assert told(events, "crashed") == ["b"] * (MOST_CRASHES - 1)
    (failed,) = (event for event in events if event.kind == "failed")
    assert failed.stage == "b-seed1"
    assert failed.message == f"the worker died of SIGSEGV, {MOST_CRASHES} times"
    assert told(events, "skipped") == ["c"]


def test_run_stages__a_worker_that_dies_with_nothing_to_do_is_replaced(tmp_path: Path) -> None:
    events = run(tmp_path, [stage("a"), stage("b"), stage("c", "a", "b"), stage("d", "a", "b")], die_when_idle)
    assert sorted(told(events, "done")) == ["a", "b", "c", "d"]


def test_run_stages__a_worker_that_dies_under_a_limit_of_memory_names_the_limit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("resource.getrlimit", lambda kind: (3 * 10**9, 3 * 10**9))
    (failed,) = (each for each in run(tmp_path, [stage("b")], die_in_b, jobs=1) if each.kind == "failed")
    assert "SIGSEGV (each process may use 3.0 GB of address space: raise this limit, ulimit -v)" in failed.message


def need_too_much(stage: Stage, run: StageRun) -> dict[str, Any]:
    """Ask the system itself for more memory than it may give, by NumPy and by torch."""
    import resource

    import numpy as np
    import torch

    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + 2**28, resource.RLIM_INFINITY))
    try:
        ask = torch.ones if stage.id == "b-seed1" else np.ones
        ask(2**28 if stage.id < "c" else 1)
        return {}
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))


def test_run_stages__short_of_memory_is_one_message_and_the_rest_goes_on(tmp_path: Path) -> None:
    events = run(tmp_path, [stage("a"), stage("b"), stage("c")], need_too_much, jobs=1)
    failed = {event.stage: event.message for event in events if event.kind == "failed"}
    assert set(failed) == {"a-seed1", "b-seed1"}
    for message in failed.values():
        assert message.startswith("the machine is short of memory: ")
        assert "Traceback" not in message
    assert told(events, "done") == ["c"]


# --- the real command -------------------------------------------------------------------------------------------------


def test_campaign__interrupted_while_its_workers_start_is_uninterrupted_when_it_is_run_again(tmp_path: Path) -> None:
    campaign, run_folder = write_campaign(tmp_path, **UNTRAINED), tmp_path / "run"
    process = begin_program("campaign", campaign, "--out", run_folder, "--jobs", 1)
    wait_for(lambda: workers_of(process.pid), "the first worker")
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does
    assert_interrupted(process, 130)
    assert (run_folder / "manifest.json").is_file()
    carried_out(campaign, run_folder)
    assert tables(run_folder) == tables(untrained_run())
