"""The competence gate: a verdict counts only if its players reach their goals without the other player.

A person that wrecks itself on the empty road and an ego that fails against everybody answer no research question. So
every question names the least share of goals of its players alone (`AloneBound`, from the campaign's table
`[competence]`). The share is measured in the arms in which they are assessed alone, by the point estimate: goals per
game that could be played. A goal of an ego that passed a red light, or drove among oncoming lanes, does not count.
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
RULES: Mapping[str, str] = {"on_red": "passing a red light", "wrong_way": "driving among oncoming lanes"}
"""The rules that an ego must keep, by the key of the games in which it broke them, with their words."""


@dataclass(frozen=True, kw_only=True)
class Goals:
    """How often a player reached its goal in the games of an arm."""

    goals: int
    games: int
    """Games that could be played."""
    on_red: int = 0
    """Games in which an ego reached its goal, but passed a red light: they are no goals."""
    wrong_way: int = 0
    """Further games in which it reached its goal, but drove among oncoming lanes: no goals either."""

    @classmethod
    def recorded(cls, entry: Mapping[str, Any]) -> Goals:
        """The goals that an entry of a manifest records."""
        against_rules = {rule: entry.get(rule, 0) for rule in RULES}
        return cls(goals=entry["goals"], games=entry["played"], **against_rules)

    def record(self) -> dict[str, int]:
        """The keys of a manifest's entry; without those of rules that were not broken."""
        against_rules = {rule: count for rule in RULES if (count := getattr(self, rule))}
        return {"goals": self.goals, "played": self.games} | against_rules

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
        broken = [
            f", and in {getattr(self, rule)} more after {words}" for rule, words in RULES.items() if getattr(self, rule)
        ]
        return f"alone it reaches its goal in {counts}{''.join(broken)}, below {round(least_share * 100, 10):g} %"


def goals_alone(games: pd.DataFrame | None, player: Literal["ego", "non_ego"]) -> Goals:
    """The goals of a player in an arm's rows of episodes.csv; None: the arm has no row.

    Several people drive one at a time, and their games count together.
    An ego that breaks one of `RULES` can't drive the scene. Persons may: some are made for it.
    """
    from harness.evaluation.people import outcomes_of_people
    from harness.evaluation.rule_book.thresholds import WRONG_WAY_LEAST_S

    if games is None:
        return Goals(goals=0, games=0)
    outcome = games["ego_outcome"].fillna("") if player == "ego" else outcomes_of_people(games)
    played = (games["error"].fillna("") == "") & ~outcome.isin(["", "error"])
    reached = played & (outcome == "goal")
    on_red = reached & _at_least(games, "ego_red_lights", 1.0) & (player == "ego")
    wrong_way = reached & ~on_red & _at_least(games, "ego_wrong_way_s", WRONG_WAY_LEAST_S) & (player == "ego")
    goals = reached & ~on_red & ~wrong_way
    return Goals(
        goals=int(goals.sum()), games=int(played.sum()), on_red=int(on_red.sum()), wrong_way=int(wrong_way.sum())
    )


def broken_by(record: Mapping[str, Any]) -> str:
    """The key of the rule of `RULES` that the ego broke in a game, from its cells of episodes.csv; empty if none."""
    from harness.evaluation.rule_book.thresholds import WRONG_WAY_LEAST_S

    if (record.get("ego_red_lights") or 0.0) >= 1.0:
        return "on_red"
    return "wrong_way" if (record.get("ego_wrong_way_s") or 0.0) >= WRONG_WAY_LEAST_S else ""


def _at_least(games: pd.DataFrame, column: str, least: float) -> Any:
    """Which games have at least this in a column; none, if the table has no such column."""
    return games[column].fillna(0.0) >= least if column in games else False


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
