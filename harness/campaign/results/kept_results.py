"""What the results of a run were made from, and their checksums: the same results are not made again.

<run>/.stages/results.json holds a key of everything that results depend on (the manifest, the checksums of the stages'
files and of the pinned games, this program and its libraries), the verdicts for the terminal, and the checksums of the
manifest and of every file of the results, which `RunFolder.result` compares before it is read.
It is written last. Where an input has changed, or a file is missing or damaged, the results are made anew: a record of
earlier results fits neither inputs that have changed nor results that are half made.
"""

from __future__ import annotations

import importlib.metadata
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError

from harness.campaign.storage.checksums import checksums_of, digest_of, intact_record
from harness.campaign.storage.run_folder import MANIFEST, RunFolder
from harness.campaign.storage.versions import digest_of_sources
from harness.config.toml_reading import Document
from harness.errors import FAILED, NOT_ACCEPTED
from harness.files import write_atomically

_DRAWN_WITH = ("jinja2", "junitparser", "markupsafe", "matplotlib", "shapely")
"""Libraries that a report depends on, beside those that the manifest names."""

Line = Annotated[str, Field(max_length=10_000, pattern=r"^[^\x00-\x1f\x7f-\x9f]*$")]
"""A text that is safe to print on a terminal."""


class ShownLine(Document):
    text: Line
    style: Literal["", "green", "bold red", "bold green", "bold yellow"] = ""
    is_failure: bool = False
    """Shown also where the console is quiet."""


class RunResult(Document):
    """The result of a run, for the terminal and the exit code."""

    lines: tuple[ShownLine, ...]
    """Verdicts, what did not learn, what to try, and acceptance checks: for each bound and persona the worst."""
    failed_stages: Mapping[Line, Line]
    """Those that are not finished, each with the reason; empty where there is none yet."""
    error_games: int = Field(ge=0)
    error_reasons: tuple[Line, ...] = ()
    """Why games could not be played, the most frequent reason first."""
    accepted: bool | None
    """Whether every bound is kept; None if the campaign has no bounds."""

    @property
    def exit_code(self) -> int:
        """The exit code of the command. A run with failed stages or games is not judged by its bounds."""
        if self.failed_stages or self.error_games:
            return FAILED
        return NOT_ACCEPTED if self.accepted is False else 0


def kept_result(folder: RunFolder, manifest: Mapping[str, Any]) -> RunResult | None:
    """The result of a run whose results are all there, as this program would make them; None if they are not."""
    record = intact_record(folder.results, folder.path, key=_key(folder, manifest))
    names = {file.relative_to(folder.path).as_posix() for file in _results(folder)}
    if record is None or set(record.get("files", ())) != names:
        return None
    try:
        return RunResult.model_validate_json(json.dumps(record["result"]))
    except (ValidationError, LookupError, ValueError, RecursionError):
        return None


def keep_result(folder: RunFolder, manifest: Mapping[str, Any], result: RunResult) -> None:
    """Write down that the results in the folder are those of this manifest."""
    record = {"key": _key(folder, manifest), "result": result.model_dump(mode="json")}
    record["files"] = checksums_of(folder.path, _results(folder))
    write_atomically(folder.results, (json.dumps(record, indent=1) + "\n").encode())


def _results(folder: RunFolder) -> Iterator[Path]:
    yield from (folder.path / name for name in (MANIFEST, "report.html", "result.json", "junit.xml"))
    yield from sorted(folder.path.glob("*.csv"))
    yield from sorted((folder.path / "policies").glob("*/README.md"))
    yield from (file for file in sorted(folder.replays.rglob("*")) if file.is_file())


def _key(folder: RunFolder, manifest: Mapping[str, Any]) -> str:
    stages = {name: (folder.done(name) or {}).get("files") for name in manifest["stages"]}
    libraries = {name: importlib.metadata.version(name) for name in _DRAWN_WITH}
    pinned = checksums_of(folder.path, folder.pinned_games)
    return digest_of([dict(manifest), stages, libraries, pinned, digest_of_sources()])
