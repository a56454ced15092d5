"""The pair of manoeuvres that led to the end of a game: one of a non-ego and the ego's response to it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import pandas as pd

from harness.evaluation.manoeuvres.naming import Manoeuvre, manoeuvres_in
from harness.evaluation.manoeuvres.thresholds import AFTERMATH_S, ANSWER_WITHIN_S
from harness.game.roles import EGO, ROLES

NO_CAUSE, NO_REACTION = "nothing named", "no reaction"
"""Stand for no named manoeuvre of the non-ego and of the ego."""


@dataclass(frozen=True, kw_only=True)
class Pair:
    """A manoeuvre of the non-ego and the ego's response; None: none that has a name."""

    non_ego: Manoeuvre | None
    ego: Manoeuvre | None

    @property
    def words(self) -> str:
        """E.g. "drift -> swerve"."""
        cause, response = (each.manoeuvre.replace("_", " ") if each else "" for each in (self.non_ego, self.ego))
        return f"{cause or NO_CAUSE} -> {response or NO_REACTION}"


def pair_of(found: Sequence[Manoeuvre], ended_s: float = math.inf) -> Pair:
    """The pair of one game that led to its end at `ended_s` (manoeuvres that begin later are left out).

    The ego's manoeuvre is its last one (the response). The non-ego's is the last one that began before the response and
    ended at most `ANSWER_WITHIN_S` before it; without such a manoeuvre, the last one that began after the response. A
    manoeuvre that a non-ego begins more than `AFTERMATH_S` after the response is a new cause without a response.
    """
    found = sorted((each for each in found if each.time_s <= ended_s), key=lambda each: each.time_s)
    non_ego = [each for each in found if each.player != ROLES[EGO]]
    ego = [each for each in found if each.player == ROLES[EGO]]
    if not ego or not non_ego:
        return Pair(non_ego=non_ego[-1] if non_ego else None, ego=ego[-1] if ego else None)
    response, latest = ego[-1], non_ego[-1]
    if latest.time_s > response.until_s + AFTERMATH_S:
        return Pair(non_ego=latest, ego=None)
    causes = [
        each for each in non_ego if each.time_s <= response.time_s and response.time_s - each.until_s <= ANSWER_WITHIN_S
    ]
    if causes:
        return Pair(non_ego=causes[-1], ego=response)
    return Pair(non_ego=latest if latest.time_s > response.time_s else None, ego=response)


def pairs_in(manoeuvres: pd.DataFrame) -> Mapping[tuple[str, int, int], Pair]:
    """The pair of every game that has rows in a table of manoeuvres, by arm, seed and episode."""
    return {
        (str(arm), int(seed), int(episode)): pair_of(manoeuvres_in(rows))
        for (arm, seed, episode), rows in manoeuvres.groupby(["arm", "seed", "episode"], sort=False)
    }
