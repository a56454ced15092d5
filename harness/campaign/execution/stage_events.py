"""What happens to a stage, as events; and carrying a stage out so that everything that happens is sent as an event."""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

from harness.campaign.execution.crash_retries import Attempt, OnProgress, OnStart
from harness.campaign.execution.preparation import preparations_reported
from harness.campaign.execution.run_context import RunContext
from harness.campaign.plan.stages import Stage
from harness.errors import HarnessError, is_of_memory

_PROGRESS_EVERY_S = 0.25

Work: TypeAlias = Callable[[Stage, RunContext, OnProgress, OnStart, Attempt], dict[str, Any]]
"""Carries a stage out and returns its facts for the manifest."""


@dataclass(frozen=True, kw_only=True)
class Event:
    """Something that happened to a stage."""

    kind: Literal["started", "progress", "segment", "done", "failed", "crashed", "skipped"]
    """segment: a segment of a training, a game of an arm or a trial of a search starts, and `done` is its number. It
    is for `run_stages` alone and is not emitted. progress with a message: what the stage waits for before its own
    work."""
    stage: str
    done: int = 0
    total: int = 0
    message: str = ""
    info: dict[str, Any] = field(default_factory=dict)


Emit: TypeAlias = Callable[[Event], None]


def carry_out_with_events(
    stage: Stage,
    attempt: Attempt,
    context: RunContext,
    work: Work,
    send: Emit,
    registered: AbstractContextManager[object],
) -> Event:
    """Carry a stage out in this process, inside `registered`. Progress and starts of segments are sent; the last event,
    done or failed, is returned. What a stage raises is a failure of this stage alone."""
    last = 0.0

    def on_progress(done: int, total: int) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last >= _PROGRESS_EVERY_S or done >= total:
            last = now
            send(Event(kind="progress", stage=stage.id, done=done, total=total))

    def on_start(place: int) -> None:
        send(Event(kind="segment", stage=stage.id, done=place))

    def on_preparation(what: str, done: int, total: int) -> None:
        send(Event(kind="progress", stage=stage.id, done=done, total=total, message=what))

    try:
        with registered, preparations_reported(on_preparation):
            return Event(kind="done", stage=stage.id, info=work(stage, context, on_progress, on_start, attempt))
    except (HarnessError, OSError) as error:
        return Event(kind="failed", stage=stage.id, message=str(error))
    except Exception as error:
        if is_of_memory(error):
            message = f"the machine is short of memory: {error or 'none is left'}"
        else:
            message = traceback.format_exc()  # a bug: its traceback is the message
        return Event(kind="failed", stage=stage.id, message=message)
