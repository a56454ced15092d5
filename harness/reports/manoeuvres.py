"""What the players did before a failure: the table of manoeuvre pairs, and the marks on the player's time axis."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from harness.evaluation.manoeuvres import Manoeuvre, Pair, pairs_in
from harness.reports.player_data import key

NONE_NAMED = "–"
RUN_UP_S = 1.5
"""A game is opened this long before the manoeuvre that led to the failure."""
MOST_LISTED = 50
"""Games that a pair lists."""


@dataclass(frozen=True)
class FailedGame:
    """A failure of the ego: where to watch it."""

    arm: str
    seed: int
    episode: int
    outcome: str
    time_s: float
    text: str


@dataclass(frozen=True)
class Failures:
    """What the non-ego did and how the ego answered, and the failures that came of it."""

    non_ego: str
    ego: str
    counts: Sequence[int]
    """Failures in each arm, in the order of the table's arms."""
    games: Sequence[FailedGame]

    def listed(self, embedded: Container[str], most: int) -> Sequence[FailedGame]:
        """The games to list, at most so many: those that the page can play go first where not all can be listed."""
        if len(self.games) <= most:
            return self.games
        return sorted(self.games, key=lambda game: key(game.arm, game.seed, game.episode) not in embedded)[:most]


def words(manoeuvre: str) -> str:
    """A manoeuvre as a person says it."""
    return {"cut_in": "cut-in"}.get(manoeuvre, manoeuvre.replace("_", " "))


def failures_by_pair(manoeuvres: pd.DataFrame, episodes: pd.DataFrame) -> tuple[list[str], list[Failures]]:
    """The arms in which the ego failed, and its failures grouped by the pair of manoeuvres that led to each
    (`harness.evaluation.manoeuvres.pairs`), the most frequent pair first, those without a name last.
    """
    failed = episodes[episodes["ego_failed"].fillna(0).astype(bool)]
    arms = list(dict.fromkeys(failed["arm"]))
    found = pairs_in(manoeuvres)
    grouped: dict[tuple[str, str], list[FailedGame]] = {}
    for game in failed.itertuples():
        pair = found.get((game.arm, game.seed, game.episode), Pair(None, None))
        led = [each for each in (pair.non_ego, pair.ego) if each]
        begins_s = min((each.time_s for each in led), default=float(game.duration_s))
        text = "; ".join(each.text for each in led if each.text)
        shown = FailedGame(game.arm, game.seed, game.episode, game.ego_outcome, max(begins_s - RUN_UP_S, 0.0), text)
        grouped.setdefault((_name(pair.non_ego), _name(pair.ego)), []).append(shown)
    rows = [
        Failures(non_ego, ego, [sum(game.arm == arm for game in games) for arm in arms], games)
        for (non_ego, ego), games in grouped.items()
    ]
    nameless = (NONE_NAMED, NONE_NAMED)
    rows.sort(key=lambda row: ((row.non_ego, row.ego) == nameless, -len(row.games), row.non_ego, row.ego))
    return arms, rows


def _name(manoeuvre: Manoeuvre | None) -> str:
    return words(manoeuvre.manoeuvre) if manoeuvre else NONE_NAMED


def marks_of(manoeuvres: pd.DataFrame | None) -> Mapping[str, Sequence[Mapping[str, Any]]]:
    """What the player marks on the time axis of each game, by the game's `key`."""
    if manoeuvres is None:
        return {}
    marks: dict[str, list[Mapping[str, Any]]] = {}
    for row in manoeuvres.sort_values("time_s", kind="stable").to_dict("records"):
        marks.setdefault(key(row["arm"], row["seed"], row["episode"]), []).append(
            {
                "player": row["player"],
                "name": words(str(row["manoeuvre"])),
                "from": round(float(row["time_s"]), 3),
                "until": round(float(row["until_s"]), 3),
                "text": str(row["text"]),
            }
        )
    return marks
