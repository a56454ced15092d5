"""The command `harness falsify`: learned people against searchers."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from harness.cli.output import AllowCode, AsJson, RunEgo, RunPath, RunSeed, output, print_json, print_plain

if TYPE_CHECKING:
    import pandas as pd
    from rich.table import Table


def falsify(
    run: RunPath,
    arms: Annotated[
        list[str] | None,
        typer.Argument(metavar="[ARM]...", help="Arms of one ego, one of them with SUMO's driver.  [default: naive's]"),
    ] = None,
    seed: RunSeed = None,
    games: Annotated[int, typer.Option(min=20, metavar="N", help="Games of each search.")] = 200,
    repeats: Annotated[int, typer.Option(min=2, metavar="N", help="Searches of each kind.")] = 10,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Folder of the tables.  [default: RUN]")] = None,
    ego: RunEgo = None,
    allow_code: AllowCode = False,
    as_json: AsJson = False,
) -> None:
    """Compare learned people with searchers: in how many games does each make the ego fail for the first time?

    Learned people play from random starts. Searchers (random, cross-entropy, CMA-ES) choose the starts, and the
    parameters of SUMO's driver in the people's place. Writes searches.csv and falsification.csv.
    """
    with output(as_json) as console:
        from harness.campaign.execution.falsify_run import carry_out_searches, planned_searches, write_searches
        from harness.campaign.execution.run_players import RunPlayers
        from harness.campaign.results.shown_work import progress_bar
        from harness.campaign.storage.run_folder import RunFolder
        from harness.evaluation.tables import rows_in_json

        folder = RunFolder(run)
        manifest = folder.manifest()
        players = RunPlayers(folder, ego=ego, allow_code=allow_code)
        searches = planned_searches(folder, players, arms or [], int(manifest["seeds"][0]) if seed is None else seed)
        with progress_bar("games", console) as show:
            results = list(carry_out_searches(players, searches, games=games, repeats=repeats, on_progress=show))
        significance = manifest["campaign"]["assessment"]["significance"]
        searched, found = write_searches(results, out or run, significance)
        console.print(_shown(searched))
        print_plain(_sentences(found), console)
        print_plain([f"{(out or run) / 'falsification.csv'}"], console)
        if as_json:
            print_json({"falsification": rows_in_json(found)})


def _shown(searches: pd.DataFrame) -> Table:
    """Who plays, a row each; the mean of the games until the first find, and how many searches found something."""
    from harness.reports.text_table import add_text_row, text_table

    criteria = list(dict.fromkeys(searches["criterion"]))
    headings = ("person", "starts", *(each.replace("_", " ") for each in criteria))
    repeats = searches["repeat"].nunique()
    table = text_table(
        headings,
        whole=("person", "starts"),
        title="Mean games until a failure of the ego, and until one that a reference driver prevents",
        caption=f"In brackets: of {repeats} searches, those that found one. The others count with their length.",
    )
    for (arm, searcher), rows in searches.groupby(["arm", "searcher"], sort=False):
        cells = []
        for criterion in criteria:
            first = rows.loc[rows["criterion"] == criterion, "first_game"]
            cells.append(_games_until(first, rows["games"].iloc[0]))
        add_text_row(table, str(arm).partition("_vs_")[2], searcher, *cells)
    return table


def _games_until(first: pd.Series, games: int) -> str:
    """The mean of the games until the first find; a search of `games` games without one makes it a lower bound."""
    finds = int(first.notna().sum())
    if not finds:
        return "none"
    bound = "≥ " if finds < len(first) else ""
    return f"{bound}{first.fillna(games).astype(float).mean():.0f} ({finds})"


def _sentences(found: pd.DataFrame) -> Iterator[str]:
    """A line for each criterion: what comes out of how many comparisons of learned people with a searcher."""
    for criterion, rows in found.groupby("criterion", sort=False):
        counts = rows["verdict"].value_counts(sort=False)
        said = ", ".join(f"{verdict} in {count}" for verdict, count in counts.items())
        yield f"{str(criterion).replace('_', ' ')}, {len(rows)} comparisons: {said}"
