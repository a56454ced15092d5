"""The competence gate: a verdict counts only if its players reach their goals without the other player.

A person that wrecks itself on the empty road and an ego that fails against everybody answer no research question. So
every question names the least share of goals of its players alone (`AloneBound`, from the campaign's table
`[competence]`). The share is measured in the arms in which they are assessed alone, by the point estimate: goals per
game that could be played. A goal of an ego after a red light does not count.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from harness.evaluation.research_questions import AloneBound, Verdict

if TYPE_CHECKING:
    import pandas as pd

DID_NOT_LEARN = "did not learn"
"""How a training ended whose player misses its bound alone, whatever stopped it."""


@dataclass(frozen=True, kw_only=True)
class Goals:
    """How often a player reached its goal in the games of an arm."""

    goals: int
    games: int
    """Games that could be played."""
    on_red: int = 0
    """Games in which an ego reached its goal, but passed a red light: they are no goals."""

    @property
    def share(self) -> float:
        """Share of the games; 0 without games."""
        return self.goals / self.games if self.games else 0.0

    def suffice(self, least_share: float) -> bool:
        """Whether there are games, and their share of goals is not below this."""
        return self.games > 0 and self.share >= least_share

    def below(self, least_share: float) -> str:
        """The share and its bound, as a clause."""
        counts = (
            f"{self.goals} of {self.games} games ({int(self.share * 1000) / 10:g} %)"  # rounded down: below stays below
        )
        red = f", and in {self.on_red} more after passing a red light" if self.on_red else ""
        return f"alone it reaches its goal in {counts}{red}, below {round(least_share * 100, 10):g} %"


def goals_alone(games: pd.DataFrame | None, player: Literal["ego", "non_ego"]) -> Goals:
    """The goals of a player in an arm's rows of episodes.csv; None: the arm has no row.

    An ego that passes a red light can't drive the scene. Persons may: some are made for it.
    """
    if games is None:
        return Goals(goals=0, games=0)
    outcome = games[f"{player}_outcome"].fillna("")
    played = (games["error"].fillna("") == "") & ~outcome.isin(["", "error"])
    reached = played & (outcome == "goal")
    counted = player == "ego" and "ego_red_lights" in games  # runs of earlier versions have no such column
    on_red = reached & (games["ego_red_lights"].fillna(0.0) > 0.0) if counted else reached & False
    return Goals(goals=int((reached & ~on_red).sum()), games=int(played.sum()), on_red=int(on_red.sum()))


@dataclass(frozen=True, kw_only=True)
class Gate:
    """Why a question is not answered."""

    verdict: Verdict
    """One of `INCOMPETENT`."""
    reason: str
    """Each player below its bound, with its share; a sentence without a capital letter and a full stop."""


def gate(bounds: Iterable[AloneBound], seed: int, games: Mapping[Any, pd.DataFrame]) -> Gate | None:
    """The reason why a verdict on these players does not count; None if it counts.

    `games` are the rows of episodes.csv by (arm, seed). A bound of 0 is always met.
    """
    measured = [
        (bound, goals_alone(games.get((bound.arm, seed)), bound.player)) for bound in bounds if bound.goal_share > 0
    ]
    below = [(bound, goals) for bound, goals in measured if not goals.suffice(bound.goal_share)]
    if not below:
        return None
    incapable = {bound.player for bound, goals in below if goals.games}
    verdict = {
        frozenset({"ego"}): Verdict.EGO_CANNOT_DRIVE,
        frozenset({"non_ego"}): Verdict.NON_EGO_CANNOT_DRIVE,
        frozenset({"ego", "non_ego"}): Verdict.NEITHER_CAN_DRIVE,
    }.get(frozenset(incapable), Verdict.NOT_PLAYED_ALONE)
    return Gate(verdict=verdict, reason=_reason(below))


def _reason(below: Sequence[tuple[AloneBound, Goals]]) -> str:
    clauses = []
    for bound, goals in below:
        if goals.games:
            clauses.append(f"{bound.words} can't drive this scene: {goals.below(bound.goal_share)}")
        else:
            clauses.append(
                f"no game of the arm {bound.arm} could be played, so it is not known how {bound.words} drives"
            )
    return "; ".join(dict.fromkeys(clauses))
