"""Running a campaign: from its document to its run folder."""

from __future__ import annotations

import logging
from collections.abc import Collection, Mapping, Sequence
from importlib.util import find_spec
from typing import Any

from rich.console import Console

from harness.campaign.execution.cache_keys import stage_keys
from harness.campaign.execution.progress import StageProgress, event_line
from harness.campaign.execution.repeat_check import varying_drivers
from harness.campaign.execution.run_stages import StartWorkers, run_stages
from harness.campaign.execution.stage_run import Event, run_context_of
from harness.campaign.plan.stages import Stage, TrainingStage
from harness.campaign.preflight import OpenCampaign
from harness.campaign.results.kept_results import RunResult, kept_result
from harness.campaign.storage.learned import Entries, did_not_learn, judged, recorded_goals
from harness.campaign.storage.manifest import FORMAT
from harness.campaign.storage.run_folder import RunFolder
from harness.campaign.storage.run_log import LOGGER
from harness.campaign.storage.versions import versions, versions_of_numbers
from harness.errors import LEARNERS, plain, without_learners
from harness.evaluation.competence import DID_NOT_LEARN, FINISHED
from harness.reports.provenance import mixed_versions, warn

NOTHING_TO_DO = "Nothing to do: every stage is finished, and the results are those of this version."


def run_campaign(
    campaign: OpenCampaign,
    folder: RunFolder,
    start_workers: StartWorkers,
    console: Console,
    *,
    keep_going: bool = False,
) -> RunResult:
    """Carry out what is left of a campaign, and write its tables, replays and report. `keep_going` is that of
    `assessment_stage.play_segments`.

    Raises UsageError if the folder can't be this campaign's. A stage that fails is in the result, not raised.
    """
    folder.claim(campaign.document.name, campaign.quick)
    with folder.held():
        if (kept := _play(campaign, folder, start_workers, console, keep_going)) is not None:
            return kept
        from harness.campaign.results.results import write_results  # imports pandas and statistics

        return write_results(folder, console)


def play_campaign(
    campaign: OpenCampaign, folder: RunFolder, start_workers: StartWorkers, console: Console
) -> RunResult | None:
    """Carry out what is left of a campaign, as `run_campaign` does. The results that are there already, or None: they
    are to be written."""
    folder.claim(campaign.document.name, campaign.quick)
    with folder.held():
        return _play(campaign, folder, start_workers, console, keep_going=False)


def _play(
    campaign: OpenCampaign, folder: RunFolder, start_workers: StartWorkers, console: Console, keep_going: bool
) -> RunResult | None:
    with console.status("playing a game twice"):
        varying = varying_drivers(campaign, folder)
    differences = (*varying.items(), *campaign.learned_elsewhere.items())
    for line in (*campaign.scene.warnings, *(plain(f"{driver}: {words}") for driver, words in differences)):
        console.print(line, style="bold yellow", highlight=False, markup=False)
    stages = campaign.stages
    keys = stage_keys(campaign, stages)
    with console.status("checking what is finished"):
        manifest = _ManifestKeeper(campaign, folder, stages=stages, keys=keys, varying=varying)
        folder.keep_scene(campaign.scene.folder, campaign.scene.document.files)
        finished = [name for name, entry in manifest.content["stages"].items() if entry["status"] in FINISHED]
        quick = ", quick" if campaign.quick else ""
        words = "campaign %s%s: %d stages, %d finished"
        LOGGER.info(words, campaign.document.name, quick, len(stages), len(finished))
        for stage in stages:
            LOGGER.debug("%s %s", "finished" if stage.id in finished else "to do   ", stage.id)
        kept = kept_result(folder, manifest.content) if len(finished) == len(stages) else None
    if kept is not None:
        warn(mixed_versions(manifest.content["stages"]), console)
        console.print(NOTHING_TO_DO, highlight=False)
        LOGGER.info(NOTHING_TO_DO)
        return kept
    _check_learners(stages, finished)
    folder.results.unlink(missing_ok=True)  # they are those of another manifest
    if len(finished) < len(stages):
        left = {"what is left": {"kind": "", "status": "done", "versions": [versions_of_numbers()]}}
        warn(mixed_versions(manifest.content["stages"] | left), console)
        with StageProgress(stages, len(finished), console) as progress:

            def emit(event: Event) -> None:
                incapable = did_not_learn(manifest.content["stages"])
                manifest.note(event)
                progress.show(event)
                log_event(event)
                for training, shortfall in did_not_learn(manifest.content["stages"]).items():
                    if training not in incapable:
                        progress.tell(training, DID_NOT_LEARN, shortfall)
                        LOGGER.warning("%s: %s: %s", DID_NOT_LEARN, training, shortfall)

            context = run_context_of(campaign, folder, keys, keep_going)
            with start_workers(context) as workers:
                run_stages(stages, finished, workers, emit)
    return None


def _check_learners(stages: Sequence[Stage], finished: Collection[str]) -> None:
    """Raise UsageError if a training is left to do without the libraries for it."""
    left = [stage.id for stage in stages if isinstance(stage, TrainingStage) and stage.id not in finished]
    if left and not all(map(find_spec, LEARNERS)):
        raise without_learners(f"training {left[0]}")


def log_event(event: Event) -> None:
    """Write an event of a stage into the run's log. Progress is not logged."""
    levels = {"failed": logging.ERROR, "crashed": logging.WARNING, "skipped": logging.WARNING}
    if event.kind != "progress":
        LOGGER.log(levels.get(event.kind, logging.INFO), "%s", event_line(event))


class _ManifestKeeper:
    """Keeps the manifest in step with what happens. `content` is the manifest as it is on the disk."""

    def __init__(
        self,
        campaign: OpenCampaign,
        folder: RunFolder,
        *,
        stages: Sequence[Stage],
        keys: Mapping[str, str],
        varying: Mapping[str, str],
    ) -> None:
        self._folder, self._campaign, self._plan = folder, campaign.document, stages
        self._entries: Entries = {}
        """Those of the manifest, without the judgements of trainings."""
        for stage in stages:
            about = {"kind": stage.kind, "name": stage.name, "persona": stage.persona, "seed": stage.seed}
            self._entries[stage.id] = {**about, "status": "pending", "message": ""}
            if (info := folder.finished(stage.id, keys[stage.id])) is not None:
                self._entries[stage.id] |= {**info, "status": _status(info)}
        self.content: dict[str, Any] = {
            "format": FORMAT,
            "name": campaign.document.name,
            "file": campaign.file.name,
            "quick": campaign.quick,
            "campaign": campaign.document.recorded(),
            "personas": [persona.name for persona in campaign.personas],
            "ego_persona": campaign.ego_persona.record(),
            "ego_driver": campaign.ego_driver.recorded if campaign.ego_driver is not None else None,
            "persona_documents": {name: each.record() for name, each in campaign.people.items()},
            "seeds": list(campaign.document.seeds),
            "hashes": dict(campaign.hashes),
            "versions": versions(),
        }
        if campaign.baseline is not None:
            self.content["baseline"] = campaign.baseline.name
        if varying:
            self.content["varying_drivers"] = dict(varying)
        if campaign.learned_elsewhere:
            self.content["learned_elsewhere"] = campaign.learned_elsewhere
        self._write()

    def note(self, event: Event) -> None:
        match event.kind:
            case "done":
                changes = {"message": "", **event.info, "status": _status(event.info)}
            case "failed":
                changes = {"status": "failed", "message": event.message}
            case "skipped":
                changes = {"status": "pending", "message": event.message}
            case _:
                return
        self._entries[event.stage].update(changes)
        self._write()

    def _write(self) -> None:
        """Write the manifest with the judgement of each training, which depends on the arm that assesses its player."""
        self.content["stages"] = judged(self._entries, self._campaign, self._plan, recorded_goals(self._entries))
        self._folder.write_manifest(self.content)


def _status(info: Mapping[str, Any]) -> str:
    """The status of a finished stage: `settled` where a gate left nothing to do."""
    return "settled" if info.get("settled") else "done"
