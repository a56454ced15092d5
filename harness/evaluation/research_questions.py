"""The research questions on two arms, and their possible answers.

Separate from `comparison`, so that planning and wording do not import the statistics.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Literal

ResearchQuestion = Literal["RQ1", "RQ2"]


@dataclass(frozen=True, kw_only=True)
class AloneBound:
    """What a player has to achieve without the other player before a verdict on it counts."""

    player: Literal["ego", "non_ego"]
    words: str
    """The player in sentences, such as "the naive ego"."""
    arm: str
    """The arm in which it drives alone."""
    goal_share: float
    """The least share of that arm's games in which it reaches its goal."""


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


class Verdict(str, Enum):
    """Every value the column `verdict` can have."""

    SIGNIFICANT = "significant"
    """p_holm < significance (and so p_value < significance)."""
    BEFORE_HOLM_ONLY = "significant before Holm's correction only"
    """p_value < significance <= p_holm."""
    NOT_SIGNIFICANT = "not significant"
    NO_DIFFERENCE = "no difference"
    """Every difference is 0, so there is no t statistic."""
    ALL_EQUAL = "no t statistic: all differences equal"
    """Every difference is the same number, not 0. For failures `mcnemar_p` still exists."""
    NOT_ENOUGH_PAIRS = "not enough pairs"
    """Fewer than two pairs could be compared."""
    EGO_CANNOT_DRIVE = "not answered: the ego can't drive this scene"
    """An ego of the question reaches its goal alone in fewer games than `AloneBound` asks. This verdict and the next
    three go before all others: there is no test."""
    NON_EGO_CANNOT_DRIVE = "not answered: the person can't drive this scene"
    NEITHER_CAN_DRIVE = "not answered: neither the ego nor the person can drive this scene"
    NOT_PLAYED_ALONE = "not answered: a player was not played alone"
    """It is not known whether the players can drive the scene."""


INCOMPETENT = frozenset(
    {Verdict.EGO_CANNOT_DRIVE, Verdict.NON_EGO_CANNOT_DRIVE, Verdict.NEITHER_CAN_DRIVE, Verdict.NOT_PLAYED_ALONE}
)
"""The verdicts on players that were not shown to drive the scene."""
