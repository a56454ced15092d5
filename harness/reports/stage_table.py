"""The stages of a run as rows of the page's table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from harness.reports.numbers import duration
from harness.reports.page_wording import stopped

FINISHED = ("done", "settled")
"""Statuses of a stage that is complete."""


@dataclass(frozen=True, kw_only=True)
class StageRow:
    """One stage of the manifest, in words."""

    name: str
    kind: str
    seed: str
    status: str
    steps: str
    stopped: str
    duration: str
    message: str


def stage_rows(stages: Mapping[str, Mapping[str, Any]]) -> list[StageRow]:
    """A row for each stage of the manifest, in its order."""
    return [_row(name, stage) for name, stage in stages.items()]


def unfinished(stages: Mapping[str, Mapping[str, Any]]) -> list[StageRow]:
    """The rows of the stages that are not done."""
    return [_row(name, stage) for name, stage in stages.items() if stage.get("status") not in FINISHED]


def _row(name: str, stage: Mapping[str, Any]) -> StageRow:
    steps, budget = stage.get("steps"), stage.get("budget_steps")
    return StageRow(
        name=name,
        kind=str(stage.get("kind", "")),
        seed=str(stage.get("seed", "")),
        status=str(stage.get("status", "")),
        steps="–" if steps is None else f"{steps:,}" + (f" of {budget:,}" if budget is not None else ""),
        stopped=stopped(stage),
        duration=duration(stage.get("seconds")),
        message=str(stage.get("message") or ""),
    )
