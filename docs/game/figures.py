"""The figures of docs/game-on-the-merge.md, from the tables of a run.

    python docs/game/figures.py gaps reports/merge-seeds              # best-response gaps
    python docs/game/figures.py responses reports/merge-robust        # the same, a line for each persona
    python docs/game/figures.py failures reports/merge-arms-race      # failure rates of every ego against every non-ego
    python docs/game/figures.py generalisation reports/merge-arms-race     # egos against non-egos new to them

Each command prints a table in Markdown. The argument is a run folder with gaps.csv, crossplay.csv or
generalisation.csv, or such a file.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import pandas as pd
import typer

from harness.evaluation.gap_verdict import GapVerdict

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, help=__doc__)
Run = Annotated[Path, typer.Argument(metavar="RUN", help="A run folder, or one of its tables.")]


def read(run: Path, table: str) -> pd.DataFrame:
    """A table of a run. That of an older run may lack columns that are not shown here."""
    return pd.read_csv(run if run.is_file() else run / f"{table}.csv")


def gaps_table(found: pd.DataFrame) -> str:
    """A row for each pair of strategies, player that may deviate, and seed."""
    lines = [
        "| pair: deviating player | seed | payoff → best response's | gap (95 %) | share | p (Holm) | the ego fails |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for row in found.sort_values(["persona", "round", "role", "seed"], kind="stable").to_dict("records"):
        player = "ego" if row["role"] == "ego" else row["non_ego"]
        interval = f"{row['gap']:+.2f} ({row['ci_low']:+.2f} to {row['ci_high']:+.2f})"
        if pd.isna(row["p_holm"]):  # there is no test
            interval = f"{row['gap']:+.2f}"
        fails = f"{row['ego_failure_rate']:.0%} → {row['ego_failure_rate_best_response']:.0%}"
        cells = (
            f"`{row['ego']}` against `{row['non_ego']}`: {player}",
            row["seed"],
            f"{row['payoff']:.2f} → {row['payoff_best_response']:.2f}",
            interval,
            f"{row['gap_share']:+.1%}",
            "–" if pd.isna(row["p_holm"]) else f"{row['p_holm']:.2g}",
            fails,
        )
        lines.append("| " + " | ".join(map(str, cells)) + " |")
    return "\n".join(lines)


def failures_table(found: pd.DataFrame) -> str:
    """Failure rates: a row for each ego, a column for each non-ego; the mean over seeds, of several to 0.1 %."""
    of_pairs = found.groupby(["ego", "non_ego"], sort=False)["failure_rate"]
    rates, digits = of_pairs.mean().unstack(), int(of_pairs.size().max() > 1)
    egos, non_egos = found["ego"].unique(), found["non_ego"].unique()
    lines = [f"| ego | {' | '.join(f'`{non_ego}`' for non_ego in non_egos)} |", "| --- |" + " ---: |" * len(non_egos)]
    for ego in egos:
        cells = ["–" if pd.isna(rate) else f"{rate:.{digits}%}" for rate in rates.loc[ego, non_egos]]
        lines.append(f"| `{ego}` | {' | '.join(cells)} |")
    return "\n".join(lines)


def responses_table(found: pd.DataFrame) -> str:
    """A row for each persona: what a best response changes, over all rounds and seeds."""
    lines = [
        "| person | the ego fails | against its best response | the person could gain | the ego could gain |",
        "| --- | ---: | ---: | --- | --- |",
    ]
    for persona, rows in found.groupby("persona", sort=False):
        cells = [f"`{persona}`", f"{rows['ego_failure_rate'].mean():.1%}"]
        people, egos = rows[rows["role"] == "non_ego"], rows[rows["role"] == "ego"]
        cells += [f"{people['ego_failure_rate_best_response'].mean():.1%}"]
        for side in (people, egos):
            shares = side.loc[side["verdict"] == GapVerdict.DISTINGUISHABLE, "gap_share"]
            size = f", up to {shares.max():.0%}" if len(shares) else ""
            cells += [f"in {len(shares)} of {len(side)} pairs{size}"]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def generalisation_table(found: pd.DataFrame) -> str:
    """A row for each ego and each non-ego that it was not trained against."""
    lines = [
        "| ego | trained against | plays against | fails (95 %) | naive ego fails | share | p (Holm) |",
        "| --- | --- | --- | --- | ---: | ---: | ---: |",
    ]
    for row in found.to_dict("records"):
        share = "–" if pd.isna(row["share_of_naive"]) else f"{row['share_of_naive']:.2f}"
        p = "–" if pd.isna(row["p_holm"]) else f"{row['p_holm']:.2g}"
        rate = f"{row['failure_rate']:.0%} ({row['failure_rate_low']:.1%} to {row['failure_rate_high']:.1%})"
        cells = (
            f"`{row['ego']}`",
            row["met"],
            f"`{row['non_ego']}`",
            rate,
            f"{row['naive_failure_rate']:.0%}",
            share,
            p,
        )
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


@app.command()
def gaps(run: Run) -> None:
    """Print how much each player could gain by changing its strategy alone."""
    print(gaps_table(read(run, "gaps")))


@app.command()
def responses(run: Run) -> None:
    """Print what best responses change, a line for each persona."""
    print(responses_table(read(run, "gaps")))


@app.command()
def failures(run: Run) -> None:
    """Print how often each ego fails against each non-ego."""
    print(failures_table(read(run, "crossplay")))


@app.command()
def generalisation(run: Run) -> None:
    """Print how often egos fail against non-egos that they were not trained against."""
    print(generalisation_table(read(run, "generalisation")))


if __name__ == "__main__":
    app()
