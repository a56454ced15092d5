"""The tables of docs/one-ego-for-all-scenes.md, from the leagues of docs/league/baselines.py.

    python docs/robust/all_scenes.py seeds reports/league      # what was expected of each training, and what it does
    python docs/robust/all_scenes.py scenes reports/league     # failures in each scene, of all trainings together

Each command prints a table in Markdown.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Annotated

import pandas as pd
import typer

from harness.campaign.results.league_games import LEAGUE_GAMES, games_in
from harness.campaign.storage.run_folder import MANIFEST
from harness.config.campaign import Campaign
from harness.config.toml_reading import read_document
from harness.evaluation.comparisons.comparison import mcnemar
from harness.evaluation.comparisons.tied_ranks import GAME
from harness.evaluation.league_columns import NOBODY, SUMO_DRIVER, UNTRAINED
from harness.evaluation.tables import read_csv

ROOT = Path(__file__).parents[2]
CAMPAIGN = read_document(ROOT / "campaigns" / "all-scenes.toml", Campaign)
SCENES, SEEDS = [CAMPAIGN.scene, *CAMPAIGN.roads], CAMPAIGN.seeds
SHIPPED = {
    (found[1], int(found[2]))
    for name in json.loads((ROOT / "reports" / "all-scenes" / MANIFEST).read_bytes())["hashes"]
    if (found := re.search(r"policies/(\w+)/\w+-seed(\d+)/", name))
}
"""Scenes and training seeds of the people that were shipped when these egos learned."""
app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, help=__doc__)
Folder = Annotated[Path, typer.Argument(metavar="FOLDER", help="The folder of the leagues.")]


def games_of(folder: Path, ego: str) -> pd.DataFrame:
    """The games of an ego without a shield, with scene, person and training seed of the person."""
    table = read_csv(folder / ego / LEAGUE_GAMES)
    own = table[table["shield"] == ""]
    return games_in(own).merge(own[["games_sha256", "scene", "person", "seed"]], on="games_sha256")


def met(games: pd.DataFrame, number: int) -> pd.Series:
    """Whether the person is one that the robust ego of a training, counted from 0, has met: of each person that was
    shipped then, one training is left out, unless there is one alone."""
    shipped = pd.MultiIndex.from_frame(games[["scene", "seed"]]).isin(SHIPPED)
    trainings = games.groupby(["scene", "person"])["seed"].transform(lambda own: len(set(own)))
    place = games.groupby(["scene", "person"])["seed"].rank(method="dense") - 1
    return shipped & ((trainings == 1) | (place != number % trainings))


def fails(games: pd.DataFrame) -> str:
    """Failures of games."""
    return f"{int(games['ego_failed'].sum())} of {len(games)}"


@app.command()
def seeds(folder: Folder) -> None:
    """Failures of the naive and the robust ego of each training, alone, beside SUMO's driver and beside people. Kinds
    of games that no ego has played have no row."""
    print("| games | ego | " + " | ".join(f"seed {seed}" for seed in SEEDS) + " |")
    print("| --- | --- |" + " ---: |" * len(SEEDS))
    rows: dict[tuple[str, str], list[str]] = {}
    p_values = []
    for number, seed in enumerate(SEEDS):
        egos = {ego: games_of(folder, f"{ego}-seed{seed}") for ego in ("naive", "robust")}
        for ego, games in egos.items():
            known = games["scene"].isin(SCENES)
            of_person, of_met = ~games["person"].isin(UNTRAINED), met(games, number)
            parts = {
                "alone": known & (games["person"] == NOBODY),
                "beside SUMO's driver": known & (games["person"] == SUMO_DRIVER),
                "people that the robust ego has met": known & of_person & of_met,
                "other people of these scenes": known & of_person & ~of_met,
                "all games of the other scenes": ~known,
            }
            for part, chosen in parts.items():
                rows.setdefault((part, ego), []).append(fails(games[chosen]))
        both = egos["naive"].merge(egos["robust"], on=GAME, suffixes=("_naive", "_robust"))
        both = both[both["scene_naive"].isin(SCENES) & ~both["person_naive"].isin(UNTRAINED)]
        p_values.append(f"{mcnemar(both['ego_failed_naive'] - both['ego_failed_robust'], 'two-sided'):.2g}")
    for (part, ego), cells in sorted(rows.items(), key=lambda row: list(parts).index(row[0][0])):
        if any(not each.endswith(" of 0") for each in cells):
            print(f"| {part} | {ego} | {' | '.join(cells)} |")
    print(f"| people of these scenes, both egos | p (McNemar) | {' | '.join(p_values)} |")


@app.command()
def scenes(folder: Folder) -> None:
    """Failures in each scene, of all trainings together."""
    egos = {ego: pd.concat([games_of(folder, f"{ego}-seed{seed}") for seed in SEEDS]) for ego in ("naive", "robust")}
    print("| scene | learned on it | naive ego fails | robust ego fails |")
    print("| --- | --- | ---: | ---: |")
    for scene in sorted(egos["naive"]["scene"].unique()):
        cells = [fails(games[games["scene"] == scene]) for games in egos.values()]
        print(f"| `{scene}` | {'yes' if scene in SCENES else 'no'} | {' | '.join(cells)} |")


if __name__ == "__main__":
    app()
