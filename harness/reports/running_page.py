"""The page of a run that has not ended: what it is doing, how long that takes, and what has been learned so far."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from harness.reports.index_page import RELOAD_S, IndexedRun, state_words
from harness.reports.page_template import page_of


@dataclass(frozen=True, kw_only=True)
class RunningStage:
    name: str
    kind: str
    since_s: float | None
    """How long it has been carried out; None: it was interrupted before, so that this is not known."""
    steps: int | None = None
    """Of a training, at its last checkpoint; None before the first, and of other stages."""
    budget: int | None = None
    """The steps of a training at most; None: the stage is another one."""
    left_s: float | None = None
    """The time that the rest of its budget takes; None: it is not known."""


def render_running(
    run: IndexedRun,
    running: Sequence[RunningStage],
    entries: Mapping[str, Mapping[str, Any]],
    curves: Sequence[Mapping[str, Any]],
) -> str:
    """The page as HTML. `entries` are the stages of the manifest, `curves` those of `learning` in the page's order."""
    return page_of(
        "running",
        run=run,
        state=state_words(run),
        running=running,
        entries=entries,
        curves=curves,
        reload_s=RELOAD_S if run.state == "running" else 0,
    )
