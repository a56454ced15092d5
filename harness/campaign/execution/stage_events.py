"""What happens to a stage, as events; and carrying a stage out in a worker, so that everything is sent as an event.

The code that prepares something (loops that are compiled, nets that are merged) logs it to `harness.preparation`
(`logging`), at INFO, with `done` and `total` of its parts in `extra`: it knows no campaign. Here the records become
events of the stage that waits.
"""

from __future__ import annotations

import logging
import os
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache
from typing import Any, Literal, TypeAlias

from harness.campaign.execution.stage_run import Attempt, RunContext, StageRun, Work
from harness.campaign.plan.stages import Stage
from harness.campaign.storage.locks import held_by_worker
from harness.campaign.storage.run_folder import RunFolder
from harness.errors import HarnessError, is_of_memory
from harness.files import make_folder

_PROGRESS_EVERY_S = 0.25
_LOST_S = 120.0  # the time that a process on a lost node has to end: Ray ends it, or the file system gives up its lock
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


def carry_out_in_worker(stage: Stage, attempt: Attempt, *, context: RunContext, work: Work, send: Emit) -> Event:
    """Carry a stage out in this process, which is registered in the run folder meanwhile.

    Progress and starts of segments are sent; the last event, done or failed, is returned. What a stage raises is a
    failure of this stage alone.
    """
    last_s = 0.0

    def on_progress(done: int, total: int) -> None:
        nonlocal last_s
        now_s = time.monotonic()
        if now_s - last_s >= _PROGRESS_EVERY_S or done >= total:
            last_s = now_s
            send(Event(kind="progress", stage=stage.id, done=done, total=total))

    def on_start(place: int) -> None:
        send(Event(kind="segment", stage=stage.id, done=place))

    def on_preparation(what: str, done: int, total: int) -> None:
        send(Event(kind="progress", stage=stage.id, done=done, total=total, message=what))

    run = StageRun(context=context, attempt=attempt, on_progress=on_progress, on_start=on_start)
    try:
        _put_scratch_into(context.folder)
        with held_by_worker(context.folder.workers, stage.id, _LOST_S), preparations_reported(on_preparation):
            return Event(kind="done", stage=stage.id, info=work(stage, run))
    except (HarnessError, OSError) as error:
        return Event(kind="failed", stage=stage.id, message=str(error))
    except Exception as error:
        if is_of_memory(error):
            message = f"the machine is short of memory: {error or 'none is left'}"
        else:
            message = traceback.format_exc()  # a bug: its traceback is the message
        return Event(kind="failed", stage=stage.id, message=message)


@cache
def _put_scratch_into(folder: RunFolder) -> None:
    """Put the temporary files of this process into a run folder: the next command removes those of a worker that was
    killed."""
    make_folder(folder.scratch)
    os.environ["TMPDIR"] = str(folder.scratch.resolve())
    tempfile.tempdir = None


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
