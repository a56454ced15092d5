"""The rows of `episodes.csv` and `conduct.csv` of one recorded game: outcomes and metrics."""

from __future__ import annotations

from typing import Any

from harness.evaluation import conduct, harm  # they enter their metrics
from harness.evaluation.metrics import METRICS, Drive
from harness.evaluation.people import COLLIDED_WITH
from harness.evaluation.recorded_game import RecordedGame
from harness.evaluation.severity import injury, measures  # they enter their metrics
from harness.game.outcome import Outcome
from harness.game.roles import EGO, ROLES

METRICS_OF_PLAYERS = tuple(each for each in METRICS if {"ego", "person"} & {*each.whose})
METRICS_OF_CONDUCT = tuple(each for each in METRICS if "conduct" in each.whose)
METRICS_OF_GAMES = tuple(each for each in METRICS if not {"ego", "person", "conduct"} & {*each.whose})
assert conduct  # used for what its import enters, as are these
assert harm
assert injury
assert measures


def conduct_of(game: RecordedGame) -> list[dict[str, Any]]:
    """The rows of `conduct.csv` of a game: one for each player that took part."""
    return [
        {
            "player": role,
            "outcome": drive.outcome.word,
            **{each.column.name: each.of(drive) for each in METRICS_OF_CONDUCT},
        }
        for role, drive in _drives(game).items()
    ]


def measured(game: RecordedGame) -> dict[str, Any]:
    """The cells of a game that its trace tells, None where one can't be measured."""
    drives = _drives(game)
    cells: dict[str, Any] = {"duration_s": (len(game.drove) - 1) * game.world.step_s}
    for player, role in enumerate(game.world.roles):
        cells[f"{role}_outcome"] = game.outcomes[player].word
        whose = "ego" if player == EGO else "person"
        of_player = [each for each in METRICS_OF_PLAYERS if whose in each.whose]
        cells |= {f"{role}_{each.column.name}": each.of(drives[role]) if role in drives else None for each in of_player}
    ego, judged = drives.get(ROLES[EGO]), next(iter(drives.values()), None)
    cells["ego_failed"] = int(ego.outcome is not Outcome.GOAL) if ego is not None else None
    if len(game.world.roles) > len(ROLES):
        cells[COLLIDED_WITH] = collided_with(game)
    for each in METRICS_OF_GAMES:
        drive = judged if "judged" in each.whose else ego
        cells[each.column.name] = each.of(drive) if drive is not None else None
    return cells


def _drives(game: RecordedGame) -> dict[str, Drive]:
    """Of the players that took part, by name."""
    return {
        role: Drive(game=game, player=player)
        for player, role in enumerate(game.world.roles)
        if game.last_step(player) is not None
    }


def collided_with(game: RecordedGame) -> str:
    """The name of what the ego collided with: a person's, an obstacle's, or `background`; empty if with nothing."""
    last = game.last_step(EGO)
    body = game.nearest(last, EGO) if last is not None and game.outcomes[EGO] is Outcome.COLLISION else None
    if body is None:
        return ""
    name = game.names[body]
    return name if name in (*game.world.roles, *game.obstacles) else "background"
