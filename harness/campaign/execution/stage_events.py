"""What happens to a stage, as events; and carrying a stage out so that everything that happens is sent as an event.

The code that prepares something (loops that are compiled, nets that are merged) logs it to `harness.preparation`
(`logging`), at INFO, with `done` and `total` of its parts in `extra`: it knows no campaign. Here the records become
events of the stage that waits.
"""

from __future__ import annotations

import logging
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

from harness.campaign.execution.run_context import RunContext
from harness.campaign.execution.stage_run import Attempt, StageRun, Work
from harness.campaign.plan.stages import Stage
from harness.errors import HarnessError, is_of_memory

_PROGRESS_EVERY_S = 0.25
_LOGGER = logging.getLogger("harness.preparation")


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


@dataclass(frozen=True, kw_only=True)
class StageJob:
    """A stage that a process is to carry out."""

    stage: Stage
    attempt: Attempt
    context: RunContext
    work: Work

    def carry_out(self, send: Emit, registered: AbstractContextManager[object]) -> Event:
        """Carry the stage out in this process, inside `registered`. Progress and starts of segments are sent; the last
        event, done or failed, is returned. What a stage raises is a failure of this stage alone."""
        stage, last = self.stage, 0.0

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

        run = StageRun(context=self.context, attempt=self.attempt, on_progress=on_progress, on_start=on_start)
        try:
            with registered, preparations_reported(on_preparation):
                return Event(kind="done", stage=stage.id, info=self.work(stage, run))
        except (HarnessError, OSError) as error:
            return Event(kind="failed", stage=stage.id, message=str(error))
        except Exception as error:
            if is_of_memory(error):
                message = f"the machine is short of memory: {error or 'none is left'}"
            else:
                message = traceback.format_exc()  # a bug: its traceback is the message
            return Event(kind="failed", stage=stage.id, message=message)


OnPreparation: TypeAlias = Callable[[str, int, int], None]
"""Called with what is prepared, and how many of its parts are done and how many there are; 0 of 0: not known."""


class _Forwarder(logging.Handler):
    def __init__(self, on_preparation: OnPreparation) -> None:
        super().__init__(logging.INFO)
        self._on_preparation = on_preparation

    def emit(self, record: logging.LogRecord) -> None:
        self._on_preparation(record.getMessage(), getattr(record, "done", 0), getattr(record, "total", 0))


@contextmanager
def preparations_reported(on_preparation: OnPreparation) -> Iterator[None]:
    """Report what this process prepares during the block."""
    forwarder, level = _Forwarder(on_preparation), _LOGGER.level
    _LOGGER.addHandler(forwarder)
    _LOGGER.setLevel(logging.INFO)
    try:
        yield
    finally:
        _LOGGER.removeHandler(forwarder)
        _LOGGER.setLevel(level)
