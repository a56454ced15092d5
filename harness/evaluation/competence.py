"""The research questions on two arms with their possible answers, and the gates before them.

A verdict counts only if its players reach their goals without each other.
A person that wrecks itself on the empty road and an ego that fails against everybody answer no research question. So
every question names the least share of goals of its players alone, and of a naive ego that learned beside SUMO's driver
there, too (`AloneBound`, from the campaign's table `[competence]`). The share is measured in the arms in which they are
assessed so, by the point estimate: goals per game that could be played. A goal of an ego that passed a red light, or
drove among oncoming lanes, does not count.

A question about a person that drives unlike people is not answered either (`Question.unlike_people`).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any, Literal

from harness.evaluation.rule_book.thresholds import WRONG_WAY_LEAST_S

if TYPE_CHECKING:
    import pandas as pd

ResearchQuestion = Literal["RQ1", "RQ2"]


ALONE = "alone"


@dataclass(frozen=True, kw_only=True)
class AloneBound:
    """What a player has to achieve without the other player of a question before a verdict on it counts."""

    player: Literal["ego", "non_ego"]
    words: str
    """The player in sentences, such as "the naive ego"."""
    arm: str
    """The arm in which it drives alone, or beside SUMO's driver."""
    goal_share: float
    """The least share of that arm's games in which it reaches its goal."""
    where: str = ALONE
    """Who else is in that arm, in sentences."""


@dataclass(frozen=True, kw_only=True)
class Question:
    """One research question, asked of one persona and training seed: two arms of the same episodes."""

    question: ResearchQuestion
    persona: str
    seed: int
    baseline: str
    treatment: str
    alone: tuple[AloneBound, ...] = ()
    """What its players have to achieve alone; otherwise it is not answered."""
    unlike_people: str = ""
    """How its person differs from people, as a clause; empty if it does not, and otherwise it is not answered."""


class Verdict(str, Enum):
    """Every value the column `verdict` can have."""

    SIGNIFICANT = "significant"
    """p_holm < significance (and so p_value < significance)."""
    BEFORE_HOLM_ONLY = "significant before Holm's correction only"
    """p_value < significance <= p_holm."""
    NOT_SIGNIFICANT = "not significant"
    SECONDARY = "significant without correction (secondary test)"
    """p_value < significance, of a test that is in no family of Holm's correction: no answer to a question."""
    NO_DIFFERENCE = "no difference"
    """Every difference is 0, so there is no t statistic."""
    ALL_EQUAL = "no t statistic: all differences equal"
    """Every difference is the same number, not 0: of speeds or braking, or of failures over trainings."""
    NOT_ENOUGH_PAIRS = "not enough pairs"
    """Fewer than two pairs could be compared."""
    NOT_ENOUGH_TRAININGS = "not enough trainings"
    """Over trainings: the question is answered for fewer than `planned_tests.LEAST_TRAININGS` of them."""
    EGO_CANNOT_DRIVE = "not answered: the ego can't drive this scene"
    """An ego of the question reaches its goal alone in fewer games than `AloneBound` asks. This verdict and the next
    four go before all others: there is no test."""
    NON_EGO_CANNOT_DRIVE = "not answered: the person can't drive this scene"
    NEITHER_CAN_DRIVE = "not answered: neither the ego nor the person can drive this scene"
    NOT_PLAYED_ALONE = "not answered: a player was not played alone"
    """It is not known whether the players can drive the scene."""
    UNLIKE_PEOPLE = "not answered: the person is outside the range of people"
    """All players can drive the scene, but the person does not drive as people do."""


WITHHELD = frozenset(
    {
        Verdict.EGO_CANNOT_DRIVE,
        Verdict.NON_EGO_CANNOT_DRIVE,
        Verdict.NEITHER_CAN_DRIVE,
        Verdict.NOT_PLAYED_ALONE,
        Verdict.UNLIKE_PEOPLE,
    }
)
"""The verdicts on players about which a question is not answered."""

FINISHED = ("done", "settled")
"""Statuses of a finished stage; `settled`: an approximate equilibrium or a taken answer left nothing to do."""
DID_NOT_LEARN = "did not learn"
"""How a training ended whose player misses one of its bounds, whatever stopped it."""
RULES: Mapping[str, tuple[str, str, float]] = {
    "on_red": ("passing a red light", "ego_red_lights", 1.0),
    "wrong_way": ("driving among oncoming lanes", "ego_wrong_way_s", WRONG_WAY_LEAST_S),
}
"""The rules that an ego must keep, by the key of the games in which it broke them: its words, and the column of
episodes.csv with the least value that breaks it."""


@dataclass(frozen=True, kw_only=True)
class Goals:
    """How often a player reached its goal in the games of an arm; the keys of an entry of a manifest."""

    goals: int
    played: int
    """Games that could be played."""
    on_red: int = 0
    """Games in which an ego reached its goal, but passed a red light: they are no goals."""
    wrong_way: int = 0
    """Further games in which it reached its goal, but drove among oncoming lanes: no goals either."""

    @classmethod
    def recorded(cls, entry: Mapping[str, Any]) -> Goals:
        return cls(**{name: entry[name] for name in cls.__dataclass_fields__ if name in entry})

    def record(self) -> dict[str, int]:
        """The keys of a manifest's entry; without those of rules that were not broken."""
        return {name: count for name, count in vars(self).items() if count or name not in RULES}

    def suffice(self, least_share: float) -> bool:
        """Whether there are games, and their share of goals is not below this."""
        return self.played > 0 and self.goals / self.played >= least_share

    def below(self, least_share: float, where: str = ALONE) -> str:
        """The share and its bound, as a clause; `where` as in `AloneBound`."""
        percent = int(self.goals / max(self.played, 1) * 1000) / 10  # rounded down: below stays below
        broken = "".join(
            f", and in {vars(self)[rule]} more after {words}" for rule, (words, *_) in RULES.items() if vars(self)[rule]
        )
        counts = f"{self.goals} of {self.played} games ({percent:g} %){broken}"
        return f"{where} it reaches its goal in {counts}, below {round(least_share * 100, 10):g} %"


def goals_alone(games: pd.DataFrame | None, player: Literal["ego", "non_ego"]) -> Goals:
    """The goals of a player in an arm's rows of episodes.csv; None: the arm has no row.

    Several people drive one at a time, and their games count together.
    An ego that breaks one of `RULES` can't drive the scene. Persons may: some are made for it.
    """
    from harness.evaluation.people import outcomes_of_people

    if games is None:
        return Goals(goals=0, played=0)
    outcome = games["ego_outcome"].fillna("") if player == "ego" else outcomes_of_people(games)
    played = (games["error"].fillna("") == "") & ~outcome.isin(["", "error"])
    goals, broken = played & (outcome == "goal"), {}
    for rule, (_, column, least) in RULES.items() if player == "ego" else ():
        breaks = goals & (games[column].fillna(0.0) >= least)
        broken[rule], goals = int(breaks.sum()), goals & ~breaks
    return Goals(goals=int(goals.sum()), played=int(played.sum()), **broken)


def broken_by(record: Mapping[str, Any]) -> str:
    """The key of the rule of `RULES` that the ego broke in a game, from its cells of episodes.csv; empty if none."""
    return next((rule for rule, (_, column, least) in RULES.items() if (record.get(column) or 0.0) >= least), "")


def gate(bounds: Iterable[AloneBound], seed: int, games: Mapping[Any, pd.DataFrame]) -> dict[str, str]:
    """Why a verdict on these players does not count, as the cells `verdict` (one of `WITHHELD`) and `reason` (each
    player below its bound, with its share) of a table; both are empty if it counts.

    `games` are the rows of episodes.csv by (arm, seed). A bound of 0 is always met.
    """
    incapable, clauses = set(), []
    for bound in bounds:
        if bound.goal_share == 0:
            continue
        played = games.get((bound.arm, seed))
        goals = goals_alone(played, bound.player)
        if goals.suffice(bound.goal_share):
            continue
        if goals.played:
            incapable.add(bound.player)
            clauses.append(f"{bound.words} can't drive this scene: {goals.below(bound.goal_share, bound.where)}")
        else:
            unknown = f"so it is not known how {bound.words} drives"
            why = (
                f"the arm {bound.arm} is not finished"
                if played is None
                else f"no game of the arm {bound.arm} could be played"
            )
            clauses.append(f"{why}, {unknown}")
    if not clauses:
        return {"verdict": "", "reason": ""}
    verdict = {
        frozenset({"ego"}): Verdict.EGO_CANNOT_DRIVE,
        frozenset({"non_ego"}): Verdict.NON_EGO_CANNOT_DRIVE,
        frozenset({"ego", "non_ego"}): Verdict.NEITHER_CAN_DRIVE,
    }.get(frozenset(incapable), Verdict.NOT_PLAYED_ALONE)
    return {"verdict": verdict.value, "reason": "; ".join(dict.fromkeys(clauses))}


def gate_of(question: Question, games: Mapping[Any, pd.DataFrame]) -> dict[str, str]:
    """The cells of `gate` for a question: its players drive the scene alone, and its person drives as people do."""
    closed = gate(question.alone, question.seed, games)
    if closed["reason"] or not question.unlike_people:
        return closed
    return {"verdict": Verdict.UNLIKE_PEOPLE.value, "reason": question.unlike_people}


ALL_TRAITS = "all"
"""The row of all traits together: the person against the baseline."""


@dataclass(frozen=True, kw_only=True)
class TraitQuestion:
    """How many failures one trait of a persona causes, for one training seed: four arms of the same episodes."""

    persona: str
    seed: int
    trait: str
    """Its name in `config.traits.TRAITS`, or `ALL_TRAITS`."""
    arm: str
    """The ego against the persona."""
    without_arm: str
    """Against the persona with the baseline's value of the trait."""
    baseline_arm: str
    """Against the baseline."""
    alone_arm: str
    """Against the baseline with the persona's value of the trait; empty of `ALL_TRAITS`: that is the persona."""
    bounds: tuple[AloneBound, ...] = ()
    """What ego, persona and baseline have to achieve alone; otherwise there is no test."""

    @property
    def arms(self) -> tuple[str, ...]:
        return tuple(filter(None, (self.arm, self.without_arm, self.baseline_arm, self.alone_arm)))
