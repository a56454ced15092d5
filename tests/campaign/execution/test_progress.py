"""What a user sees of a stage before its first step: what it is waiting for, at once, and with time left."""

from __future__ import annotations

import io
import logging

import pytest
from rich.console import Console

from harness.campaign.execution.progress import STARTING, StageProgress
from harness.campaign.execution.stage_run import Event, preparations_reported
from harness.campaign.plan.plan import plan
from harness.config.campaign import Campaign
from harness.evaluation.competence import DID_NOT_LEARN, Goals

STAGES = plan(Campaign.model_validate({"name": "a", "scene": "b", "personas": ["speedy.toml"]}), ["speedy"])
NAIVE = STAGES[0].id
STARTED = Event(kind="started", stage=NAIVE)
MERGING = [Event(kind="progress", stage=NAIVE, message="merging", done=done, total=3) for done in (0, 2)]
STEP = Event(kind="progress", stage=NAIVE, done=2048, total=4096)


def shown(*events: Event, terminal: bool) -> list[str]:
    """The rows on a terminal, or the lines that are printed elsewhere, after the events."""
    printed = io.StringIO()
    console = Console(file=io.StringIO(), force_terminal=terminal, width=160)
    with StageProgress(STAGES, 0, console) as progress:
        for event in events:
            progress.show(event)
        if terminal:
            Console(file=printed, width=160).print(progress.bars)
        else:
            console.file, printed = io.StringIO(), console.file  # type: ignore[assignment]
    return printed.getvalue().splitlines()


@pytest.mark.parametrize(
    ("events", "words"),
    [([], [STARTING]), (MERGING, ["merging", "2/3"]), ([*MERGING, STEP], ["2048/4096", "steps"])],
)
def test_terminal__the_row_of_a_stage_says_what_it_is_waiting_for_and_then_its_own_work(
    events: list[Event], words: list[str]
) -> None:
    (row,) = (line for line in shown(STARTED, *events, terminal=True) if NAIVE in line)
    assert all(word in row for word in words)
    assert ("merging" in row) == ("merging" in words)


def test_elsewhere__each_preparation_is_one_line() -> None:
    lines = shown(STARTED, *MERGING, STEP, terminal=False)
    assert lines == [f"started  {NAIVE}", f"waiting  {NAIVE}: merging"]


def test_elsewhere__a_running_stage_has_a_line_each_minute_with_the_time_left() -> None:
    console, seconds = Console(file=io.StringIO(), width=160), 0.0
    with StageProgress(STAGES, 0, console, clock=lambda: seconds) as progress:
        progress.show(STARTED)
        for seconds in (0.0, 30.0, 59.0, 60.0, 90.0, 119.0, 120.0):
            progress.show(Event(kind="progress", stage=NAIVE, done=int(1000 * seconds), total=300_000))
    assert console.file.getvalue().splitlines() == [  # type: ignore[attr-defined]
        f"started  {NAIVE}",
        f"running  {NAIVE}: 60,000 of 300,000 steps, 0:04:00 left",
        f"running  {NAIVE}: 120,000 of 300,000 steps, 0:03:00 left",
    ]


def test_elsewhere__games_that_take_minutes_have_a_line_each_with_the_time_left() -> None:
    console, seconds = Console(file=io.StringIO(), width=160), 0.0
    arm = next(stage for stage in STAGES if stage.unit == "episodes")
    with StageProgress(STAGES, 0, console, clock=lambda: seconds) as progress:
        progress.show(Event(kind="started", stage=arm.id))
        for game in range(4):
            seconds = 150.0 * game
            progress.show(Event(kind="progress", stage=arm.id, done=game, total=100))
    assert console.file.getvalue().splitlines()[-1] == (  # type: ignore[attr-defined]
        f"running  {arm.id}: 3 of 100 episodes, 4:02:30 left"
    )


def test_preparations__are_the_log_of_what_is_prepared(caplog: pytest.LogCaptureFixture) -> None:
    told, log = [], logging.getLogger("harness.preparation")
    with preparations_reported(lambda *what: told.append(what)):
        log.info("merging %d copies", 3, extra={"done": 1, "total": 3})
        log.info("loading")
    log.info("after the block")
    assert told == [("merging 3 copies", 1, 3), ("loading", 0, 0)]


def test_tell__a_training_that_did_not_learn_is_named_with_its_share_of_goals() -> None:
    console = Console(file=io.StringIO(), width=80)
    with StageProgress(STAGES, 0, console) as progress:
        progress.tell(NAIVE, DID_NOT_LEARN, Goals(goals=3, played=100).below(0.97))
    assert console.file.getvalue() == (  # type: ignore[attr-defined]
        "did not learn: naive-seed1: alone it reaches its goal in 3 of 100 games (3 %), below 97 %\n"
    )
