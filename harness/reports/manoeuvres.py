"""The manoeuvres before failures: the table of manoeuvre pairs, and the marks on the player's time axis."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from harness.evaluation.manoeuvres import NO_CAUSE, NO_REACTION, Manoeuvre, Pair, pairs_in
from harness.reports.player_data import key

RUN_UP_S = 1.5
"""The player opens a game this long before the manoeuvre that led to the failure."""
MOST_LISTED = 50
"""The most games that a pair lists."""


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
    """A pair of manoeuvres, of the non-ego and of the ego, and the failures after it."""

    non_ego: str
    ego: str
    counts: Sequence[int]
    """Failures in each arm, in the order of the table's arms."""
    games: Sequence[FailedGame]

    def listed(self, embedded: Container[str], most: int) -> Sequence[FailedGame]:
        """The games to list, at most `most`: those that the page can play are preferred."""
        if len(self.games) <= most:
            return self.games
        return sorted(self.games, key=lambda game: key(game.arm, game.seed, game.episode) not in embedded)[:most]


def words(manoeuvre: str) -> str:
    """A manoeuvre's name as text."""
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
        pair = found.get((game.arm, game.seed, game.episode), Pair(non_ego=None, ego=None))
        named = [each for each in (pair.non_ego, pair.ego) if each]
        begin_s = min((each.time_s for each in named), default=float(game.duration_s))
        failure = FailedGame(
            arm=game.arm,
            seed=game.seed,
            episode=game.episode,
            outcome=game.ego_outcome,
            time_s=max(begin_s - RUN_UP_S, 0.0),
            text="; ".join(_text(each) for each in named if each.text),
        )
        grouped.setdefault((_name(pair.non_ego, NO_CAUSE), _name(pair.ego, NO_REACTION)), []).append(failure)
    rows = [
        Failures(
            non_ego=non_ego,
            ego=ego,
            counts=[sum(game.arm == arm for game in games) for arm in arms],
            games=games,
        )
        for (non_ego, ego), games in grouped.items()
    ]
    unnamed = (NO_CAUSE, NO_REACTION)
    rows.sort(key=lambda row: ((row.non_ego, row.ego) == unnamed, -len(row.games), row.non_ego, row.ego))
    return arms, rows


def _text(manoeuvre: Manoeuvre) -> str:
    """What it was; of several people, which one it was."""
    place = manoeuvre.player.removeprefix("non_ego_")
    return f"non-ego {place} {manoeuvre.text}" if place.isdecimal() else manoeuvre.text


def _name(manoeuvre: Manoeuvre | None, otherwise: str) -> str:
    return words(manoeuvre.manoeuvre) if manoeuvre else otherwise


def marks_of(manoeuvres: pd.DataFrame | None) -> Mapping[str, Sequence[Mapping[str, Any]]]:
    """The marks on the time axis of each game, by the game's `key`."""
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
