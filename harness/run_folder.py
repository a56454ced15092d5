"""A run folder: what one run of a campaign wrote, and how far it has come.

    manifest.json            campaign, versions, seeds, hashes, status of every stage
    policies/<stage>/        policy.safetensors, policy.json, README.md (its model card)
    traces/<stage>.parquet   one file per arm
    scene/                   a copy of the scene's files
    .stages/<stage>/         what a stage needs to go on, or to be skipped: checkpoint, tables, done.json

A stage is done when `done.json` is there with the key of its inputs; it is written last.
"""

from __future__ import annotations

import json
import os
import re
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harness.documents.manifest import StageEntry, check_manifest, problems_for_report
from harness.errors import Problem, UsageError
from harness.file_content import content_of, leads_out
from harness.files import write_atomically
from harness.rounds import stage_id

FORMAT = 1
MANIFEST = "manifest.json"
_MOST_MANIFEST_BYTES = 50_000_000
_ANY_STAGE = {"kind": "training", "name": "", "seed": 0, "status": "done"}
_STAGE = re.compile(r"[A-Za-z][A-Za-z0-9_]*-seed\d+")


def _check(content: bytes) -> dict[str, Any]:
    """A manifest that is one of ours, as far as others rely on it; names in it become names of files."""
    manifest = check_manifest(content, FORMAT)
    for name, entry in manifest.stages.items():
        if name != stage_id(entry.name, entry.seed) or not _STAGE.fullmatch(name):
            raise ValueError(f"{name!r} is no stage")
    return dict(json.loads(content))


@dataclass(frozen=True)
class RunFolder:
    """Where everything of a run is."""

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

    def policy(self, stage: str) -> Path:
        """The folder of the policy that a stage made."""
        return self.path / "policies" / stage

    def traces(self, stage: str) -> Path:
        """The traces of an arm."""
        return self.path / "traces" / f"{stage}.parquet"

    def tensorboard(self, stage: str) -> Path:
        """TensorBoard's event files of a training."""
        return self.path / "tensorboard" / stage

    def work(self, stage: str) -> Path:
        """What a stage keeps for itself."""
        return self.path / ".stages" / stage

    # --- stages --------------------------------------------------------------------------------------------------

    def finished(self, stage: str, key: str) -> dict[str, Any] | None:
        """What a stage said when it was done from these very inputs; None if it is not done, or its work is gone."""
        try:
            done = json.loads(content_of(self.work(stage) / "done.json", _MOST_MANIFEST_BYTES))
            StageEntry.model_validate({**_ANY_STAGE, **done["info"]})
        except (OSError, ValueError, LookupError, TypeError, RecursionError):
            return None
        made = (self.policy(stage) / "policy.safetensors").is_file() or self.traces(stage).is_file()
        return done["info"] if made and isinstance(done, dict) and done.get("key") == key else None

    def finish(self, stage: str, key: str, info: Mapping[str, Any]) -> None:
        """A stage is done: everything it wrote is there."""
        content = json.dumps({"key": key, "info": info}, indent=2)
        write_atomically(self.work(stage) / "done.json", content.encode())

    # --- the manifest --------------------------------------------------------------------------------------------

    def manifest(self) -> dict[str, Any]:
        """The manifest. Raises UsageError if the folder has none that can be read."""
        try:
            manifest = _check(content_of(self.manifest_file, _MOST_MANIFEST_BYTES))
        except (FileNotFoundError, NotADirectoryError):
            raise UsageError.of(
                self.path, "", f"is not a run folder: it has no {MANIFEST}", "name the folder a campaign wrote"
            ) from None
        except (OSError, ValueError, RecursionError) as error:
            text = error.strerror if isinstance(error, OSError) else error
            raise UsageError.of(
                self.manifest_file, "", f"is damaged: {text}", "run the campaign again into another folder, with --out"
            ) from None
        self._check_links()
        return manifest

    def _check_links(self) -> None:
        """Raises UsageError where the folder has a link that leads out of it: what is behind it is not the run's, to
        be read or to be written over."""
        for folder, folders, files in os.walk(self.path):
            for name in (*folders, *files):
                place = Path(folder) / name
                if place.is_symlink() and leads_out(place, self.path):
                    message = "is a link that leads out of the run folder"
                    raise UsageError.of(place, "", message, "put there what it points to")

    def check_whole(self, manifest: Mapping[str, Any]) -> None:
        """Raises UsageError where what the stages wrote is gone, as in a folder that was published without it, or the
        manifest says what no campaign can be."""
        done = [name for name, entry in manifest["stages"].items() if entry["status"] == "done"]
        if done and not any(self.work(name).is_dir() for name in done):
            raise UsageError.of(
                self.path,
                "",
                "holds a report and its tables, but not what they are made of",
                f"read its report.html, or play the games: run campaign {manifest['name']!r} again",
            )
        remedy = "run the campaign again"
        found = [
            Problem(str(self.manifest_file), key, f"is damaged: {message}", remedy)
            for key, message in problems_for_report(manifest)
        ]
        if found:
            raise UsageError(found)

    def write_manifest(self, manifest: Mapping[str, Any]) -> None:
        """Replace the manifest."""
        write_atomically(self.manifest_file, (json.dumps(manifest, indent=2) + "\n").encode())

    def claim(self, campaign: str, quick: bool = False) -> None:
        """Make the folder this campaign's. Raises UsageError if it is another's, holds its full run and this is a
        quick one (or the other way round), or is no run folder and not empty."""
        try:
            self._check_owner(campaign, quick)
            for name in ("policies", "traces", "tensorboard", ".stages"):
                (self.path / name).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise UsageError.of(
                self.path, "", f"can't be written: {error.strerror}", "choose a folder with --out"
            ) from None

    def _check_owner(self, campaign: str, quick: bool) -> None:
        if self.path.exists() and not self.path.is_dir():
            raise UsageError.of(self.path, "", "is a file", "choose a folder with --out")
        if self.manifest_file.exists():
            manifest = self.manifest()
            wrong = ""
            if manifest["name"] != campaign:
                wrong = f"belongs to campaign {manifest['name']!r}, not {campaign!r}"
            elif bool(manifest.get("quick")) != quick:
                kinds = ("a full run, which a quick one", "a quick run, which a full one")
                wrong = f"holds {kinds[not quick]} would overwrite"
            if wrong:
                raise UsageError.of(self.path, "", wrong, "choose another folder with --out")
        elif self.path.is_dir() and any(self.path.iterdir()):
            raise UsageError.of(self.path, "", "is not empty and not a run folder", "choose another folder with --out")

    def keep_scene(self, folder: Path, files: tuple[str, ...]) -> None:
        """Copy a scene's files, so that the run can be looked at when the scene has changed."""
        self.scene.mkdir(exist_ok=True)
        for name in files:
            write_atomically(self.scene / name, (folder / name).read_bytes())

    def forget(self, stage: str) -> None:
        """Drop what a stage wrote from other inputs."""
        shutil.rmtree(self.work(stage), ignore_errors=True)
        shutil.rmtree(self.policy(stage), ignore_errors=True)
        shutil.rmtree(self.tensorboard(stage), ignore_errors=True)
        self.traces(stage).unlink(missing_ok=True)
