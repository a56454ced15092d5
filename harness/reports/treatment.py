"""What round 2 makes of the ego, and which arms the research questions compare."""

from __future__ import annotations

from typing import NamedTuple

from harness.evaluation.strategies import (
    NAIVE_ALONE,
    NaiveEgo,
    ReconfiguredEgo,
    RetrainedEgo,
    against_persona,
)


class Change(NamedTuple):
    """What round 2 makes of the ego."""

    made: str
    """The ego of round 2 in sentences."""
    doing: str
    """What round 2 does, in sentences."""
    ego: type[RetrainedEgo] | type[ReconfiguredEgo]
    """The ego of round 2 as a strategy."""
    naive: str = "naive ego"
    """The ego before round 2 in sentences, after "the": an ego that the campaign did not train has its own name."""


RETRAINED = Change("retrained", "retraining", RetrainedEgo)
RECONFIGURED = Change("reconfigured", "reconfiguration", ReconfiguredEgo)

ARMS = {
    "RQ1": lambda persona, change: (NAIVE_ALONE.name, against_persona(NaiveEgo(), persona).name),
    "RQ2": lambda persona, change: (
        against_persona(NaiveEgo(), persona).name,
        against_persona(change.ego(against=persona), persona).name,
    ),
}
"""Baseline and treatment of each question, by the persona and by what round 2 does."""
