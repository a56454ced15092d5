"""What round 2 makes of the ego, and which arms the research questions compare."""

from __future__ import annotations

from typing import NamedTuple


class Change(NamedTuple):
    """What round 2 makes of the ego."""

    made: str
    """What the ego is afterwards; its arms are called so."""
    doing: str


RETRAINED = Change("retrained", "retraining")
RECONFIGURED = Change("reconfigured", "reconfiguration")

ARMS = {
    "RQ1": lambda persona, change: ("naive_alone", f"naive_vs_{persona}"),
    "RQ2": lambda persona, change: (f"naive_vs_{persona}", f"{change.made}_vs_{persona}"),
}
"""Baseline and treatment of each question, of a persona and what round 2 does."""
