"""The index of the runs in a folder, as a page and for the terminal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal
from urllib.parse import quote

from harness.reports.numbers import MISSING, duration, percent
from harness.reports.page_template import page_of
from harness.reports.text_table import add_text_row, text_table

if TYPE_CHECKING:
    from rich.table import Table

State = Literal["ended", "running", "interrupted", "unreadable"]

RELOAD_S = 10
"""The list is brought up to date after this time while a run is going on."""
HEADINGS = (
    "run",
    "state",
    "ego",
    "scene",
    "people",
    "seeds",
    "date",
    "harness",
    "naive ego at worst",
    "later egos at worst",
)


@dataclass(frozen=True, kw_only=True)
class WorstCell:
    """The arm in which an ego of a run fails most often, over all training seeds."""

    arm: str
    failures: int
    games: int


@dataclass(frozen=True, kw_only=True)
class IndexedRun:
    folder: Path
    name: str
    state: State
    problem: str = ""
    """Why the run can't be read; empty where it can."""
    ego: str = ""
    scene: str = ""
    personas: Sequence[str] = ()
    seeds: Sequence[int] = ()
    finished_on: str = ""
    """Date of the last stage that ended; empty before the first."""
    version: str = ""
    """Of the harness."""
    quick: bool = False
    stages_done: int = 0
    stages: int = 0
    running: Sequence[str] = ()
    """The stages that are being carried out."""
    left_s: float | None = None
    """An estimate of the time that the rest takes; None where it is not known."""
    accepted: bool | None = None
    """Whether every bound is kept; None without bounds or before the end."""
    naive: WorstCell | None = None
    last: WorstCell | None = None
    """Of the egos that are not naive."""
    has_page: bool = False
    """Whether `harness serve` shows the page of the run."""

    def matches(self, text: str) -> bool:
        """Whether name, ego, scene or a persona contains a text, in any case."""
        return any(text.casefold() in each.casefold() for each in (self.name, self.ego, self.scene, *self.personas))


def render_index(folder: str, runs: Sequence[IndexedRun], search: str = "") -> str:
    """The page as HTML. `runs` are all runs of the folder; those that contain `search` are shown."""
    shown = [run for run in runs if run.matches(search)]
    comparisons = dict(_comparisons(runs))
    rows = [
        {
            "run": run,
            "address": f"{in_address(run.name)}/" if run.has_page or run.state in ("running", "interrupted") else "",
            "state": state_words(run),
            "tone": _tone(run),
            "cells": _cells(run),
            "compare": comparisons.get(run.folder, []),
        }
        for run in shown
    ]
    return page_of(
        "index",
        folder=folder,
        rows=rows,
        runs=len(runs),
        search=search,
        headings=HEADINGS,
        reload_s=RELOAD_S if any(run.state == "running" for run in runs) else 0,
    )


def in_address(name: str) -> str:
    """The name of a run as one part of an address, with that of its league."""
    return quote(name, safe="")


def history_of(name: str, runs: Sequence[IndexedRun]) -> list[IndexedRun]:
    """The runs of the same ego on the same scene that ended, up to the one of this name, the first of them first; empty
    if this one has not ended. `runs` are sorted, the latest first."""
    run = next(each for each in runs if each.name == name)
    ended = [each for each in reversed(runs) if (each.ego, each.scene, each.state) == (run.ego, run.scene, "ended")]
    return ended[: ended.index(run) + 1] if run in ended else []


def _comparisons(runs: Sequence[IndexedRun]) -> Iterator[tuple[Path, list[tuple[str, str]]]]:
    """The folder of each run that ended, with its comparisons with the run before it, and with all before it
    (`history_of`): each in words, with its address."""
    before: dict[tuple[str, str], list[str]] = {}
    for run in reversed(runs):
        if run.state == "ended":
            names, own = before.setdefault((run.ego, run.scene), []), in_address(run.name)
            links = [(f"compare with {names[-1]}", f"compare/{in_address(names[-1])}/{own}")] if names else []
            yield run.folder, links + ([(f"history of {len(names) + 1} runs", f"history/{own}")] if names[1:] else [])
            names.append(run.name)


def terminal_table(runs: Sequence[IndexedRun]) -> Table:
    """The index for the terminal, without what only the page has room for."""
    table = text_table(("run", "scene", "date", "naive fails", "later fails", "state"))
    for run in runs:
        rates = [MISSING if cell is None else percent(cell.failures / cell.games) for cell in (run.naive, run.last)]
        style = "red" if _tone(run) == "harm" else None
        add_text_row(table, run.name, run.scene, run.finished_on, *rates, state_words(run), style=style)
    return table


def record_of(run: IndexedRun) -> dict[str, Any]:
    return asdict(run) | {"folder": str(run.folder)}


def _cells(run: IndexedRun) -> list[str]:
    seeds = ", ".join(map(str, run.seeds)) if len(run.seeds) <= 3 else f"{len(run.seeds)} seeds"
    made = [run.ego, run.scene, ", ".join(run.personas), seeds, run.finished_on, run.version]
    return [*made, _worst(run.naive), _worst(run.last)]


def state_words(run: IndexedRun) -> str:
    match run.state:
        case "unreadable":
            return f"can't be read: {run.problem}"
        case "interrupted":
            return f"interrupted after {run.stages_done} of {run.stages} stages"
        case "running":
            left = "" if run.left_s is None else f", about {duration(run.left_s)} left"
            stages = f": {', '.join(run.running)}" if run.running else ""
            return f"running, {run.stages_done} of {run.stages} stages{left}{stages}"
        case "ended":
            result = {True: "PASS", False: "FAIL", None: "no bounds"}[run.accepted]
            return f"{result} (quick)" if run.quick else result


def _tone(run: IndexedRun) -> str:
    if run.state in ("unreadable", "interrupted") or run.accepted is False:
        return "harm"
    return "mended" if run.accepted else "open"


def _worst(cell: WorstCell | None) -> str:
    if cell is None:
        return MISSING
    return f"{percent(cell.failures / cell.games)} ({cell.failures:,} of {cell.games:,}) in {cell.arm}"
