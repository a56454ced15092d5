"""What the non-ego did and how the ego answered: the last of a game's manoeuvres, which led to how it ended."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import pandas as pd

from harness.evaluation.manoeuvres.naming import Manoeuvre, manoeuvres_in
from harness.evaluation.manoeuvres.thresholds import AFTERMATH_S, ANSWER_WITHIN_S
from harness.game.state import EGO, NON_EGO, ROLES


@dataclass(frozen=True)
class Pair:
    """What the non-ego did and how the ego answered; None: nothing that has a name."""

    non_ego: Manoeuvre | None
    ego: Manoeuvre | None

    @property
    def words(self) -> str:
        """Such as "drift -> swerve"; "-" is nothing that has a name."""
        names = (each.manoeuvre.replace("_", " ") if each else "-" for each in (self.non_ego, self.ego))
        return " -> ".join(names)


def pair_of(found: Sequence[Manoeuvre], ended_s: float = math.inf) -> Pair:
    """The pair of one game that led to its end at `ended_s` (manoeuvres that begin later are left out).

    The ego's is its last one, the non-ego's the last that had begun when the ego's began and was not over for longer
    than an answer takes; if there is none, what the non-ego began after that. What it began well after the ego's last
    was over is a new cause, which the ego has not answered.
    """
    found = sorted((each for each in found if each.time_s <= ended_s), key=lambda each: each.time_s)
    non_ego = [each for each in found if each.player == ROLES[NON_EGO]]
    ego = [each for each in found if each.player == ROLES[EGO]]
    if not ego or not non_ego:
        return Pair(non_ego[-1] if non_ego else None, ego[-1] if ego else None)
    answer, latest = ego[-1], non_ego[-1]
    if latest.time_s > answer.until_s + AFTERMATH_S:
        return Pair(latest, None)
    causes = [
        each for each in non_ego if each.time_s <= answer.time_s and answer.time_s - each.until_s <= ANSWER_WITHIN_S
    ]
    if causes:
        return Pair(causes[-1], answer)
    return Pair(latest if latest.time_s > answer.time_s else None, answer)


def pairs_in(manoeuvres: pd.DataFrame) -> Mapping[tuple[str, int, int], Pair]:
    """The pair of every game that has rows in a table of manoeuvres, by arm, seed and episode."""
    return {
        (str(arm), int(seed), int(episode)): pair_of(manoeuvres_in(rows))
        for (arm, seed, episode), rows in manoeuvres.groupby(["arm", "seed", "episode"], sort=False)
    }
