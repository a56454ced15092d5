"""Shows the progress of a run: a line per running stage with its rate and time left, and one for the whole campaign."""

from __future__ import annotations

from collections.abc import Sequence

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

from harness.campaign.execution.stage_events import Event
from harness.campaign.plan.stages import Stage


class _Rate(ProgressColumn):
    """Steps, episodes or trials a second."""

    def render(self, task: Task) -> Text:
        rate = task.finished_speed or task.speed
        return Text((f"{rate:,.0f}/s" if rate >= 10 else f"{rate:.2g}/s") if rate else "", style="progress.data.speed")


class StageProgress:
    """Shows the events of a run; on a terminal as bars, elsewhere as lines."""

    def __init__(self, stages: Sequence[Stage], finished: int, console: Console) -> None:
        self._console = console
        self._units = {stage.id: stage.unit for stage in stages}
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

    def show(self, event: Event) -> None:
        """Show an event."""
        if event.kind == "progress":
            if event.stage not in self._rows:
                self._rows[event.stage] = self._bars.add_task(event.stage, unit=self._units[event.stage])
            self._bars.update(self._rows[event.stage], completed=event.done, total=event.total)
            return
        if event.kind in ("done", "failed", "crashed", "skipped") and event.stage in self._rows:
            self._bars.remove_task(self._rows.pop(event.stage))
        if event.kind in ("done", "failed", "skipped"):
            self._bars.advance(self._whole)
        line = self._line(event)
        if line:
            self._bars.console.print(line, highlight=False, soft_wrap=True, markup=False)

    def _line(self, event: Event) -> str:
        match event.kind:
            case "started":
                return "" if self._console.is_terminal else f"started  {event.stage}"
            case "done":
                return _done_line(event)
            case _:
                return f"{event.kind:8s} {event.stage}: {event.message}"


def _done_line(event: Event) -> str:
    info = event.info
    if "settled" in info:
        return f"skipped  {event.stage}: {info['message']}"
    amount = f"{info['steps']:,} steps, {info['stopped']}" if "steps" in info else ""
    amount = amount or next(f"{info[unit]} {unit}" for unit in ("episodes", "trials") if unit in info)
    errors = f", {info['errors']} errors" if info.get("errors") else ""
    return f"done     {event.stage}: {amount}{errors} in {info['seconds']:.0f} s"
