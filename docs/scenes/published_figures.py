"""Gaps and speeds of people on foot and on bicycles in run folders, beside published figures, as a Markdown table.

    python docs/scenes/published_figures.py reports/crossing reports/zebra reports/cyclist

reads the traces of the arms `naive_vs_<persona>` of all training seeds; arms that are not there yet are left out. The
gap of a game is the least time that a vehicle would have needed to the lane, at constant speed, when the person entered
it; on a marked crossing, where vehicles yield, gaps are not compared. The speed of a game is the mean over its steps on
the carriageway of people on foot, and over all steps of others.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import inf, nan
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from harness.evaluation.encounters import encounters_of
from harness.evaluation.trace_file import read_traces
from harness.evaluation.trace_quantities import drove_in, quantities_of, sizes_by_name
from harness.game.arrays import FloatArray
from harness.game.roles import NON_EGO
from harness.traffic.scene import OpenScene, open_scene

HEADER = ("run", "persona", "quantity", "measured", "games", "published", "within", "source")
_WALK, _SPREAD = 1.36, 0.24  # m/s: mean and standard deviation of Randles et al.
_SLOWER = 1.18  # factor on the time of a crossing, of people who text


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A published figure: a range, in which a statistic over games should lie."""

    quantity: str
    statistic: Callable[[FloatArray], float]
    least: float
    most: float
    unit: str
    source: str


def _percentile(share: float) -> Callable[[FloatArray], float]:
    return lambda values: float(np.percentile(values, share))


def _mean(values: FloatArray) -> float:
    return float(values.mean())


def _speed(least: float, most: float, source: str) -> Figure:
    return Figure(quantity="mean speed", statistic=_mean, least=least, most=most, unit="m/s", source=source)


GAP = Figure(
    quantity="accepted gap, 5th percentile",
    statistic=_percentile(5.0),
    least=3.0,
    most=inf,
    unit="s",
    source="DiPietro and King 1970: the least is 3 s",
)
FIGURES = {
    "jaywalker": (
        GAP,
        _speed(_WALK - _SPREAD, _WALK + _SPREAD, "Randles et al. 2010: 1.36 m/s, standard deviation 0.24 m/s"),
    ),
    "phone_walker": (
        _speed(_WALK / _SLOWER - _SPREAD, _WALK / _SLOWER + _SPREAD, "the same, 18 % more time (Thompson et al. 2013)"),
    ),
    "older_walker": (
        GAP,
        _speed(0.92, _WALK, "15th percentile of older people (TCRP Report 112) to the mean of all (Randles et al.)"),
    ),
    "e_scooter": (_speed(4.47, 6.71, "Cicchino et al. 2023: 41 % ride at 10 mph or more, 9 % at 15 mph or more"),),
    "red_light_cyclist": (),
}
"""By persona. The sources are those of `personas/`. For the speed of cyclists there is none, nor for the gaps of people
who look at a telephone: they are likelier to cross unsafely."""


def main(runs: Annotated[list[Path], typer.Argument(metavar="RUN...", help="Run folders.")]) -> None:
    """Print the table."""
    rows = [row for run in runs for row in rows_of(run)]
    print("\n".join("| " + " | ".join(cells) + " |" for cells in (HEADER, ["---"] * len(HEADER), *rows)))


def rows_of(run: Path) -> Iterator[list[str]]:
    """A row for each published figure of the personas of a run folder."""
    scene = open_scene(run / "scene")
    for persona in json.loads((run / "manifest.json").read_text(encoding="utf-8"))["personas"]:
        files = sorted((run / "traces").glob(f"naive_vs_{persona}-seed*.parquet"))
        games = [game for file in files for game in _games(file, scene)]
        gaps, speeds = (np.array(each) for each in zip(*games, strict=True)) if games else (np.zeros(0),) * 2
        for figure in FIGURES.get(persona, ()):
            if figure is GAP and scene.document.players[NON_EGO].marked_crossing:
                continue
            values = gaps[np.isfinite(gaps)] if figure is GAP else speeds[np.isfinite(speeds)]
            yield [run.name, persona, *_cells(figure, values)]


def _games(file: Path, scene: OpenScene) -> Iterator[tuple[float, float]]:
    """The accepted gap and the mean speed of the person in each game; the gap is inf without a vehicle."""
    sizes_m = {name: (kind.length_m, kind.width_m) for name, kind in scene.routes.types.items()}
    for _, trace in read_traces(file):
        quantities = quantities_of(trace, scene.world, sizes_by_name(trace, sizes_m))
        drove = drove_in(trace, scene.world.roles)[:, NON_EGO]
        gaps_s = [each.gap_s for each in encounters_of(quantities, NON_EGO, drove)]
        walking = scene.document.players[NON_EGO].on_foot
        counted = drove & (quantities.on_carriageway[:, NON_EGO] > 0.0) if walking else drove
        speeds = quantities.state.speed_mps[counted, NON_EGO]
        yield min(gaps_s, default=inf), float(speeds.mean()) if speeds.size else nan


def _cells(figure: Figure, values: FloatArray) -> Sequence[str]:
    published = f"{figure.least:.2f} {figure.unit} or more"
    if figure.most < inf:
        published = f"{figure.least:.2f} to {figure.most:.2f} {figure.unit}"
    if not len(values):
        return figure.quantity, "", "0", published, "", figure.source
    found = figure.statistic(values)
    within = "yes" if figure.least <= found <= figure.most else "no"
    return figure.quantity, f"{found:.2f} {figure.unit}", str(len(values)), published, within, figure.source


if __name__ == "__main__":
    typer.run(main)
