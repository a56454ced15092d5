"""A run folder: what one run of a campaign wrote, and how far it has come.

    manifest.json            campaign, versions, seeds, hashes, status of every stage
    policies/<stage>/        policy.safetensors, policy.json, README.md (its model card)
                             of a reconfiguration: driver.toml
    traces/<stage>.parquet   one file per arm
    scene/                   a copy of the scene's files
    pinned/<game>.toml       failures that `harness minimise` pinned, with what they need to be played again
    harness.log              what the commands did, and when
    .stages/<stage>/         what a stage needs to go on, or to be skipped: checkpoint, trials, segments, tables,
                             done.json
    .stages/results.json     what the tables, replays and report were made from, and their checksums
    .stages/lock             held by the command that is running; lock.owner names its process
    .stages/worker_locks/    a lock per running worker
    .stages/scratch/         temporary files of the workers

A stage is done when `done.json` is there: the checksums of all files that its numbers are read from, with the key of
its inputs, written last. A folder is a run folder once it has a manifest.
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harness.campaign.storage.checksums import mismatches, read_checksums, write_checksums
from harness.campaign.storage.locks import InUse, only_one, wait_for_workers
from harness.campaign.storage.manifest import (
    RUN_AGAIN,
    ListedManifest,
    Manifest,
    StageEntry,
    checksum_of_content,
    done_in,
    read_manifest,
)
from harness.campaign.storage.run_log import LOG, run_log
from harness.errors import Problem, UsageError
from harness.evaluation.strategies import stage_id
from harness.files import content_of, drop_scratch, has_digest, leads_out, links_in, make_folder, write_atomically

MANIFEST = "manifest.json"
JUDGED, TAKEN_OVER = "reference_drivers.csv", "takeovers.csv"
"""The tables that the judgement of an arm's failures makes, of verdicts and of courses."""
_PATIENCE_S = 10.0  # the time that workers of a killed command may take to end
_MOST_MANIFEST_BYTES = 50_000_000
_RUN = "run the campaign again"
_ANY_STAGE = {"kind": "training", "name": "", "seed": 0, "status": "done"}


def run_folders_in(folder: Path) -> list[Path]:
    """The run folders in a folder, and those in a league in it."""
    own = {file.parent for file in folder.glob(f"*/{MANIFEST}")}
    of_leagues = {file.parent for file in folder.glob(f"*/*/{MANIFEST}")}
    return sorted(own | {path for path in of_leagues if path.parent not in own})


def _has_only_locks(folder: Path) -> bool:
    """Whether a folder holds nothing but folders, locks and a log, as a command leaves it that was killed at once."""
    names = [name for _, _, files in os.walk(folder) for name in files if name != LOG]
    return all(name.startswith(("lock", f".{MANIFEST}.")) or name.endswith(".lock") for name in names)


def _refuse(files: Sequence[Path], remedy: str) -> None:
    """Raises UsageError if there is one of these files."""
    if files:
        message = "is missing, or is not what the campaign wrote"
        raise UsageError(Problem(str(file), "", message, remedy) for file in files)


@dataclass(frozen=True)
class RunFolder:
    path: Path

    @property
    def manifest_file(self) -> Path:
        return self.path / MANIFEST

    @property
    def scene(self) -> Path:
        return self.path / "scene"

    @property
    def replays(self) -> Path:
        return self.path / "replays"

    @property
    def pinned(self) -> Path:
        """Where `harness minimise` writes pinned games, unless it is told another folder."""
        return self.path / "pinned"

    @property
    def pinned_games(self) -> list[Path]:
        return sorted(self.pinned.glob("*.toml"))

    def policy(self, stage: str) -> Path:
        return self.path / "policies" / stage

    def traces(self, stage: str) -> Path:
        return self.path / "traces" / f"{stage}.parquet"

    def traces_of_arm(self, arm: str, seed: int) -> Path:
        return self.traces(stage_id(arm, seed))

    def tensorboard(self, stage: str) -> Path:
        return self.path / "tensorboard" / stage

    def work(self, stage: str) -> Path:
        """What a stage keeps for itself."""
        return self.path / ".stages" / stage

    @property
    def scratch(self) -> Path:
        return self.path / ".stages" / "scratch"

    @property
    def workers(self) -> Path:
        """Where every worker registers as long as it lives."""
        return self.path / ".stages" / "worker_locks"

    @property
    def lock(self) -> Path:
        return self.path / ".stages" / "lock"

    def segments(self, stage: str) -> Path:
        return self.work(stage) / "segments"

    @property
    def results(self) -> Path:
        """What the results were made from, and their checksums. A campaign that has something to do removes it."""
        return self.path / ".stages" / "results.json"

    @property
    def is_published(self) -> bool:
        """Whether this is a run's report and tables only, without checksums and what they are made from."""
        return self.manifest_file.is_file() and not self.lock.parent.is_dir()

    @property
    def is_of_runs(self) -> bool:
        """Whether this is no run folder, but a folder that contains some."""
        return not self.manifest_file.is_file() and bool(run_folders_in(self.path))

    # --- stages --------------------------------------------------------------------------------------------------

    def done(self, stage: str) -> dict[str, Any] | None:
        """The content of a stage's `done.json`, whether its checksums match or not; None if there is none."""
        record = read_checksums(self.work(stage) / "done.json")
        try:
            StageEntry.model_validate({**_ANY_STAGE, **(record or {})["info"]})
        except (ValueError, LookupError, TypeError):
            return None
        return record

    def finished(self, stage: str, key: str) -> dict[str, Any] | None:
        """The facts of a stage that was done from these very inputs, without an error; None if it is not done, or if
        its files are missing or damaged."""
        record = self.done(stage)
        if record is None or record.get("key") != key or record["info"].get("errors"):
            return None
        return None if mismatches(record, self.path) else dict(record["info"])

    def begin(self, stage: str, key: str) -> None:
        """Mark a stage as not done, because it starts or continues. What it wrote from other inputs is removed."""
        work = self.work(stage)
        (work / "done.json").unlink(missing_ok=True)
        if not (work / "key").is_file() or (work / "key").read_bytes() != key.encode():
            self.forget(stage)
            make_folder(work)
            write_atomically(work / "key", key.encode())

    def finish(self, stage: str, key: str, info: Mapping[str, Any], files: Sequence[Path] = ()) -> None:
        """Mark a stage as done. Everything it wrote is there; `files` are those that its numbers are read from."""
        write_checksums(self.work(stage) / "done.json", self.path, files, {"key": key, "info": dict(info)})

    # --- the manifest --------------------------------------------------------------------------------------------

    def manifest(self) -> dict[str, Any]:
        """The manifest. Raises UsageError if the folder has none that can be read, or has a link that leads out."""
        manifest = self._manifest(Manifest)
        for place in links_in(self.path):
            self.check_link(place)
        return manifest

    def listed_manifest(self) -> dict[str, Any]:
        """The manifest, checked as far as a list of runs reads it (`ListedManifest`); other files are not looked at.
        Raises UsageError if the folder has none that can be read."""
        return self._manifest(ListedManifest)

    def _manifest(self, form: type[Manifest] | type[ListedManifest]) -> dict[str, Any]:
        self.check_link(self.manifest_file)
        try:
            content = content_of(self.manifest_file, _MOST_MANIFEST_BYTES)
        except (FileNotFoundError, NotADirectoryError):
            message = f"is not a run folder: it has no {MANIFEST}"
            raise UsageError.of(self.path, "", message, "name the folder a campaign wrote") from None
        except OSError as error:
            raise UsageError.of(self.manifest_file, "", f"is damaged: {error.strerror}", RUN_AGAIN) from None
        return read_manifest(self.manifest_file, content, form)

    def check_link(self, place: Path) -> None:
        """Raises UsageError for a link that leads out of the folder: what it points to is not the run's."""
        if place.is_symlink() and leads_out(place, self.path):
            message = "is a link that leads out of the run folder"
            raise UsageError.of(place, "", message, "put there what it points to")

    def check_whole(self, manifest: Mapping[str, Any]) -> None:
        """Raises UsageError where files of the stages are missing, as in a folder that was published without them, or
        are not what the stages wrote, and where the manifest is not what the campaign wrote."""
        self.check_unpublished(manifest)
        damaged = [] if manifest.get("sha256") == checksum_of_content(manifest) else [self.manifest_file]
        for name in done_in(manifest):
            record = self.done(name)
            damaged += [self.work(name) / "done.json"] if record is None else mismatches(record, self.path)
        _refuse([*damaged, *self._changed_scene(manifest)], _RUN)

    def check_unpublished(self, manifest: Mapping[str, Any]) -> None:
        """Raises UsageError for a published folder."""
        if self.is_published:
            message = "holds a report and its tables, but not the files that they are made from"
            see = f"see its page (report.html, or harness serve {self.path})"
            remedy = f"{see}, or play the games: run campaign {manifest['name']!r} again"
            raise UsageError.of(self.path, "", message, remedy)

    def check_games(self, arm: str, seed: int) -> None:
        """Raises UsageError where the traces of an arm or the scene are not as they were when its games were played. A
        published folder is not checked."""
        if not self.is_published:
            traces = self.traces_of_arm(arm, seed).relative_to(self.path).as_posix()
            changed = mismatches(self.done(stage_id(arm, seed)) or {}, self.path, [traces])
            _refuse([*changed, *self._changed_scene(self.manifest())], _RUN)

    def result(self, name: str) -> Path:
        """A file of the results. Raises UsageError where it, or the manifest, is not as the results were written, and
        where the campaign has not ended. A published folder is not checked."""
        if not self.is_published:
            remedy = f"write the results of what is finished: harness report {self.path}"
            record = read_checksums(self.results)
            if record is None:
                raise UsageError.of(self.path, "", "has no results: its campaign has not ended", remedy)
            _refuse(mismatches(record, self.path, [MANIFEST]), _RUN)
            _refuse(mismatches(record, self.path, [name]), remedy)
        return self.path / name

    def _changed_scene(self, manifest: Mapping[str, Any]) -> list[Path]:
        return [file for file in sorted(self.scene.glob("*")) if not has_digest(file, manifest["hashes"].values())]

    def write_manifest(self, manifest: dict[str, Any]) -> None:
        """Write the manifest, which gets the checksum of its content."""
        manifest["sha256"] = checksum_of_content(manifest)
        write_atomically(self.manifest_file, (json.dumps(manifest, indent=2) + "\n").encode())

    def claim(self, campaign: str, quick: bool = False) -> None:
        """Make the folder this campaign's. Raises UsageError if it belongs to another campaign, if it holds a full run
        and this is a quick one (or the reverse), or if it is not a run folder and not empty."""
        try:
            wrong = self._refusal(campaign, quick)
            if not wrong:
                for name in ("policies", "traces", "tensorboard", ".stages"):
                    make_folder(self.path / name)
        except OSError as error:
            wrong = f"can't be written: {error.strerror}"
        if wrong:
            raise UsageError.of(self.path, "", wrong, "choose another folder with --out")

    def _refusal(self, campaign: str, quick: bool) -> str:
        """Why the folder can't be this campaign's; empty if it can."""
        if self.path.exists() and not self.path.is_dir():
            return "is a file"
        if not self.manifest_file.exists():
            unknown = self.path.is_dir() and not _has_only_locks(self.path)
            return "is not empty and not a run folder" if unknown else ""
        manifest = self.manifest()
        if manifest["name"] != campaign:
            return f"belongs to campaign {manifest['name']!r}, not {campaign!r}"
        if manifest["quick"] != quick:
            kinds = ("a full run, which a quick one", "a quick run, which a full one")
            return f"holds {kinds[not quick]} would overwrite"
        return ""

    @contextmanager
    def held(self) -> Iterator[None]:
        """Keep other commands out of the folder during the block. What killed commands left half written is removed.

        Raises UsageError if another command holds it.
        """
        if self.is_published:  # it holds nothing to write from
            yield
            return
        try:
            with only_one(self.lock), run_log(self.path):
                wait_for_workers(self.workers, _PATIENCE_S)
                drop_scratch(self.path)
                shutil.rmtree(self.scratch, ignore_errors=True)
                try:
                    yield
                finally:
                    shutil.rmtree(self.scratch, ignore_errors=True)
                    with suppress(InUse):  # the locks of this command's own workers
                        wait_for_workers(self.workers, 0.0)
        except InUse as holder:
            raise UsageError.of(
                self.path, "", f"is in use by {holder}", "wait until it has ended, or choose another folder with --out"
            ) from None

    def keep_scene(self, folder: Path, files: tuple[str, ...]) -> None:
        """Copy a scene's files, so that the run can be replayed after the scene has changed."""
        make_folder(self.scene)
        for name in files:
            write_atomically(self.scene / name, (folder / name).read_bytes())

    def forget(self, stage: str) -> None:
        """Remove what a stage wrote from other inputs."""
        shutil.rmtree(self.work(stage), ignore_errors=True)
        shutil.rmtree(self.policy(stage), ignore_errors=True)
        shutil.rmtree(self.tensorboard(stage), ignore_errors=True)
        self.traces(stage).unlink(missing_ok=True)
