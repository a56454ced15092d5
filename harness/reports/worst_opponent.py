"""The worst known opponent of an ego: of all that it was assessed against, the one that makes it fail most often."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from harness.evaluation.strategies import Arm, EgoStrategy, PersonaNonEgo
from harness.game.roles import NON_EGO
from harness.reports.differences import Row


@dataclass(frozen=True, kw_only=True)
class WorstOpponent:
    """The arm of an ego with the most failures."""

    arm: str
    seed: int
    row: Row
    """Of `summary`."""
    assessed: int
    """How many opponents the ego was assessed against."""


def worst_opponent(
    ego: EgoStrategy, arms: Mapping[str, Arm], rows: Mapping[tuple[str, int], Row]
) -> WorstOpponent | None:
    """The worst opponent of an ego among people and best responses; None if it was assessed against one at most."""
    known = {name for name, arm in arms.items() if _meets_a_person(arm, ego)}
    found = {key: row for key, row in rows.items() if key[0] in known and row["failure_rate"] == row["failure_rate"]}
    assessed = len({arm for arm, _ in found})
    if assessed < 2:
        return None
    (arm, seed), row = max(found.items(), key=lambda each: each[1]["failure_rate"])
    return WorstOpponent(arm=arm, seed=seed, row=row, assessed=assessed)


def _meets_a_person(arm: Arm, ego: EgoStrategy) -> bool:
    """Whether the arm is this ego against a person, or against the best response of one."""
    return arm.ego == ego and isinstance(arm.non_ego, PersonaNonEgo) and arm.best_response_of in (None, NON_EGO)
