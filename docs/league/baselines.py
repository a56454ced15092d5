"""How the shipped egos, by rules and learned on all scenes, and SUMO's driver come through all scenes.

python docs/league/baselines.py play                   # their leagues and ranks: about an hour on two cores
python docs/league/baselines.py play --scenes cut_in   # after a change of its people: this scene alone
python docs/league/baselines.py table reports/league   # the ranks as a Markdown table
python docs/league/baselines.py scenes reports/league  # the games that each ego fails, by scene
"""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Annotated

import pandas as pd
import typer

from harness.campaign.results.ci_files import RESULT, write_record
from harness.campaign.results.league_table import worst_pairings_first
from harness.config.campaign import Campaign
from harness.config.toml_reading import read_document
from harness.evaluation.comparisons.tied_ranks import with_shield
from harness.evaluation.tables import read_csv, rows_in_json, write_csv

RULES = ("sumo", "adas", "careful_and_competent", "fuzzy", "rss")
SHIELDED = RULES[1:]  # SUMO's driver has no decision that a shield could check
ALL_SCENES = read_document(Path(__file__).parents[2] / "campaigns" / "all-scenes.toml", Campaign)
LEARNED = tuple(f"all-scenes/{ego}-seed{seed}" for ego in ("naive", "robust") for seed in ALL_SCENES.seeds)
GAMES = 10
FOLDER = Path("reports/league")
PARTS = Path("reports/league-parts")
"""Leagues of the scenes that are played anew."""
Folder = Annotated[Path, typer.Argument(help="The folder of the leagues.")]
app = typer.Typer(no_args_is_help=True, add_completion=False)


@app.command()
def play(
    scenes: Annotated[str, typer.Option(metavar="A,B", help="Only these; the rows of others stay.")] = "",
) -> None:
    """Play the league of each ego, with and without a shield, and rank them. Run it again to continue."""
    for ego in (*RULES, *LEARNED):
        shield = ("--shield", "rss") if ego in SHIELDED else ()
        folder = (PARTS if scenes else FOLDER) / Path(ego).name
        chosen = ("--scenes", scenes) if scenes else ()
        _run("league", "--ego", ego, *shield, *chosen, "--episodes", GAMES, "--out", folder)
        if scenes:
            replace_scenes(FOLDER / folder.name, folder)
    _run("league-table", FOLDER)


def replace_scenes(league: Path, part: Path) -> None:
    """Replace the scenes of a league that another league of the same ego played anew by those of the latter."""
    record = json.loads((part / RESULT).read_bytes())
    if record["failed"]:
        raise SystemExit(f"{part}: {'; '.join(record['failed'])}")
    tables = {}
    for name in ("league", "league_games"):
        was, now = (read_csv(folder / f"{name}.csv") for folder in (league, part))
        kept = was[~was["scene"].isin(now["scene"])]
        tables[name] = pd.concat([kept, now], ignore_index=True)
    table, games = worst_pairings_first(tables["league"]), tables["league_games"].sort_values("scene", kind="stable")
    write_csv(table, league / "league.csv")
    write_csv(games, league / "league_games.csv")
    write_record(league / RESULT, record | {"rows": rows_in_json(table)})


def _run(*words: object) -> None:
    subprocess.run(["harness", *map(str, words)], check=True)


@app.command()
def table(folder: Folder = FOLDER) -> None:
    """Print the ranks."""
    ranks = read_csv(folder / "league_ranks.csv")
    print("| rank | ego | games | fails | 95 % | told apart from |")
    print("| ---: | --- | ---: | ---: | --- | --- |")
    for row in ranks.to_dict("records"):
        interval = f"{row['failure_rate_low']:.1%} to {row['failure_rate_high']:.1%}"
        cells = [row["rank"], with_shield(row["ego"], row["shield"]), row["games"], f"{row['failure_rate']:.1%}"]
        cells += [interval, row["told_apart"].replace(" + ", ", ") or "none"]
        print(f"| {' | '.join(map(str, cells))} |")


@app.command()
def scenes(folder: Folder = FOLDER) -> None:
    """Print the games that each ego by rules fails, by scene, all pairings of a scene together."""
    leagues = (read_csv(folder / ego / "league.csv").sort_values("shield", kind="stable") for ego in RULES)
    rows = pd.concat(leagues, ignore_index=True)
    rows["failed"] = rows["failure_rate"] * rows["episodes"]
    rows["player"] = [with_shield(*each) for each in zip(rows["ego"], rows["shield"], strict=True)]
    failed = rows.pivot_table(index="scene", columns="player", values=["failed", "episodes"], aggfunc="sum")
    players = list(dict.fromkeys(rows["player"]))
    print(f"| scene | {' | '.join(players)} |")
    print(f"| --- | {' | '.join(['---:'] * len(players))} |")
    for scene, of_scene in failed.iterrows():
        cells = (f"{of_scene['failed', each]:.0f} of {of_scene['episodes', each]:.0f}" for each in players)
        print(f"| `{scene}` | {' | '.join(cells)} |")


if __name__ == "__main__":
    app()
