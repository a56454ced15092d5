"""The runs in a folder over HTTP: an index, the report of each run, and comparisons of some."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, timezone
from pathlib import Path
from threading import Lock
from urllib.parse import parse_qs, unquote, urlsplit

from harness.campaign.plan.stages import Stage, TrainingStage, strategies_of
from harness.campaign.plan.strategy_stages import training_settings
from harness.campaign.results.compare_runs import compare_runs
from harness.campaign.results.published_run import PublishedReport
from harness.campaign.results.run_index import begun_once, has_page, indexed_run, runs_in
from harness.campaign.results.served_report import PAGE, ServedReport
from harness.campaign.storage.manifest import campaign_in, planned
from harness.campaign.storage.run_folder import RunFolder, run_folders_in
from harness.campaign.storage.training_curves import CHECKPOINT, curves_so_far
from harness.config.campaign import Campaign
from harness.errors import UsageError
from harness.reports.index_page import history_of, in_address, render_index
from harness.reports.learning import learning
from harness.reports.run_tables import RunTables
from harness.reports.running_page import RunningStage, render_running


class ServedRuns:
    """What the server of a folder of runs sends, by path. Runs may begin, go on and end while it serves."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._lock = folder, Lock()
        self._reports: dict[tuple[str, int], ServedReport | PublishedReport] = {}

    def answer(self, path: str) -> tuple[str, bytes] | None:
        """Content type and content of a path; None if there is nothing. Raises UsageError as `ServedReport.answer` and
        `compare_runs` do."""
        parts = urlsplit(path)
        first, *rest = (unquote(part) for part in parts.path.removeprefix("/").split("/"))
        if not first and not rest:
            search = parse_qs(parts.query).get("search", [""])[0]
            return PAGE, render_index(str(self._folder), runs_in(self._folder), search).encode()
        if first == "compare" and len(rest) > 1 and all(map(self._is_run, rest)):
            return self._comparison(rest)
        if first == "history" and len(rest) == 1 and self._is_run(rest[0]):
            of_ego = history_of(rest[0], runs_in(self._folder))
            return self._comparison([run.name for run in of_ego]) if len(of_ego) > 1 else None
        if not rest or not self._is_run(first):
            return None
        run, below = self._folder / first, parts.path.removeprefix("/").partition("/")[2]
        if not has_report(run) and not RunFolder(run).is_published:
            return (PAGE, running_page(run).encode()) if not below else None
        return self._report(first).answer(f"/{below}")

    def _comparison(self, names: Sequence[str]) -> tuple[str, bytes]:
        addresses = [f"/{in_address(name)}/" if has_page(self._folder / name) else "" for name in names]
        return PAGE, compare_runs([self._folder / name for name in names], addresses).page().encode()

    def _is_run(self, name: str) -> bool:
        return name in {path.relative_to(self._folder).as_posix() for path in run_folders_in(self._folder)}

    def _report(self, name: str) -> ServedReport | PublishedReport:
        run = RunFolder(self._folder / name)
        key = (name, run.manifest_file.stat().st_mtime_ns)
        with self._lock:
            if key not in self._reports:
                self._reports = {each: report for each, report in self._reports.items() if each[0] != name}
                self._reports[key] = PublishedReport(run) if run.is_published else ServedReport(run)
            return self._reports[key]


def served(path: Path) -> ServedRuns | ServedReport | PublishedReport:
    """What a server sends of a run folder, or of a folder of run folders. Raises UsageError for any other."""
    folder = RunFolder(path)
    if folder.is_of_runs:
        return ServedRuns(path)
    return PublishedReport(folder) if folder.is_published else ServedReport(folder)


def has_report(path: Path) -> bool:
    """Whether a run has a report, and no command is carrying out its stages."""
    return RunFolder(path).results.is_file() and indexed_run(path).state != "running"


def running_page(path: Path) -> str:
    """The page of a run that has not ended. Raises UsageError for a run that can't be read."""
    folder, run = RunFolder(path), indexed_run(path)
    if run.state == "unreadable":
        raise UsageError.of(path, "", run.problem, "restore the folder, or run the campaign again into another one")
    manifest = folder.manifest()
    stages, campaign = planned(manifest), campaign_in(manifest)
    training = curves_so_far(folder, stages)
    steps = {
        (stage, seed): int(most) for (stage, seed), most in training.groupby(["stage", "seed"])["steps"].max().items()
    }
    now, begun = datetime.now(timezone.utc), begun_once(path)
    shown = [
        _running(each, folder, campaign, steps.get((each.name, each.seed)), begun.get(each.id), now)
        for each in stages
        if each.id in run.running
    ]
    learned = learning(RunTables(manifest=manifest, strategies=strategies_of(stages), training=training))
    going_on = {each.name for each in stages if each.id in run.running}
    curves = sorted(learned, key=lambda curve: curve["stage"] not in going_on)
    return render_running(run, shown, manifest["stages"], curves)


def _running(
    stage: Stage, folder: RunFolder, campaign: Campaign, steps: int | None, begun: datetime | None, now: datetime
) -> RunningStage:
    """A stage that is carried out. The time left of a training is that of its whole budget, at its pace from its
    beginning to its last checkpoint; it is not known before the first one, or where the training was interrupted."""
    since_s = None if begun is None else (now - begun).total_seconds()
    if not isinstance(stage, TrainingStage):
        return RunningStage(name=stage.id, kind=stage.kind, since_s=since_s)
    budget, left_s = training_settings(campaign, stage).steps, None
    checkpoint = folder.work(stage.id) / CHECKPOINT
    if steps and begun is not None and since_s is not None and checkpoint.is_file():
        took_s = checkpoint.stat().st_mtime - begun.timestamp()
        if took_s > 0.0:
            left_s = max(took_s * budget / steps - since_s, 0.0)
    return RunningStage(name=stage.id, kind=stage.kind, since_s=since_s, steps=steps, budget=budget, left_s=left_s)
