"""The tests that a campaign plans: the families of Holm's correction, known before any test is made.

A campaign has one primary test for each research question and persona: that of failures. It is planned for each
trained pair, and, with `LEAST_TRAININGS` training seeds or more, once over the trainings. These are two kinds of
statements, and each has a family of its own: how many pairs are looked at one by one does not change what is said about
trainings like them. A planned test stays in its family whatever comes out: one that can't be made counts as p = 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from enum import Enum

from harness.evaluation.competence import Question

PRIMARY = "failure"
"""The metric of primary tests. Tests of other metrics are secondary: they are not corrected, and are no answers."""
LEAST_TRAININGS = 3
"""The fewest trainings from which something is said about trainings like them. From two, Student's t with one degree of
freedom would give an interval of 13 standard errors to either side."""


class About(str, Enum):
    """What a statement holds for."""

    TRAINED_PAIR = "this trained pair"
    """The players of one training seed, in games like those that they played: conditional on the training."""
    TRAININGS = "trainings like this"
    """Players of other training seeds too."""


PlannedTest = tuple[Question, ...]
"""A primary test, of one trained pair or over the training seeds: the same question for each of its seeds."""


def families(questions: Sequence[Question]) -> dict[About, list[PlannedTest]]:
    """The tests that are corrected together; a family without any is left out."""
    of_seeds: dict[Question, list[Question]] = {}
    for each in questions:
        of_seeds.setdefault(replace(each, seed=0, unlike_people=""), []).append(each)
    pairs: list[PlannedTest] = [(each,) for asked in of_seeds.values() for each in asked]
    over = [tuple(asked) for asked in of_seeds.values() if len(asked) >= LEAST_TRAININGS]
    return {about: tests for about, tests in ((About.TRAINED_PAIR, pairs), (About.TRAININGS, over)) if tests}
