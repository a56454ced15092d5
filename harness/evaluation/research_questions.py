"""The research questions on two arms. Separate from `comparison`, so that planning does not import the statistics."""

from __future__ import annotations

from dataclasses import dataclass
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
