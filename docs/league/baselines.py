"""The tables of docs/baselines.md, from the leagues of the shipped egos in reports/league.

    python docs/league/baselines.py ranks reports/league      # all egos, best first
    python docs/league/baselines.py scenes reports/league     # where each of them fails

Each prints a table in Markdown. `docs/publish/published.toml` has the commands that play the leagues.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
import typer

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, help=__doc__)
Leagues = Annotated[Path, typer.Argument(metavar="FOLDER", help="The folder with a league of each ego.")]
ALONE = "nobody"


def rows_of(leagues: Path) -> pd.DataFrame:
    """The rows of all `league.csv`, with the ego and its shield in `name`."""
    tables = [pd.read_csv(file, keep_default_na=False, na_values=[""]) for file in sorted(leagues.glob("*/league.csv"))]
    rows = pd.concat(tables, ignore_index=True)
    rows["name"] = [named(ego, shield) for ego, shield in zip(rows["ego"], rows["shield"].fillna(""), strict=True)]
    return rows


def named(ego: str, shield: str) -> str:
    return f"{ego} + shield" if shield else ego


@app.command()
def ranks(leagues: Leagues) -> None:
    """Each ego: its rank, its failures in the games that all played, and what else the leagues say."""
    ranked = pd.read_csv(leagues / "league_ranks.csv", keep_default_na=False)
    rows = rows_of(leagues)
    rows = rows[rows["reason"].isna()]
    print("| rank | ego | games | fails | preventable | others fail | brakes hard | mean speed |")
    print("| ---: | --- | ---: | --- | ---: | ---: | ---: | ---: |")
    for ego in ranked.to_dict("records"):
        name = named(ego["ego"], ego["shield"])
        own = rows[rows["name"] == name]
        interval = f"{ego['failure_rate_low']:.1%} to {ego['failure_rate_high']:.1%}"
        cells = [
            *(str(ego["rank"]), name, f"{ego['games']:,}", f"{ego['failure_rate']:.1%} ({interval})"),
            *(
                f"{mean_of(own, column):.1%}"
                for column in ("preventable_rate", "harm_to_others_rate", "hard_brake_rate")
            ),
            f"{mean_of(own, 'mean_speed_mps'):.1f} m/s",
        ]
        print(f"| {' | '.join(cells)} |")


@app.command()
def scenes(leagues: Leagues) -> None:
    """Failures beside others by scene, of all games with one of its people or SUMO's driver; alone in brackets."""
    rows = rows_of(leagues)
    names = list(dict.fromkeys(rows["name"]))
    print(f"| scene | {' | '.join(names)} |")
    print(f"| --- | {' | '.join('---:' for _ in names)} |")
    for scene in sorted(rows["scene"].unique()):
        own = rows[rows["scene"] == scene]
        print(f"| `{scene}` | {' | '.join(_cell(own[own['name'] == name]) for name in names)} |")


def _cell(rows: pd.DataFrame) -> str:
    """The failures of an ego in a scene. Where it or the person can't drive the scene, only those alone count."""
    is_alone = rows["person"] == ALONE
    others = rows[~is_alone & rows["reason"].isna()]
    beside = f"{mean_of(others, 'failure_rate'):.1%}" if len(others) else "–"
    return f"{beside} ({mean_of(rows[is_alone], 'failure_rate'):.1%})"


def mean_of(rows: pd.DataFrame, column: str) -> float:
    """The mean of a column over the games of the rows that have it."""
    known = rows[rows[column].notna()]
    return float(np.average(known[column], weights=known["episodes"]))


if __name__ == "__main__":
    app()
