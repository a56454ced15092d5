"""Shows the progress of a run: a line per running stage with its rate and time left, and one for the whole campaign.

A stage's line appears when the stage starts. Until its own work starts, it says what is prepared first.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from datetime import timedelta

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.text import Text

from harness.campaign.execution.stage_run import Event
from harness.campaign.plan.stages import Stage
from harness.wording import counted

STARTING = "starting"
_PACE_S = 600.0  # rates are means over this time: a game of a slow driver takes minutes
LINE_EVERY_S = 60.0
"""Where there are no bars, each running stage has a line so often."""


class _Rate(ProgressColumn):
    def render(self, task: Task) -> Text:
        rate = (task.finished_speed or task.speed) if task.total is not None else None
        return Text((f"{rate:,.0f}/s" if rate >= 10 else f"{rate:.2g}/s") if rate else "", style="progress.data.speed")


class StageProgress:
    """Shows the events of a run; on a terminal as bars, elsewhere as lines. `clock` gives seconds."""

    def __init__(
        self, stages: Sequence[Stage], finished: int, console: Console, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._console, self._clock = console, clock
        self._units = {stage.id: stage.unit for stage in stages}
        self.bars = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[unit]}"),
            _Rate(),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
            console=console,
            disable=not console.is_terminal,
            transient=True,
            get_time=clock,
            speed_estimate_period=_PACE_S,
        )
        self._whole = self.bars.add_task("campaign", total=len(stages), completed=finished, unit="stages")
        self._rows: dict[str, TaskID] = {}
        self._preparing: dict[str, str] = {}
        """What each running stage is waiting for, if its own work has not started."""
        self._line_due_s: dict[str, float] = {}

    def __enter__(self) -> StageProgress:
        self.bars.start()
        return self

    def __exit__(self, *exception: object) -> None:
        self.bars.stop()

    def show(self, event: Event) -> None:
        if event.kind == "progress":
            self._show_progress(event)
        if event.kind == "started":
            self._preparing[event.stage] = STARTING
            self._line_due_s[event.stage] = self._clock() + LINE_EVERY_S
            self._rows[event.stage] = self.bars.add_task(event.stage, total=None, unit=STARTING)
        if event.kind in ("done", "failed", "crashed", "skipped") and event.stage in self._rows:
            self.bars.remove_task(self._rows.pop(event.stage))
        if event.kind in ("done", "failed", "skipped"):
            self.bars.advance(self._whole)
        shown = event.kind != "started" or not self._console.is_terminal  # there its bar shows that it started
        if shown and (line := event_line(event)):
            self.bars.console.print(line, highlight=False, soft_wrap=True, markup=False)

    def tell(self, stage: str, what: str, message: str) -> None:
        """Say what has turned out about a stage that is done."""
        self.bars.console.print(f"{what}: {stage}: {message}", highlight=False, soft_wrap=True, markup=False)

    def _show_progress(self, event: Event) -> None:
        """Move a stage's bar; it starts again where another kind of work starts."""
        row, unit = self._rows[event.stage], event.message or self._units[event.stage]
        if event.message != self._preparing[event.stage]:
            self._preparing[event.stage] = event.message
            self.bars.reset(row, unit=unit)
            if event.message and not self._console.is_terminal:
                line = f"waiting  {event.stage}: {event.message}"
                self._console.print(line, highlight=False, soft_wrap=True, markup=False)
        self.bars.update(row, completed=event.done, total=event.total or None)
        if not self._console.is_terminal and event.total and self._clock() >= self._line_due_s[event.stage]:
            self._line_due_s[event.stage] = self._clock() + LINE_EVERY_S
            task = next(each for each in self.bars.tasks if each.id == row)
            self._console.print(_running_line(event, unit, task), highlight=False, soft_wrap=True, markup=False)


def event_line(event: Event) -> str:
    match event.kind:
        case "progress":
            return ""
        case "started":
            return f"started  {event.stage}"
        case "done":
            return _done_line(event)
        case _:
            return f"{event.kind:8s} {event.stage}: {event.message}"


def _running_line(event: Event, unit: str, task: Task) -> str:
    left_s = task.time_remaining
    left = f", {timedelta(seconds=round(left_s))} left" if left_s is not None else ""
    done = f"{event.done:,} of {event.total:,}"
    what = f"waiting  {event.stage}: {unit}, {done}" if event.message else f"running  {event.stage}: {done} {unit}"
    return what + left


def _done_line(event: Event) -> str:
    info = event.info
    if "settled" in info:
        return f"skipped  {event.stage}: {info['message']}"
    if "learned_in" in info:
        return f"done     {event.stage}: from {info['learned_in']}"
    amount = f"{info['steps']:,} steps, {info['stopped']}" if "steps" in info else ""
    amount = amount or next(counted(info[f"{unit}s"], unit) for unit in ("episode", "trial") if f"{unit}s" in info)
    amount += f", chosen: {info['chosen']}" if "chosen" in info else ""
    errors = f", {info['errors']} errors" if info.get("errors") else ""
    return f"done     {event.stage}: {amount}{errors} in {info['seconds']:.0f} s"
