"""One attempt at a stage: what all stages of a run share, what happens on the way, and carrying it out in a worker.

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
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, fields, replace
from functools import cache, lru_cache
from pathlib import Path
from typing import Any, Literal, TypeAlias

from harness.campaign.campaign_players import CampaignPlayers
from harness.campaign.plan.planned_drivers import External
from harness.campaign.plan.stages import AssessmentStage, Stage, TrainingStage, plays_with_errors
from harness.campaign.preflight import OpenCampaign
from harness.campaign.storage.checksums import checksums_of, digest_of
from harness.campaign.storage.locks import held_by_worker
from harness.campaign.storage.run_folder import RunFolder
from harness.campaign.storage.run_log import logged_to
from harness.config.persona import Persona
from harness.drivers.external import ExternalDriver
from harness.errors import HarnessError, is_of_memory, of_system, short_of_memory
from harness.files import make_folder
from harness.road.scene.open_scene import OpenScene, open_scene

SEGMENT_EPISODES = 5
"""Games of an arm that are stored together: one worker plays them."""

OnProgress: TypeAlias = Callable[[int, int], None]
"""Called with what is done of a stage, and with its total: steps, games or trials."""
OnStart: TypeAlias = Callable[[int], None]
"""Called with the number of each segment of a training, game of an arm or trial of a search before it starts: if the
process crashes, the place is known."""


@dataclass(frozen=True, kw_only=True)
class RunContext(CampaignPlayers):
    """What all stages of a run share; small enough to be sent to another process."""

    folder: RunFolder
    roads: tuple[Path, ...] = ()
    """The folders of the scenes on whose roads the egos learn too."""
    keys: Mapping[str, str] = field(default_factory=dict)
    """The cache key of every stage."""
    keep_going: bool = False
    """Whether an arm is played to its end even if its first games can't be played."""

    def persona(self, name: str) -> Persona:
        """A persona of the campaign; the ego's own for the empty name."""
        return self.people[name] if name else self.ego_persona

    def external_driver(self, name: str = "") -> ExternalDriver:
        """An external driver of the campaign: its ego, or another one by name."""
        driver = self.other_egos[name] if name else self.ego_driver
        assert driver is not None
        return driver

    def open_scene(self, stage: Stage) -> OpenScene:
        """The scene as a stage plays on it, with the ego's vehicle type and perception errors."""
        files = digest_of(checksums_of(self.folder.path, sorted(self.folder.scene.glob("*"))))
        return self._with_errors(_opened(self.folder.scene, self._vehicle_type(stage), files), stage)

    def open_roads(self, stage: TrainingStage) -> list[OpenScene]:
        return [self._with_errors(open_scene(each), stage) for each in self.roads] if stage.learns_on_roads else []

    def _with_errors(self, scene: OpenScene, stage: Stage) -> OpenScene:
        errors = self.document.ego.perception_errors if plays_with_errors(stage) else None
        return replace(scene, perception_errors=errors)

    def _vehicle_type(self, stage: Stage) -> str | None:
        """The vehicle type of the ego in a stage; None: the scene's."""
        for driver in stage.drivers:
            if isinstance(driver, External) and driver.name:
                return self.external_driver(driver.name).vehicle_type
        return self.ego_driver.vehicle_type if self.ego_driver is not None else None


@lru_cache(maxsize=2)
def _opened(folder: Path, ego_type: str | None, files: str) -> OpenScene:
    """A scene, opened once for the stages of a worker. `files` is the digest of its files."""
    return open_scene(folder, ego_type)


def run_context_of(
    campaign: OpenCampaign, folder: RunFolder, keys: Mapping[str, str], keep_going: bool = False
) -> RunContext:
    players = {each.name: getattr(campaign, each.name) for each in fields(CampaignPlayers)}
    roads = tuple(each.folder for each in campaign.roads)
    return RunContext(**players, folder=folder, roads=roads, keys=keys, keep_going=keep_going)


@dataclass(frozen=True, kw_only=True)
class Help:
    """Playing some segments of an arm that another worker carries out."""

    arm: AssessmentStage
    number: int
    """Each help of a run has another one."""

    @property
    def id(self) -> str:
        return f"{self.arm.id}+{self.number}"


Task: TypeAlias = Stage | Help
"""What a worker is given."""


@dataclass(frozen=True, kw_only=True)
class Attempt:
    """What earlier attempts at a stage, in this run of the command, leave to the next one."""

    first: bool = True
    """The first attempt plays again the games that could not be played in an earlier run of the command."""
    abandoned: Mapping[int, str] = field(default_factory=dict)
    """Episodes that crashed their worker too often, each with the reason."""

    def batches(self, episodes: Sequence[int]) -> list[Sequence[int]]:
        """Episodes as one batch. After a crash each is played alone, so that its place is known."""
        return [episodes] if self.first else [[episode] for episode in episodes]


@dataclass(frozen=True, kw_only=True)
class StageRun:
    """One attempt to carry out a stage, and what is called on the way."""

    context: RunContext
    attempt: Attempt = Attempt()
    on_progress: OnProgress = lambda done, total: None
    on_start: OnStart = lambda place: None


Work: TypeAlias = Callable[[Task, StageRun], dict[str, Any]]
"""Carries a task out: a stage, of which it returns the facts for the manifest, or help."""


_PROGRESS_EVERY_S = 0.25
_LOST_S = 120.0  # the time that a process on a lost node has to end: Ray ends it, or the file system gives up its lock
_LOGGER = logging.getLogger("harness.preparation")


@dataclass(frozen=True, kw_only=True)
class Event:
    kind: Literal["started", "progress", "segment", "done", "failed", "crashed", "skipped"]
    """segment: a segment of a training, a game of an arm or a trial of a search starts, and `done` is its number. It
    is for `run_stages` alone and is not emitted. progress with a message: what the stage waits for before its own
    work."""
    stage: str
    """The task's id."""
    done: int = 0
    total: int = 0
    message: str = ""
    info: dict[str, Any] = field(default_factory=dict)


Emit: TypeAlias = Callable[[Event], None]


def carry_out_in_worker(task: Task, attempt: Attempt, *, context: RunContext, work: Work, send: Emit) -> Event:
    """Carry a task out in this process, which is registered in the run folder meanwhile.

    Progress and starts of segments are sent; the last event, done or failed, is returned. What a task raises is a
    failure of this task alone.
    """
    last_s = 0.0

    def on_progress(done: int, total: int) -> None:
        nonlocal last_s
        now_s = time.monotonic()
        if now_s - last_s >= _PROGRESS_EVERY_S or done >= total:
            last_s = now_s
            send(Event(kind="progress", stage=task.id, done=done, total=total))

    def on_start(place: int) -> None:
        send(Event(kind="segment", stage=task.id, done=place))

    def on_preparation(what: str, done: int, total: int) -> None:
        send(Event(kind="progress", stage=task.id, done=done, total=total, message=what))

    run = StageRun(context=context, attempt=attempt, on_progress=on_progress, on_start=on_start)
    try:
        _put_scratch_into(context.folder)
        with held_by_worker(context.folder.workers, task.id, _LOST_S), preparations_reported(on_preparation):
            return Event(kind="done", stage=task.id, info=work(task, run))
    except (HarnessError, OSError) as error:
        message = of_system(error) if isinstance(error, OSError) else str(error)
        return Event(kind="failed", stage=task.id, message=message)
    except Exception as error:
        # the message of a bug is its traceback
        message = short_of_memory(error) if is_of_memory(error) else traceback.format_exc()
        return Event(kind="failed", stage=task.id, message=message)


@cache
def _put_scratch_into(folder: RunFolder) -> None:
    """Put the temporary files of this process into a run folder: the next command removes those of a worker that was
    killed."""
    make_folder(folder.scratch)
    os.environ["TMPDIR"] = str(folder.scratch.resolve())
    tempfile.tempdir = None


class _Forwarder(logging.Handler):
    def __init__(self, on_preparation: Callable[[str, int, int], None]) -> None:
        super().__init__(logging.INFO)
        self._on_preparation = on_preparation

    def emit(self, record: logging.LogRecord) -> None:
        self._on_preparation(record.getMessage(), getattr(record, "done", 0), getattr(record, "total", 0))


def preparations_reported(on_preparation: Callable[[str, int, int], None]) -> AbstractContextManager[None]:
    """Report what this process prepares during the block: called with what is prepared, and how many of its parts are
    done and how many there are; 0 of 0: not known."""
    return logged_to(_Forwarder(on_preparation), _LOGGER, logging.INFO)
