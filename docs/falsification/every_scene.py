"""Learned people against searchers: five egos in every shipped scene.

    python docs/falsification/every_scene.py play                            # two hours on two cores
    python docs/falsification/every_scene.py verdicts reports/falsification  # who is sooner, by ego and criterion
    python docs/falsification/every_scene.py scenes reports/falsification    # who finds a failure, by scene

Each ego plays a league, which asks whether it and the people can drive the scenes. Where they can, learned people of
the first training seed and searchers each play searches (`harness falsify`).
"""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Annotated

import pandas as pd
import typer

from harness.config.campaign import Campaign
from harness.config.toml_reading import read_document
from harness.drivers.reference_drivers import UPPER_BOUND
from harness.evaluation.comparisons.games_to_failure import FAILURE, SoonerVerdict
from harness.evaluation.league_columns import NOBODY, SUMO_DRIVER
from harness.evaluation.tables import read_csv

FIRST_SEED = read_document(Path(__file__).parents[2] / "campaigns" / "all-scenes.toml", Campaign).seeds[0]
EGOS = ("adas", "careful_and_competent", "rss", *(f"all-scenes/{ego}-seed{FIRST_SEED}" for ego in ("naive", "robust")))
LEAGUE_GAMES, GAMES, REPEATS = 10, 100, 10
FOLDER = Path("reports/falsification")
TABLE = "falsification.csv"
Folder = Annotated[Path, typer.Argument(help="The folder of the table.")]
app = typer.Typer(no_args_is_help=True, add_completion=False)


@app.command()
def play() -> None:
    """Play the leagues and the searches, and write the table. Run it again to continue."""
    for ego in EGOS:
        if not (league_of(ego) / "league.csv").exists():
            _run("league", "--ego", ego, "--episodes", LEAGUE_GAMES, "--out", league_of(ego))
    searches = [(ego, *found) for ego in EGOS for found in searchable(read_csv(league_of(ego) / "league.csv"))]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        tables = list(pool.map(lambda search: searched(*search), searches))
    pd.concat(tables).to_csv(FOLDER / TABLE, index=False)


def league_of(ego: str) -> Path:
    """The folder of the league of an ego."""
    return FOLDER / "leagues" / Path(ego).name


def searchable(league: pd.DataFrame) -> Iterator[tuple[str, int, list[str]]]:
    """Scene, training seed and arms of the searches of a league: those of the first training seed that are answered,
    where SUMO's driver and a learned person are among them."""
    asked = league[(league["shield"] == "") & (league["person"] != NOBODY)]
    for scene, rows in asked.groupby("scene", sort=True):
        seed = int(rows["seed"].min())
        answered = rows[(rows["seed"] == seed) & (rows["reason"] == "")].sort_values("person")
        people = set(answered["person"])
        if SUMO_DRIVER in people and len(people) > 1:
            yield str(scene), seed, answered["arm"].tolist()


def searched(ego: str, scene: str, seed: int, arms: list[str]) -> pd.DataFrame:
    """Carry out the searches of an ego in a scene, unless they are done; the table `falsification` with both names."""
    folder = FOLDER / "searches" / Path(ego).name / scene
    if not (folder / TABLE).exists():
        options = ("--ego", ego, "--seed", seed, "--games", GAMES, "--repeats", REPEATS, "--out", folder)
        _run("falsify", league_of(ego) / scene, *arms, *options)
    return read_csv(folder / TABLE).assign(ego=Path(ego).name, scene=scene)


def _run(*words: object) -> None:
    subprocess.run(["harness", *map(str, words)], check=True)


@app.command()
def verdicts(folder: Folder = FOLDER) -> None:
    """Print how many comparisons of a learned person with a searcher have which verdict, by ego and criterion."""
    said = [each.value for each in SoonerVerdict]
    _print(["ego", "criterion", "comparisons", *said], verdict_rows(pd.read_csv(folder / TABLE)))


def verdict_rows(table: pd.DataFrame) -> Iterator[list[object]]:
    """A row for each ego and criterion: the comparisons, and how many have each verdict."""
    for (ego, criterion), rows in table.groupby(["ego", "criterion"], sort=False):
        counts = rows["verdict"].value_counts()
        words = str(criterion).replace("_", " ")
        yield [f"`{ego}`", words, len(rows), *(int(counts.get(each.value, 0)) for each in SoonerVerdict)]


@app.command()
def scenes(folder: Folder = FOLDER) -> None:
    """Print how many searches find a failure, and in brackets one that the upper bound prevents, by scene and ego: of
    the learned person, and of the searcher, with the most."""
    table = pd.read_csv(folder / TABLE)
    egos = list(dict.fromkeys(table["ego"]))
    _print(["scene", "starts", *(f"`{ego}`" for ego in egos)], scene_rows(table, egos))


def scene_rows(table: pd.DataFrame, egos: Sequence[str]) -> Iterator[list[object]]:
    """Two rows for each scene, of learned people and of searchers, with a cell for each ego."""
    for scene, rows in table.groupby("scene", sort=True):
        for side, words in (("person", "learned people"), ("searcher", "searchers")):
            cells = (most_found(rows[rows["ego"] == ego], f"found_by_{side}") for ego in egos)
            yield [f"`{scene}`", words, *cells]


def most_found(rows: pd.DataFrame, column: str) -> str:
    """The most searches that found a failure, and in brackets one that the upper bound prevents; "–": none was asked
    for."""
    if rows.empty:
        return "–"
    failure, preventable = (rows.loc[rows["criterion"] == each, column].max() for each in (FAILURE, UPPER_BOUND))
    return f"{failure} ({preventable})"


def _print(header: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    for cells in (header, ["---"] * len(header), *rows):
        print(f"| {' | '.join(map(str, cells))} |")


if __name__ == "__main__":
    app()
