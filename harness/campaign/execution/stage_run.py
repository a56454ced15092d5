"""What a stage is carried out with, and what it makes."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeAlias

from harness.campaign.execution.run_context import RunContext
from harness.campaign.plan.stages import Stage
from harness.campaign.storage.run_folder import RunFolder
from harness.campaign.storage.versions import versions_of_numbers
from harness.files import write_atomically
from harness.road.scene.open_scene import OpenScene

OnProgress: TypeAlias = Callable[[int, int], None]
"""Called with what is done of a stage, and with its total: steps, games or trials."""
OnStart: TypeAlias = Callable[[int], None]
"""Called with the number of each segment of a training, game of an arm or trial of a search before it starts: if the
process crashes, the place is known."""


@dataclass(frozen=True, kw_only=True)
class Attempt:
    """What earlier attempts at a stage, in this run of the command, leave to the next one."""

    first: bool = True
    """The first attempt plays again the games that could not be played in an earlier run of the command."""
    abandoned: Mapping[int, str] = field(default_factory=dict)
    """Episodes that crashed their worker too often, each with the reason."""


@dataclass(frozen=True, kw_only=True)
class StageRun:
    """One attempt to carry out a stage, and who is told of it."""

    context: RunContext
    attempt: Attempt = Attempt()
    on_progress: OnProgress = lambda done, total: None
    on_start: OnStart = lambda place: None

    @property
    def folder(self) -> RunFolder:
        """The run folder."""
        return RunFolder(self.context.folder)


Work: TypeAlias = Callable[[Stage, StageRun], dict[str, Any]]
"""Carries a stage out and returns its facts for the manifest."""


@dataclass(frozen=True, kw_only=True)
class StageInputs:
    """An attempt at a stage with its scene open."""

    run: StageRun
    scene: OpenScene

    @property
    def people(self) -> int:
        """The number of non-egos of the scene."""
        return len(self.scene.world.roles) - 1


@dataclass(frozen=True, kw_only=True)
class Made:
    """What a stage made: facts for the manifest, and the files that its numbers are read from."""

    facts: dict[str, Any]
    files: list[Path]


def versions_since(checkpoint: Path, also: Mapping[str, str] = MappingProxyType({})) -> list[dict[str, str]]:
    """The versions that make a training or search: several, if it continues what other versions started."""
    file, now = checkpoint.with_name("versions.json"), {**versions_of_numbers(), **also}
    try:
        before = json.loads(file.read_text(encoding="utf-8")) if checkpoint.is_file() else []
    except (OSError, ValueError):
        before = []
    versions = [*before, now] if isinstance(before, list) and now not in before else before or [now]
    write_atomically(file, json.dumps(versions).encode())
    return versions
