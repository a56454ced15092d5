"""Showing how far a run has come: a line per running stage with its rate and the time left, and one for the whole."""

from __future__ import annotations

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

from harness.campaign.execution.worker_pool import Event
from harness.campaign.plan.stages import AssessmentStage, ReconfigurationStage, Stage, TrainingStage

_UNITS = {TrainingStage: "steps", AssessmentStage: "episodes", ReconfigurationStage: "trials"}


class _Rate(ProgressColumn):
    """Steps, episodes or trials a second."""

    def render(self, task: Task) -> Text:
        rate = task.finished_speed or task.speed
        return Text((f"{rate:,.0f}/s" if rate >= 10 else f"{rate:.2g}/s") if rate else "", style="progress.data.speed")


class StageProgress:
    """Shows events of a run; on a terminal as bars, elsewhere as lines."""

    def __init__(self, stages: list[Stage], finished: int, console: Console) -> None:
        self._console = console
        self._units = {stage.id: _UNITS[type(stage)] for stage in stages}
        self._bars = Progress(
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
        )
        self._whole = self._bars.add_task("campaign", total=len(stages), completed=finished, unit="stages")
        self._rows: dict[str, TaskID] = {}

    def __enter__(self) -> StageProgress:
        self._bars.start()
        return self

    def __exit__(self, *exception: object) -> None:
        self._bars.stop()

    def emit(self, event: Event) -> None:
        """Show an event."""
        if event.kind == "progress":
            if event.stage not in self._rows:
                self._rows[event.stage] = self._bars.add_task(event.stage, unit=self._units[event.stage])
            self._bars.update(self._rows[event.stage], completed=event.done, total=event.total)
            return
        if event.kind in ("done", "failed", "died", "skipped") and event.stage in self._rows:
            self._bars.remove_task(self._rows.pop(event.stage))
        if event.kind in ("done", "failed", "skipped"):
            self._bars.advance(self._whole)
        line = self._line(event)
        if line:
            self._bars.console.print(line, highlight=False, soft_wrap=True, markup=False)

    def _line(self, event: Event) -> str:
        if event.kind == "started":
            return "" if self._console.is_terminal else f"started  {event.stage}"
        if event.kind == "done":
            info = event.info
            if "settled" in info:
                return f"settled  {event.stage}: {info['message']}"
            what = f"{info['steps']:,} steps, {info['stopped']}" if "steps" in info else ""
            what = what or next(f"{info[unit]} {unit}" for unit in ("episodes", "trials") if unit in info)
            errors = f", {info['errors']} errors" if info.get("errors") else ""
            return f"done     {event.stage}: {what}{errors} in {info['seconds']:.0f} s"
        return f"{event.kind:8s} {event.stage}: {event.message}"
