"""The commands for pinned games: failures of a run that are kept, and played again against any ego."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from harness.cli import messages
from harness.cli.output import AllowCode, RunEgo, RunPath, RunSeed, console_of_any_encoding, print_plain
from harness.errors import FAILED, NOT_ACCEPTED, UsageError, plain
from harness.game.roles import role_in_words, roles_of
from harness.shipped_documents import document_at

if TYPE_CHECKING:
    from junitparser import TestCase

    from harness.campaign.execution.pinned_games import Pinned
    from harness.campaign.execution.regression import PlayedAgain
    from harness.config.pinned_game import PinnedGame

_LEAST_SHOWN = 0.005


def minimise(
    run: RunPath,
    arm: Annotated[str | None, typer.Argument(metavar="ARM", help="The arm, such as naive_vs_speedy.")] = None,
    episode: Annotated[
        int | None, typer.Argument(metavar="EPISODE", help="The number of a game the ego failed.")
    ] = None,
    seed: RunSeed = None,
    all_failures: Annotated[
        bool, typer.Option("--all", help="One game for each kind of failure of each arm, or of ARM.")
    ] = False,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="The folder.  [default: RUN/pinned]")] = None,
    ego: RunEgo = None,
    policies: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="The folder of policies that the campaign read.  [default: found by their checksums]"
        ),
    ] = None,
    allow_code: AllowCode = False,
) -> None:
    """Pin failures: find the mildest start at which the ego still fails, and write it as a game of its own.

    The start's positions and speeds are changed towards those of a game that the ego does not fail, by bisection.
    Lapses of attention and background traffic stay as they are. `harness regression` plays pinned games.
    """
    from harness.campaign.execution.pinned_games import PinnedGames
    from harness.campaign.execution.run_players import RunPlayers
    from harness.campaign.storage.run_folder import RunFolder

    if not all_failures and (arm is None or episode is None):
        raise UsageError.of(
            "minimise", str(run), "names no game", "name ARM and EPISODE, or pin all kinds of failures with --all"
        )
    if all_failures and episode is not None:
        raise UsageError.of("--all", str(episode), "names one game beside --all", "leave out EPISODE or --all")
    console, folder = console_of_any_encoding(), RunFolder(run)
    found = None if policies is None else document_at(policies, "policies")
    pinning = PinnedGames(folder, RunPlayers(folder, found, ego, allow_code), out or folder.pinned)
    if all_failures:
        chosen = pinning.failures(arm)
    else:
        assert arm is not None
        assert episode is not None
        first_seed = int(folder.manifest()["seeds"][0])
        chosen = [pinning.failure(arm, first_seed if seed is None else seed, episode)]
    if not chosen:
        print_plain(["Nothing to pin: the ego fails in no game."], console)
    for failure in chosen:
        with console.status(f"minimising {escape(failure.arm)}, game {failure.episode}"):
            pinned = pinning.pin(failure)
        print_plain(_found(pinned), console)
    if chosen:
        print_plain(
            [f"To play them against another ego: harness regression {out or folder.pinned} --ego DRIVER"], console
        )


def regression(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="A folder of pinned games.")],
    ego: Annotated[
        str,
        typer.Option(
            metavar="DRIVER",
            help="The ego: the folder of a policy, a driver document, the name of an installed or shipped driver or of "
            "a shipped policy (paper_merge/naive-seed11), or sumo.",
        ),
    ],
    junit: Annotated[Path | None, typer.Option(metavar="FILE", help="Also write the results as JUnit XML.")] = None,
    allow_code: AllowCode = False,
) -> None:
    """Play pinned games against an ego, like a test suite: a game passes if the ego reaches its goal.

    Exit codes: 0 every game passes, 1 a game could not be played, 2 usage error, 3 the ego fails in a game.
    """
    from harness.campaign.execution.regression import Regression
    from harness.files import check_new_file
    from harness.reports.junit import write_junit

    console = console_of_any_encoding()
    if junit is not None:
        check_new_file(junit, "--junit")
    with console.status(messages.reading(folder)):
        games = Regression(folder, ego, allow_code)
    played: list[PlayedAgain] = []
    for each in games.play():
        played.append(each)
        print_plain([_played_again(each)], console, "green" if each.passed else "red")
    if junit is not None:
        write_junit(junit, "regression", [_case_of(each) for each in played], {"ego": ego})
    passed = sum(each.passed for each in played)
    print_plain([f"{passed} of {len(played)} pinned games pass."], console)
    if any(each.error for each in played):
        raise typer.Exit(FAILED)
    if not all(each.passed for each in played):
        raise typer.Exit(NOT_ACCEPTED)


def _found(found: Pinned) -> Iterator[str]:
    game = found.game
    alike = f", stands for {game.alike} alike" if game.alike > 1 else ""
    yield f"{plain(game.arm)}, seed {game.seed}, game {game.episode}: {game.outcome}{alike}"
    if game.no_failure_from is None:
        yield "  no start was found from which the ego does not fail; the start is the game's own"
    else:
        changes = "; ".join(_changes(game))
        yield f"  the ego no longer fails after this change of the start: {changes}  ({found.games} games played)"
    yield f"  {plain(str(found.file))}"


def _played_again(played: PlayedAgain) -> str:
    word = "PASS" if played.passed else "ERROR" if played.error else "FAIL"
    why = f": {plain(played.error)}" if played.error else "" if played.passed else f": {played.outcome}"
    return f"{word}  {plain(played.name)}{why}  ({played.seconds:.1f} s)"


def _case_of(played: PlayedAgain) -> TestCase:
    from harness.reports.junit import case_of

    game = played.game
    failure = "" if played.passed or played.error else f"the ego fails: {played.outcome}"
    details = f"arm {game.arm}, seed {game.seed}, game {game.episode}; {game.found_with} failed by {game.outcome}"
    group = f"regression.{game.arm}"
    return case_of(played.name, group, failure=failure, error=played.error, details=details, seconds=played.seconds)


def _changes(game: PinnedGame) -> Iterator[str]:
    """The change from the campaign's start to the one that does not fail, for each player that changes."""
    assert game.no_failure_from is not None
    for player, role in enumerate(roles_of(len(game.start.position_m))):
        name = role_in_words(role)
        moved_m = game.no_failure_from.position_m[player] - game.drawn_start.position_m[player]
        faster_mps = game.no_failure_from.speed_mps[player] - game.drawn_start.speed_mps[player]
        changes = ((moved_m, "m"), (faster_mps, "m/s"))
        if text := ", ".join(f"{change:+.2f} {unit}" for change, unit in changes if abs(change) > _LEAST_SHOWN):
            yield f"{name} {text}"
