"""The command `harness league`: one ego against all people on all roads."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from harness.cli.output import AllowCode, AsJson, Quiet, Verbose, output, print_json, print_plain


def league(
    ego: Annotated[
        str,
        typer.Option(
            metavar="EGO",
            help="The ego: what `[ego] driver` of a campaign takes (a driver document, the folder or the name of a "
            "policy, an installed driver, `sumo`), a file .onnx, .pt or .zip (Stable-Baselines3), or a command in "
            "quotes.",
        ),
    ],
    scenes: Annotated[
        str | None,
        typer.Option(
            metavar="A,B", help="Names or folders of scenes, joined by commas.  [default: every shipped scene]"
        ),
    ] = None,
    shield: Annotated[
        Literal["rss"] | None,
        typer.Option(metavar="RULE", help="Play each game with a shield around the ego, too: `rss` (docs/shield.md)."),
    ] = None,
    episodes: Annotated[int, typer.Option(min=2, metavar="N", help="Games of each pairing.")] = 100,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="The folder of the league.  [default: reports/league-EGO]")
    ] = None,
    jobs: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="Number of processes.  [default: one per core]")
    ] = None,
    allow_code: AllowCode = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Play one ego against all people in all scenes. Nothing is trained and no file has to be written.

    The people are the shipped policies of each scene; SUMO's driver and the empty road are played in every scene. Run
    the command again to continue an interrupted league. The folder contains league.html, league.csv, result.json and
    junit.xml, and a run folder for each scene.
    """
    with output(as_json, quiet, verbose) as console:
        with console.status("reading scenes and people"):
            from harness.campaign.execution.run_league import play_league
            from harness.campaign.execution.worker_pool import WorkerPool
            from harness.campaign.league_campaigns import name_of, open_league
            from harness.reports.league_page import league_terminal, not_answered

            folder = out or Path("reports") / f"league-{name_of(ego)}"
            names = [each.strip() for each in scenes.split(",") if each.strip()] if scenes is not None else []
            campaigns = open_league(ego, names, folder, episodes=episodes, shield=shield, allow_code=allow_code)
        with WorkerPool(None, jobs) as pool:
            outcome = play_league(name_of(ego), campaigns, folder, pool.of_run, console)
        console.print(league_terminal(outcome.table))
        print_plain([f"{scene}: {reason}" for scene, reason in not_answered(outcome.table)], console, "dim")
        print_plain([f"League: {folder / 'league.html'}"], console)
        if as_json:
            print_json({"league": str(folder), **outcome.record})
        if outcome.failed:
            console.quiet = False
            print_plain(outcome.failed, console, "red")
        if outcome.exit_code:
            raise typer.Exit(outcome.exit_code)


def league_table(
    folder: Annotated[Path, typer.Argument(metavar="[FOLDER]", help="The folder that the leagues are in.")] = Path(
        "reports"
    ),
    as_json: AsJson = False,
) -> None:
    """Rank the egos of all leagues in a folder by the games that all of them played.

    Egos that can't be told apart share a rank: a rank is 1 and the number of egos that fail significantly less often
    (McNemar's exact test in the same games, Holm's correction). Writes league_ranks.csv into the folder.
    """
    with output(as_json) as console:
        from harness.campaign.results.league_egos import rank_leagues
        from harness.reports.league_page import ranks_terminal

        ranks, file = rank_leagues(folder)
        console.print(ranks_terminal(ranks))
        print_plain([str(file)], console)
        if as_json:
            print_json({"ranks": ranks.to_dict("records")})
