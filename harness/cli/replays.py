"""`harness replay`: recorded games as a list, in SUMO-GUI, or as a film."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from harness.cli import wording
from harness.cli.output import AsJson, output, print_json
from harness.errors import UsageError


def replay(
    run: Annotated[
        Path, typer.Argument(metavar="RUN", help="A run folder, such as reports/merge.", show_default=False)
    ],
    arm: Annotated[
        str | None, typer.Argument(metavar="ARM", help="The arm, such as naive_vs_speedy.", show_default=False)
    ] = None,
    episode: Annotated[
        int | None, typer.Argument(metavar="EPISODE", help="The number of the episode.", show_default=False)
    ] = None,
    seed: Annotated[
        int | None, typer.Option(help="The training seed.  [default: the first of the campaign]", show_default=False)
    ] = None,
    list_games: Annotated[bool, typer.Option("--list", help="List the recorded games, worst first.")] = False,
    outcome: Annotated[
        str | None,
        typer.Option(
            metavar="OUTCOME",
            help="List only games of this outcome of the ego: collision, rail, timeout, goal, or failure for the "
            "first three.",
            show_default=False,
        ),
    ] = None,
    rows: Annotated[int, typer.Option(min=1, metavar="N", help="The most games to list.")] = 40,
    page: Annotated[int, typer.Option(min=1, metavar="N", help="Which N rows of the list to show.")] = 1,
    film_file: Annotated[
        Path | None,
        typer.Option(
            "--film",
            metavar="FILE",
            help="Write the game as a .gif or .mp4 film instead; this needs no screen.",
            show_default=False,
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Watch a recorded game in SUMO-GUI. Without ARM or EPISODE, list the recorded games."""
    with output(as_json) as console:
        from harness.campaign.results.replay_game import GameList, film, found_game, game_records, game_table, watch

        listing = list_games or arm is None or episode is None
        if film_file is not None and listing:
            raise UsageError.of("--film", str(film_file), *wording.FILM_NEEDS_A_GAME)
        if as_json and not listing:
            raise UsageError.of("--json", "", *wording.JSON_IS_OF_A_LIST)
        if arm is None or episode is None or list_games:
            chosen = GameList(arm=arm, outcome=outcome, seed=seed, rows=rows, page=page)
            if as_json:
                print_json(game_records(run, chosen))
            else:
                console.print(game_table(run, chosen))
            return
        with found_game(run, arm, episode, seed) as game:
            if film_file is None:
                watch(game, console)
            else:
                film(game, film_file, console)
