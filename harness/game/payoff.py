"""Equation 1 of the paper: a player's payoff as a weighted sum of safety, operational and human terms.

    payoff = a0 * sum(safety terms) + a1 * sum(operational terms) + a2 * sum(human terms)

added up over every step of the game. Every term is of the player's own doing and faring: none knows another's
payoff, and weights are not negative, so no document can reward a player for harm to another (nor can a fuzzy term:
contact must be the worst of its distances).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from harness.game.arrays import FloatArray
from harness.game.fuzzy import FuzzyFunction
from harness.game.quantities import Quantities
from harness.game.state import Outcome

GROUPS = ("safety", "operational", "human")
FUZZY_QUANTITIES: Mapping[str, str] = {
    "speed_over_limit": "speed over the limit, as a share of it; negative below",
    "speed_mps": "speed",
    "time_gap_s": "time gap to the vehicle ahead",
    "clearance_m": "distance to the nearest surface, rail or vehicle",
    "lane_offset_m": "distance from the centre of the nearest lane",
    "goal_m": "distance to the goal, along the route",
}
"""The quantities that a fuzzy term can be a function of, in words."""
NEARNESS = ("time_gap_s", "clearance_m")  # those of them that are 0 at contact


@dataclass(frozen=True)
class Term:
    """A named term of equation 1.

    `value` gives [G, P]; with `parameter`, a limit in that unit, as its second argument. `per_second` terms are
    rates and are multiplied by the step length; the others are events, counted in the step they happen.
    """

    group: str
    meaning: str
    value: Callable[..., FloatArray]
    per_second: bool = False
    parameter: str = ""


def _below(value: FloatArray, limit: float) -> FloatArray:
    """0 at the limit and above, falling to -1 at zero."""
    return np.minimum(value / limit, 1.0) - 1.0


def _ended(outcome: Outcome, sign: float) -> Callable[[Quantities], FloatArray]:
    code = int(outcome)  # NumPy would ask the enumeration each time
    return lambda q: sign * (q.state.outcome == code)


TERMS: Mapping[str, Term] = {
    "collision": Term("safety", "touching a vehicle or person, once", _ended(Outcome.COLLISION, -1.0)),
    "rail": Term("safety", "touching the edge of the road, once", _ended(Outcome.RAIL, -1.0)),
    "clearance": Term(
        "safety",
        "nearness to the nearest surface, rail or vehicle",
        lambda q, m: _below(q.clearance_m, m),
        True,
        "within_m",
    ),
    "vehicle_clearance": Term(
        "safety",
        "nearness to the nearest vehicle",
        lambda q, m: _below(q.vehicle_clearance_m, m),
        True,
        "within_m",
    ),
    "time_gap": Term(
        "safety", "following closer than a time gap", lambda q, s: _below(q.time_gap_s, s), True, "within_s"
    ),
    "time_to_collision": Term(
        "safety",
        "being on a course to contact sooner than this",
        lambda q, s: _below(q.time_to_collision_s, s),
        True,
        "within_s",
    ),
    "speed_over_limit": Term(
        "safety",
        "speed over the limit, as a share of it",
        lambda q: -np.maximum(q.speed_over_limit, 0.0),
        True,
    ),
    "goal": Term("operational", "reaching the goal, once", _ended(Outcome.GOAL, 1.0)),
    "timeout": Term("operational", "not reaching the goal in time, once", _ended(Outcome.TIMEOUT, -1.0)),
    "progress": Term("operational", "way along the route, per 100 m", lambda q: q.advanced_m / 100.0),
    "speed_under_limit": Term(
        "operational",
        "speed under the limit, as a share of it",
        lambda q: np.minimum(q.speed_over_limit, 0.0),
        True,
    ),
    "lane_offset": Term("operational", "distance from the nearest lane's centre, m", lambda q: -q.lane_offset_m, True),
    "acceleration": Term(
        "operational",
        "squared acceleration or braking, as a share of 10 m/s2",
        lambda q: -((q.state.acceleration_mps2 / 10.0) ** 2),
        True,
    ),
    "lateral_acceleration": Term(
        "operational",
        "squared lateral acceleration, as a share of 10 m/s2",
        lambda q: -((q.lateral_acceleration_mps2 / 10.0) ** 2),
        True,
    ),
    "time_pressure": Term("human", "every second on the way", lambda q: np.full(q.state.x_m.shape, -1.0), True),
}


@dataclass(frozen=True)
class Weighted:
    """A term with its weight and, where it takes one, its parameter."""

    name: str
    weight: float
    parameter: float | None = None


@dataclass(frozen=True)
class Payoff:
    """One player's equation 1."""

    alpha: Mapping[str, float]  # by group: a0, a1, a2
    terms: tuple[Weighted, ...]
    fuzzy: Mapping[str, tuple[float, FuzzyFunction]]  # human terms declared by membership functions, per second

    def evaluate(self, q: Quantities, player: int) -> dict[str, FloatArray]:
        """Each term's share of the step's payoff, [G], weights applied; their sum is the payoff."""
        shares: dict[str, FloatArray] = {}
        for each in self.terms:
            term = TERMS[each.name]
            value = term.value(q) if each.parameter is None else term.value(q, each.parameter)
            scale = self.alpha[term.group] * each.weight * (q.world.step_s if term.per_second else 1.0)
            shares[each.name] = scale * value[:, player]
        for name, (weight, function) in self.fuzzy.items():
            value = getattr(q, function.quantity)[:, player]
            shares[name] = self.alpha["human"] * weight * q.world.step_s * function(value)
        return shares

    def total(self, q: Quantities, player: int) -> FloatArray:
        """[G] the step's payoff of one player."""
        return sum(self.evaluate(q, player).values(), np.zeros(len(q.state.step)))
