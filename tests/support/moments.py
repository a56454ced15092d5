"""Cars of a moment of the merge road, what a player sees in it, and what a term is worth in it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

from harness.game.observation import observe
from harness.game.observation_layout import LAYOUT, in_units
from harness.game.payoff import Payoff, Weighted
from harness.game.payoff_terms import GROUPS
from harness.game.quantities import Quantities

Moment: TypeAlias = Callable[..., Quantities]
"""The fixture `moment`."""


def car(x_m: float, y_m: float = -1.6, **more: Any) -> dict[str, Any]:
    """A car on the lane of the merge road that continues."""
    return {"x_m": x_m, "y_m": y_m, **more}


FAR = car(190.0)


def seen(q: Quantities) -> dict[str, float]:
    """The ego's observation in the units that the names of the entries end with; its lock is 0.6 rad."""
    return dict(zip(LAYOUT, in_units(observe(q)[0, 0], 0.6).tolist(), strict=True))


def value_of(q: Quantities, name: str, limit: float | None = None, weight: float = 1.0) -> float:
    """The ego's value of one term in this step."""
    term = Weighted(name=name, weight=weight, parameter=limit)
    return float(Payoff(alpha=dict.fromkeys(GROUPS, 1.0), terms=(term,), fuzzy={}).evaluate(q, 0)[name][0])
