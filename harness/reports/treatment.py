"""What round 2 makes of the ego, and which arms the research questions compare."""

from __future__ import annotations

from typing import NamedTuple


class Change(NamedTuple):
    """What round 2 makes of the ego."""

    made: str
    """The name of the ego afterwards, with which the names of its arms begin."""
    doing: str
    """The treatment, as a noun."""


RETRAINED = Change("retrained", "retraining")
RECONFIGURED = Change("reconfigured", "reconfiguration")

ARMS = {
    "RQ1": lambda persona, change: ("naive_alone", f"naive_vs_{persona}"),
    "RQ2": lambda persona, change: (f"naive_vs_{persona}", f"{change.made}_vs_{persona}"),
}
"""Baseline and treatment arm of each question, by persona and change."""
