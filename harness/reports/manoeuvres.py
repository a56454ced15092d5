"""What led to failures: the table of causes and responses, and the marks of manoeuvres on the player's time axis."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from typing import Any

import pandas as pd

from harness.evaluation.rule_book.causes import event_words
from harness.reports.embedding import key

RUN_UP_S = 1.5
"""The player opens a game this long before what led to the failure."""
MOST_LISTED = 50
"""The most games that a cause and response list."""


def failures_by_cause(causes: pd.DataFrame, embedded: Container[str]) -> tuple[list[str], list[dict[str, Any]]]:
    """The arms in which the ego failed, and its failures in rows of `causes.csv`, grouped by event and response, the
    most frequent first.

    Of each group: `cause`, `response`, `total`, `counts` in the order of the arms, and the `games` to list, at most
    `MOST_LISTED`, of which those that the page contains (`embedded`) are preferred.
    """
    arms = list(dict.fromkeys(causes["arm"]))
    found = []
    for (cause, response), rows in causes.groupby([causes["event"].map(event_words), "reaction"], sort=False):
        games = [_game(row) for row in rows.itertuples()]
        if len(games) > MOST_LISTED:
            games = sorted(games, key=lambda game: game["key"] not in embedded)[:MOST_LISTED]
        counts = [int((rows["arm"] == arm).sum()) for arm in arms]
        found.append({"cause": cause, "response": response, "total": len(rows), "counts": counts, "games": games})
    return arms, sorted(found, key=lambda group: (-group["total"], group["cause"], group["response"]))


def _game(row: Any) -> dict[str, Any]:
    return {
        "key": key(row.arm, row.seed, row.episode),
        "arm": row.arm,
        "seed": row.seed,
        "episode": row.episode,
        "outcome": row.ego_outcome,
        "time_s": max(row.time_s - RUN_UP_S, 0.0),
        "text": _told(row),
    }


def causes_by_game(causes: pd.DataFrame) -> Mapping[str, str]:
    """Why the ego failed, and what it did, for each row of `causes.csv`, by the game's `key`."""
    return {
        key(row.arm, row.seed, row.episode): f"{_told(row)}; the ego: {row.reaction}" for row in causes.itertuples()
    }


def _told(row: Any) -> str:
    return f"{row.deed}, {row.time_left_s:.1f} s before the end" if row.other else str(row.deed)


def marks_of(manoeuvres: pd.DataFrame) -> Mapping[str, Sequence[Mapping[str, Any]]]:
    """The marks on the time axis of each game, by the game's `key`."""
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
