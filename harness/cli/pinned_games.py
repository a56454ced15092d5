"""The commands for pinned games: failures of a run that are kept, and played again against any ego."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from harness.cli import pinned_wording, wording
from harness.cli.documents import AllowCode
from harness.errors import FAILED, NOT_ACCEPTED, UsageError
from harness.shipped_documents import document_at

if TYPE_CHECKING:
    from rich.console import Console

    from harness.campaign.execution.regression import PlayedAgain


def minimise(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="A run folder.", show_default=False)],
    arm: Annotated[
        str | None, typer.Argument(metavar="ARM", help="The arm, such as naive_vs_speedy.", show_default=False)
    ] = None,
    episode: Annotated[
        int | None, typer.Argument(metavar="EPISODE", help="The number of a game the ego failed.", show_default=False)
    ] = None,
    seed: Annotated[
        int | None, typer.Option(help="The training seed.  [default: the first of the campaign]", show_default=False)
    ] = None,
    all_failures: Annotated[
        bool, typer.Option("--all", help="One game for each kind of failure of each arm, or of ARM.")
    ] = False,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="The folder.  [default: RUN/pinned]", show_default=False)
    ] = None,
    ego: Annotated[
        str | None,
        typer.Option(metavar="DRIVER", help="The campaign's ego, if no policy of it.", show_default=False),
    ] = None,
    policies: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="The folder of policies that the campaign read.  [default: found by their checksums]",
            show_default=False,
        ),
    ] = None,
    allow_code: AllowCode = False,
) -> None:
    """Pin failures: find the mildest start at which the ego still fails, and write it as a game of its own.

    The start's positions and speeds are changed towards those of a game that the ego does not fail, by bisection.
    Lapses of attention and background traffic stay as they are. `harness regression` plays pinned games.
    """
    from rich.console import Console

    from harness.campaign.execution.pinned_games import PinnedGames
    from harness.campaign.execution.run_players import RunPlayers
    from harness.campaign.storage.run_folder import RunFolder

    if not all_failures and (arm is None or episode is None):
        raise UsageError.of("minimise", str(run), *pinned_wording.NAMES_NO_FAILURE)
    if all_failures and episode is not None:
        raise UsageError.of("--all", str(episode), *pinned_wording.ALL_AND_ONE)
    console, folder = Console(), RunFolder(run)
    found = None if policies is None else document_at(policies, "policies")
    pinning = PinnedGames(folder, RunPlayers(folder, found, ego, allow_code), out or run / "pinned")
    if all_failures:
        chosen = pinning.failures(arm)
    else:
        assert arm is not None
        assert episode is not None
        first_seed = int(folder.manifest()["seeds"][0])
        chosen = [pinning.failure(arm, first_seed if seed is None else seed, episode)]
    if not chosen:
        _print(console, pinned_wording.NO_FAILURES)
    for failure in chosen:
        with console.status(pinned_wording.minimising(failure.arm, failure.episode)):
            pinned = pinning.pin(failure)
        _print(console, *pinned_wording.pinned(pinned))


def regression(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="A folder of pinned games.", show_default=False)],
    ego: Annotated[
        str,
        typer.Option(
            metavar="DRIVER",
            help="The ego: the folder of a policy, a driver document, an installed driver, or sumo.",
            show_default=False,
        ),
    ],
    junit: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Also write the results as JUnit XML.", show_default=False)
    ] = None,
    allow_code: AllowCode = False,
) -> None:
    """Play pinned games against an ego, like a test suite: a game passes if the ego reaches its goal.

    Exit codes: 0 every game passes, 1 a game could not be played, 2 usage error, 3 the ego fails in a game.
    """
    from rich.console import Console

    from harness.campaign.execution.regression import Regression
    from harness.reports.junit import write_junit

    console = Console()
    with console.status(wording.reading(folder)):
        games = Regression(folder, ego, allow_code)
    played: list[PlayedAgain] = []
    for each in games.play():
        played.append(each)
        style = "green" if each.passed else "red"
        console.print(pinned_wording.played_again(each), style=style, highlight=False, markup=False, soft_wrap=True)
    if junit is not None:
        write_junit(junit, "regression", [pinned_wording.check_of(each) for each in played], {"ego": ego})
    _print(console, pinned_wording.regression_result(played))
    if any(each.error for each in played):
        raise typer.Exit(FAILED)
    if not all(each.passed for each in played):
        raise typer.Exit(NOT_ACCEPTED)


def _print(console: Console, *lines: str) -> None:
    for line in lines:
        console.print(line, highlight=False, markup=False, soft_wrap=True)
