"""The research questions on two arms, and their possible answers.

Separate from `comparison`, so that planning and wording do not import the statistics.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Literal

ResearchQuestion = Literal["RQ1", "RQ2"]


@dataclass(frozen=True, kw_only=True)
class Question:
    """One research question, asked of one persona and training seed: two arms of the same episodes."""

    question: ResearchQuestion
    persona: str
    seed: int
    baseline: str
    treatment: str


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
