"""The sentences that the commands for pinned games print."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain
from typing import TYPE_CHECKING

from rich.markup import escape

from harness.errors import plain
from harness.game.roles import roles_of

if TYPE_CHECKING:
    from harness.campaign.execution.pinned_games import Pinned
    from harness.campaign.execution.regression import PlayedAgain
    from harness.config.pinned_game import PinnedGame
    from harness.reports.junit import JUnitCase

NO_FAILURES = "Nothing to pin: the ego fails in no game."
NAMES_NO_FAILURE = ("names no game", "name ARM and EPISODE, or pin all kinds of failures with --all")
ALL_AND_ONE = ("names one game beside --all", "leave out EPISODE or --all")
_LEAST_SHOWN = 0.005


def minimising(arm: str, episode: int) -> str:
    return f"minimising {escape(arm)}, game {episode}"


def pinned(found: Pinned) -> Iterator[str]:
    """What was found, and where it was written."""
    game = found.game
    alike = f", stands for {game.alike} alike" if game.alike > 1 else ""
    yield f"{plain(game.arm)}, seed {game.seed}, game {game.episode}: {game.outcome}{alike}"
    if game.no_failure_from is None:
        yield "  no start was found from which the ego does not fail; the start is the game's own"
    else:
        changes = "; ".join(_changes(game))
        yield f"  the ego no longer fails after this change of the start: {changes}  ({found.games} games played)"
    yield f"  {plain(str(found.file))}"


def played_again(played: PlayedAgain) -> str:
    """One game and its outcome."""
    word = "PASS" if played.passed else "ERROR" if played.error else "FAIL"
    why = f": {plain(played.error)}" if played.error else "" if played.passed else f": {played.outcome}"
    return f"{word}  {plain(played.name)}{why}  ({played.seconds:.1f} s)"


def regression_result(played: Sequence[PlayedAgain]) -> str:
    """How many games passed."""
    passed = sum(each.passed for each in played)
    return f"{passed} of {len(played)} pinned games pass."


def check_of(played: PlayedAgain) -> JUnitCase:
    """The game as a check of a JUnit file."""

    game = played.game
    failure = "" if played.passed or played.error else f"the ego fails: {played.outcome}"
    details = f"arm {game.arm}, seed {game.seed}, game {game.episode}; {game.found_with} failed by {game.outcome}"
    return JUnitCase(
        name=played.name,
        group=f"regression.{game.arm}",
        failure=failure,
        error=played.error,
        details=details,
        seconds=played.seconds,
    )


def _changes(game: PinnedGame) -> Iterator[str]:
    """The change from the campaign's start to the one that does not fail, for each player that changes."""
    assert game.no_failure_from is not None
    for player, role in enumerate(roles_of(len(game.start.position_m))):
        name = role.replace("non_ego", "non-ego").replace("_", " ")
        moved_m = game.no_failure_from.position_m[player] - game.drawn_start.position_m[player]
        faster_mps = game.no_failure_from.speed_mps[player] - game.drawn_start.speed_mps[player]
        parts = chain(
            [f"{moved_m:+.2f} m"] if abs(moved_m) > _LEAST_SHOWN else [],
            [f"{faster_mps:+.2f} m/s"] if abs(faster_mps) > _LEAST_SHOWN else [],
        )
        if text := ", ".join(parts):
            yield f"{name} {text}"
