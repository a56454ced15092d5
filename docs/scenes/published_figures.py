"""Gaps and speeds of people on foot and on bicycles in run folders, beside published figures.

    python docs/scenes/published_figures.py measure reports/crossing reports/zebra reports/cyclist \\
        --out docs/scenes/published_figures.csv
    python docs/scenes/published_figures.py table docs/scenes/published_figures.csv

The first command reads the traces of the arms `naive_vs_<persona>` of all training seeds. The gap of a game is the
least time that a vehicle would have needed to the lane, at constant speed, when the person entered it; on a marked
crossing, where vehicles yield, gaps are not compared. The mean speed of a game is over its steps on the carriageway of
people on foot, and over all steps of others; the walking speed is over those of the steps in which the person does not
stand.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Hashable, Iterator, Sequence
from dataclasses import dataclass
from math import inf, nan
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pandas as pd
import typer

from harness.environments.recorded import recorded_game
from harness.evaluation.trace_file import read_traces
from harness.files import write_atomically
from harness.game.arrays import FloatArray
from harness.game.roles import NON_EGO
from harness.road.scene.open_scene import OpenScene, open_scene

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, help=__doc__)
HEADER = ("run", "persona", "quantity", "measured", "games", "published", "within", "source")
STANDING_MPS = 0.3
"""A person on foot that is slower stands."""
_WALK, _SPREAD = 1.36, 0.24  # m/s: mean and standard deviation of Randles et al.
_SLOWER = 1.18  # factor on the time of a crossing, of people who text


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A published figure: a range, in which a statistic over games should lie."""

    quantity: str
    measure: str
    """The column of `games_of`."""
    statistic: Callable[[FloatArray], float]
    least: float
    most: float
    unit: str
    source: str


def _percentile(share: float) -> Callable[[FloatArray], float]:
    return lambda values: float(np.percentile(values, share))


def _mean(values: FloatArray) -> float:
    return float(values.mean())


def _speed(quantity: str, least: float, most: float, source: str) -> Figure:
    measure = quantity.replace(" ", "_") + "_mps"
    return Figure(
        quantity=quantity, measure=measure, statistic=_mean, least=least, most=most, unit="m/s", source=source
    )


def _speeds(least: float, most: float, source: str) -> tuple[Figure, Figure]:
    return _speed("mean speed", least, most, source), _speed("walking speed", least, most, source)


GAP = Figure(
    quantity="accepted gap, 5th percentile",
    measure="gap_s",
    statistic=_percentile(5.0),
    least=3.0,
    most=inf,
    unit="s",
    source="DiPietro and King 1970: the least is 3 s",
)
FIGURES = {
    "jaywalker": (
        GAP,
        *_speeds(_WALK - _SPREAD, _WALK + _SPREAD, "Randles et al. 2010: 1.36 m/s, standard deviation 0.24 m/s"),
    ),
    "phone_walker": _speeds(
        _WALK / _SLOWER - _SPREAD, _WALK / _SLOWER + _SPREAD, "the same, 18 % more time (Thompson et al. 2013)"
    ),
    "older_walker": (
        GAP,
        *_speeds(0.92, _WALK, "15th percentile of older people (TCRP Report 112) to the mean of all (Randles et al.)"),
    ),
    "e_scooter": (
        _speed("mean speed", 4.47, 6.71, "Cicchino et al. 2023: 41 % ride at 10 mph or more, 9 % at 15 mph or more"),
    ),
    "red_light_cyclist": (),
}
"""By persona. The sources are those of `personas/`. For the speed of cyclists there is none, nor for the gaps of people
who look at a telephone: they are likelier to cross unsafely."""


@app.command()
def measure(
    runs: Annotated[list[Path], typer.Argument(metavar="RUN...", help="Run folders, with their traces.")],
    out: Annotated[Path, typer.Option(metavar="FILE", help="The table that is written.")],
) -> None:
    """Measure the people of runs, and write a row for each published figure."""
    found = pd.DataFrame([row for run in runs for row in rows_of(run)])
    write_atomically(out, found.to_csv(index=False, float_format="%.4g").encode())


@app.command()
def table(file: Annotated[Path, typer.Argument(metavar="FILE", help="The table that `measure` wrote.")]) -> None:
    """Print the table in Markdown."""
    rows = [cells_of(row) for row in pd.read_csv(file).to_dict("records")]
    print("\n".join("| " + " | ".join(cells) + " |" for cells in (HEADER, ["---"] * len(HEADER), *rows)))


def rows_of(run: Path) -> Iterator[dict[str, Any]]:
    """A row for each published figure of the personas of a run folder. Raises FileNotFoundError if an arm has no
    traces."""
    scene = open_scene(run / "scene")
    manifest = json.loads((run / "manifest.json").read_text(encoding="utf-8"))
    for persona in manifest["personas"]:
        files = [run / "traces" / f"naive_vs_{persona}-seed{seed}.parquet" for seed in manifest["seeds"]]
        games = pd.DataFrame([game for file in files for game in games_of(file, scene)])
        for figure in FIGURES.get(persona, ()):
            if figure is GAP and scene.stripes:
                continue
            values = games[figure.measure].to_numpy(dtype=float)
            values = values[np.isfinite(values)]
            row = {"run": run.name, "persona": persona, "quantity": figure.quantity}
            row |= {"measured": figure.statistic(values) if len(values) else nan, "games": len(values)}
            yield row | {"least": figure.least, "most": figure.most, "unit": figure.unit, "source": figure.source}


def games_of(file: Path, scene: OpenScene) -> Iterator[dict[str, float]]:
    """The accepted gap and the speeds of the person in each game; the gap is inf without a vehicle, a speed NaN without
    a step to measure."""
    for _, trace in read_traces(file):
        game = recorded_game(trace, scene)
        quantities, drove = game.quantities, game.drove[:, NON_EGO]
        gaps_s = [each.gap_s for each in game.encounters[NON_EGO]]
        walking = scene.document.players[NON_EGO].on_foot
        counted = drove & (quantities.on_carriageway[:, NON_EGO] > 0.0) if walking else drove
        speeds = quantities.state.speed_mps[counted, NON_EGO]
        moving = speeds[speeds >= STANDING_MPS]
        yield {
            "gap_s": min(gaps_s, default=inf),
            "mean_speed_mps": float(speeds.mean()) if speeds.size else nan,
            "walking_speed_mps": float(moving.mean()) if moving.size else nan,
        }


def cells_of(row: dict[Hashable, Any]) -> Sequence[str]:
    """The cells of a row of the table in Markdown."""
    unit, least, most, measured = row["unit"], row["least"], row["most"], row["measured"]
    published = f"{least:.2f} to {most:.2f} {unit}" if most < inf else f"{least:.2f} {unit} or more"
    if not row["games"]:
        within, found = "", "none"
    else:
        within, found = "yes" if least <= measured <= most else "no", f"{measured:.2f} {unit}"
    return row["run"], row["persona"], row["quantity"], found, str(row["games"]), published, within, row["source"]


if __name__ == "__main__":
    app()
