"""What led to failures: the table of causes and responses, and the marks of manoeuvres on the player's time axis."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from harness.evaluation.rule_book.cause_lines import event_words
from harness.reports.player_data import key

RUN_UP_S = 1.5
"""The player opens a game this long before what led to the failure."""
MOST_LISTED = 50
"""The most games that a cause and response list."""


@dataclass(frozen=True, kw_only=True)
class FailedGame:
    """A failure of the ego, and the time to watch it from."""

    arm: str
    seed: int
    episode: int
    outcome: str
    time_s: float
    text: str


@dataclass(frozen=True, kw_only=True)
class Failures:
    """What led to failures, the ego's response to it, and the failures."""

    cause: str
    response: str
    counts: Sequence[int]
    """Failures in each arm, in the order of the table's arms."""
    games: Sequence[FailedGame]

    def listed(self, embedded: Container[str], most: int) -> Sequence[FailedGame]:
        """The games to list, at most `most`: those that the page can play are preferred."""
        if len(self.games) <= most:
            return self.games
        return sorted(self.games, key=lambda game: key(game.arm, game.seed, game.episode) not in embedded)[:most]


def failures_by_cause(causes: pd.DataFrame) -> tuple[list[str], list[Failures]]:
    """The arms in which the ego failed, and its failures in rows of `causes.csv`, grouped by event and response, the
    most frequent first."""
    arms = list(dict.fromkeys(causes["arm"]))
    grouped: dict[tuple[str, str], list[FailedGame]] = {}
    for game in causes.itertuples():
        failure = FailedGame(
            arm=game.arm,
            seed=game.seed,
            episode=game.episode,
            outcome=game.ego_outcome,
            time_s=max(game.time_s - RUN_UP_S, 0.0),
            text=f"{game.deed}, {game.time_left_s:.1f} s before the end" if game.other else game.deed,
        )
        grouped.setdefault((event_words(game.event), game.reaction), []).append(failure)
    rows = [
        Failures(
            cause=cause,
            response=response,
            counts=[sum(game.arm == arm for game in games) for arm in arms],
            games=games,
        )
        for (cause, response), games in grouped.items()
    ]
    rows.sort(key=lambda row: (-len(row.games), row.cause, row.response))
    return arms, rows


def marks_of(manoeuvres: pd.DataFrame | None) -> Mapping[str, Sequence[Mapping[str, Any]]]:
    """The marks on the time axis of each game, by the game's `key`."""
    if manoeuvres is None:
        return {}
    marks: dict[str, list[Mapping[str, Any]]] = {}
    for row in manoeuvres.sort_values("time_s", kind="stable").to_dict("records"):
        marks.setdefault(key(row["arm"], row["seed"], row["episode"]), []).append(
            {
                "player": row["player"],
                "name": event_words(str(row["manoeuvre"])),
                "from": round(float(row["time_s"]), 3),
                "until": round(float(row["until_s"]), 3),
                "text": str(row["text"]),
            }
        )
    return marks
