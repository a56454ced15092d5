"""The runs in a folder: how far each is, whether its bounds are kept, and how often its egos fail at worst."""

from __future__ import annotations

import csv
import json
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from harness.campaign.results.ci_files import RESULT
from harness.campaign.storage.locks import is_held
from harness.campaign.storage.run_folder import MANIFEST, RunFolder, run_folders_in
from harness.campaign.storage.run_log import LOG
from harness.errors import HarnessError, UsageError
from harness.evaluation.competence import FINISHED
from harness.evaluation.strategies import is_named_of_a_trait, is_named_of_the_naive_ego
from harness.reports.index_page import IndexedRun, WorstCell
from harness.reports.provenance import ego_of, finished_on, scene_of

_LINE = re.compile(r"(?P<time>\S+Z) \S+ +(?P<what>started|done|failed) +(?P<stage>[^\s:]+)")

_COUNTED = ("arm", "persona", "failure_rate", "collisions", "rails", "timeouts", "episodes", "errors")


def runs_in(folder: Path) -> list[IndexedRun]:
    """The runs whose folders are in this one or in a league in it, the latest first; those of a league have its name,
    too: `league-adas/merge`. Raises UsageError if it is no folder."""
    if not folder.is_dir():
        raise UsageError.of(folder, "", "is not a folder", "name the folder that the run folders are in")
    found = [replace(indexed_run(path), name=path.relative_to(folder).as_posix()) for path in run_folders_in(folder)]
    by_name = sorted(found, key=lambda run: run.name)
    return sorted(by_name, key=lambda run: (run.finished_on, (run.folder / MANIFEST).stat().st_mtime), reverse=True)


def indexed_run(path: Path) -> IndexedRun:
    try:
        return _read(RunFolder(path))
    except (HarnessError, OSError, ValueError, LookupError, csv.Error) as error:
        return IndexedRun(folder=path, name=path.name, state="unreadable", problem=str(error))


def _read(folder: RunFolder) -> IndexedRun:
    manifest = folder.listed_manifest()
    summary, result, log = (folder.path / name for name in ("summary.csv", RESULT, LOG))
    for file in (summary, result, log):
        folder.check_link(file)
    entries: Mapping[str, Mapping[str, Any]] = manifest["stages"]
    done = [name for name, entry in entries.items() if entry["status"] in FINISHED]
    has_ended = len(done) == len(entries) and summary.is_file()
    held = not has_ended and is_held(folder.lock)
    begun = _log_of(log) if held else []
    naive, last = _worst(summary) if has_ended else (None, None)
    return IndexedRun(
        folder=folder.path,
        name=folder.path.name,
        state="ended" if has_ended else "running" if held else "interrupted",
        ego=ego_of(manifest),
        scene=scene_of(manifest),
        personas=manifest["personas"],
        seeds=manifest["seeds"],
        finished_on=finished_on(manifest),
        version=manifest["versions"]["harness"],
        quick=bool(manifest.get("quick")),
        stages_done=len(done),
        stages=len(entries),
        running=[stage for stage, ended in _last_events(begun).items() if not ended],
        left_s=_left_s(entries, begun) if held else None,
        accepted=_accepted(result) if has_ended else None,
        naive=naive,
        last=last,
        has_page=has_page(folder.path),
    )


def has_page(path: Path) -> bool:
    """Whether a run has a page: of a published one without a page, `harness serve` makes it from the tables."""
    return (path / "report.html").is_file() or RunFolder(path).is_published


def _accepted(file: Path) -> bool | None:
    return json.loads(file.read_bytes())["accepted"] if file.is_file() else None


def _worst(summary: Path) -> tuple[WorstCell | None, WorstCell | None]:
    """The worst cells of the naive ego, and of the others. The rows of arms without an ego have no failure rate."""
    cells: dict[str, list[int]] = {}
    with summary.open(encoding="utf-8", newline="") as file:  # pandas takes ten times as long for a table so short
        rows = csv.reader(file)
        heading = next(rows, [])
        places = [heading.index(name) for name in _COUNTED]
        for row in rows:
            arm, persona, rate, *counts = (row[place] for place in places)
            if rate and not is_named_of_a_trait(arm, persona):
                collisions, rails, timeouts, episodes, errors = map(int, counts)
                cell = cells.setdefault(arm, [0, 0])
                cell[0] += collisions + rails + timeouts
                cell[1] += episodes - errors
    found = [WorstCell(arm=name, failures=failed, games=games) for name, (failed, games) in cells.items() if games]
    of_naive = [cell for cell in found if is_named_of_the_naive_ego(cell.arm)]
    return _greatest(of_naive), _greatest([cell for cell in found if cell not in of_naive])


def _greatest(cells: Sequence[WorstCell]) -> WorstCell | None:
    return max(cells, key=lambda cell: cell.failures / cell.games, default=None)


# --- a run that is going on ----------------------------------------------------------------------------------------


def _log_of(file: Path) -> list[re.Match[str]]:
    if not file.is_file():
        return []
    lines = file.read_text(encoding="utf-8", errors="replace").splitlines()
    return list(filter(None, map(_LINE.match, lines)))


def _last_events(begun: Sequence[re.Match[str]]) -> dict[str, bool]:
    return {each["stage"]: each["what"] != "started" for each in begun}


def begun_once(path: Path) -> dict[str, datetime]:
    """When each stage of a run began that goes on, by its log; without those that were interrupted before."""
    begun = _log_of(path / LOG)
    counts = Counter(each["stage"] for each in begun)
    return {each["stage"]: _time_of(each) for each in begun if counts[each["stage"]] == 1}


def _time_of(line: re.Match[str]) -> datetime:
    return datetime.strptime(line["time"], "%Y-%m-%dT%H:%M:%SZ").replace(tzinfo=timezone.utc)


def _left_s(entries: Mapping[str, Mapping[str, Any]], begun: Sequence[re.Match[str]]) -> float | None:
    """The time left: the mean duration of the done stages of each kind for each that is not done, at the pace at which
    stages were carried out beside one another."""
    spent: dict[str, list[float]] = {}
    for entry in entries.values():
        if entry["status"] in FINISHED and entry.get("seconds"):
            spent.setdefault(entry["kind"], []).append(entry["seconds"])
    kinds = [entry["kind"] for entry in entries.values() if entry["status"] not in FINISHED]
    if not begun or any(kind not in spent for kind in kinds):
        return None
    elapsed_s = sum(_durations_s(begun))
    total_s = sum(map(sum, spent.values()))
    if not (elapsed_s and total_s):
        return None
    return sum(sum(spent[kind]) / len(spent[kind]) for kind in kinds) * elapsed_s / total_s


def _durations_s(begun: Sequence[re.Match[str]]) -> Iterator[float]:
    """The time in which at least one stage was carried out, between consecutive lines of the log."""
    running: set[str] = set()
    before: datetime | None = None
    for each in begun:
        now = _time_of(each)
        if before is not None and running:
            yield (now - before).total_seconds()
        before = now
        (running.add if each["what"] == "started" else running.discard)(each["stage"])
