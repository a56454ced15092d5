"""Equation 1 of the paper: a player's payoff as a weighted sum of safety, operational and human terms.

    payoff = a0 * sum(safety terms) + a1 * sum(operational terms) + a2 * sum(human terms)

added up over every step of the game. Every term is of the player's own doing and faring: none knows another's
payoff, and weights are not negative, so no document can reward a player for harm to another (nor can a fuzzy term:
contact must be the worst of its distances).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.fuzzy import FuzzyFunction
from harness.game.jit import compiled
from harness.game.quantities import Quantities
from harness.game.state import Outcome

GROUPS = ("safety", "operational", "human")
FUZZY_QUANTITIES: Mapping[str, str] = {
    "speed_over_limit": "speed over the limit, as a share of it; negative below",
    "speed_mps": "speed",
    "time_gap_s": "time gap to the vehicle ahead",
    "clearance_m": "distance to the nearest surface, rail or vehicle",
    "lane_offset_m": "distance from the centre of the nearest lane",
    "lane_end_m": "distance until the lane the car is in ends; infinite if it goes on",
    "goal_m": "distance to the goal, along the route",
}
"""The quantities that a fuzzy term can be a function of, in words."""
NEARNESS = ("time_gap_s", "clearance_m")  # those of them that are 0 at contact


class Form(IntEnum):
    """What a term makes of its quantity."""

    BELOW = 0  # 0 at the parameter and above, falling to -1 at zero
    OVER = 1  # how far it is above zero, negative
    UNDER = 2  # how far it is below zero, negative
    LESS = 3  # negative
    LESS_SQUARED = 4  # as a share of 10 m/s2, squared, negative
    PER_100 = 5
    GAINED = 6  # 1 where it is the parameter
    LOST = 7  # -1 where it is the parameter
    ALWAYS = 8  # -1


@dataclass(frozen=True)
class Term:
    """A named term of equation 1.

    `quantity` names the one of `Quantities` that it is made of, [G, P]. `per_second` terms are rates and are multiplied
    by the step length; the others are events, counted in the step they happen.
    """

    group: str
    meaning: str
    quantity: str
    form: Form
    per_second: bool = False
    parameter: str = ""
    """The name of the form's parameter, where a persona gives it: a limit in the quantity's unit."""
    outcome: Outcome = Outcome.RUNNING
    """The form's parameter, where it is an outcome."""


def _ended(group: str, meaning: str, form: Form, outcome: Outcome) -> Term:
    return Term(group, meaning, "state.outcome", form, outcome=outcome)


TERMS: Mapping[str, Term] = {
    "collision": _ended("safety", "touching a vehicle or person, once", Form.LOST, Outcome.COLLISION),
    "rail": _ended("safety", "touching the edge of the road, once", Form.LOST, Outcome.RAIL),
    "clearance": Term(
        "safety",
        "nearness to the nearest surface, rail or vehicle",
        "clearance_m",
        Form.BELOW,
        True,
        "within_m",
    ),
    "vehicle_clearance": Term(
        "safety",
        "nearness to the nearest vehicle",
        "vehicle_clearance_m",
        Form.BELOW,
        True,
        "within_m",
    ),
    "time_gap": Term("safety", "following closer than a time gap", "time_gap_s", Form.BELOW, True, "within_s"),
    "time_to_collision": Term(
        "safety",
        "being on a course to contact sooner than this",
        "time_to_collision_s",
        Form.BELOW,
        True,
        "within_s",
    ),
    "speed_over_limit": Term("safety", "speed over the limit, as a share of it", "speed_over_limit", Form.OVER, True),
    "goal": _ended("operational", "reaching the goal, once", Form.GAINED, Outcome.GOAL),
    "timeout": _ended("operational", "not reaching the goal in time, once", Form.LOST, Outcome.TIMEOUT),
    "progress": Term("operational", "way along the route, per 100 m", "advanced_m", Form.PER_100),
    "speed_under_limit": Term(
        "operational", "speed under the limit, as a share of it", "speed_over_limit", Form.UNDER, True
    ),
    "lane_offset": Term("operational", "distance from the nearest lane's centre, m", "lane_offset_m", Form.LESS, True),
    "acceleration": Term(
        "operational",
        "squared acceleration or braking, as a share of 10 m/s2",
        "state.acceleration_mps2",
        Form.LESS_SQUARED,
        True,
    ),
    "lateral_acceleration": Term(
        "operational",
        "squared lateral acceleration, as a share of 10 m/s2",
        "lateral_acceleration_mps2",
        Form.LESS_SQUARED,
        True,
    ),
    "time_pressure": Term("human", "every second on the way", "state.speed_mps", Form.ALWAYS, True),
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
        shares, _ = self._weighed(q, player)
        fuzzy = self._fuzzy_shares(q, player)
        return dict(zip((*(each.name for each in self.terms), *self.fuzzy), (*shares, *fuzzy), strict=True))

    def total(self, q: Quantities, player: int) -> FloatArray:
        """[G] the step's payoff of one player."""
        _, total = self._weighed(q, player)
        for share in self._fuzzy_shares(q, player):
            total += share
        return total

    def _weighed(self, q: Quantities, player: int) -> tuple[FloatArray, FloatArray]:
        """[T, G] the shares of the terms that are not fuzzy, and [G] their sum."""
        values = np.empty((len(self._quantities), len(q.state.step)))
        for row, quantity in enumerate(self._quantities):
            values[row] = quantity(q)[:, player]
        return _weighed(values, *self._weights, q.world.step_s)

    def _fuzzy_shares(self, q: Quantities, player: int) -> Iterator[FloatArray]:
        """[G] the share of each fuzzy term."""
        for weight, function in self.fuzzy.values():
            yield self.alpha["human"] * weight * q.world.step_s * function(getattr(q, function.quantity)[:, player])

    @cached_property
    def _quantities(self) -> list[Callable[[Quantities], NDArray[Any]]]:
        """What the terms that are not fuzzy are made of, each once."""
        return [attrgetter(name) for name in self._quantity_names]

    @cached_property
    def _quantity_names(self) -> list[str]:
        return list(dict.fromkeys(TERMS[each.name].quantity for each in self.terms))

    @cached_property
    def _weights(self) -> tuple[IntArray, IntArray, FloatArray, FloatArray, BoolArray]:
        """Of each term that is not fuzzy: the row of its quantity, form, the form's parameter, weight with alpha, and
        whether it is a rate."""
        terms = [TERMS[each.name] for each in self.terms]
        parameters = [
            float(term.outcome if each.parameter is None else each.parameter)
            for term, each in zip(terms, self.terms, strict=True)
        ]
        weights = [self.alpha[term.group] * each.weight for term, each in zip(terms, self.terms, strict=True)]
        rows = np.array([self._quantity_names.index(term.quantity) for term in terms], dtype=np.int64)
        forms = np.array([int(term.form) for term in terms], dtype=np.int64)
        rates = np.array([term.per_second for term in terms], dtype=bool)
        return rows, forms, np.array(parameters, dtype=float), np.array(weights, dtype=float), rates


@compiled
def _weighed(
    values: FloatArray,
    row: IntArray,
    form: IntArray,
    parameter: FloatArray,
    weight: FloatArray,
    per_second: BoolArray,
    step_s: float,
) -> tuple[FloatArray, FloatArray]:
    """[T, G] terms' shares of the payoff, made of their quantities' values [Q, G], and [G] their sum from the first
    to the last."""
    shares, total = np.empty((len(form), values.shape[1])), np.zeros(values.shape[1])
    for term in range(len(form)):
        scale = weight[term] * (step_s if per_second[term] else 1.0)
        for g in range(values.shape[1]):
            share = scale * _worth(values[row[term], g], form[term], parameter[term])
            shares[term, g] = share
            total[g] += share
    return shares, total


@compiled
def _worth(value: float, form: int, parameter: float) -> float:
    if form == Form.BELOW:
        return np.minimum(value / parameter, 1.0) - 1.0
    if form == Form.OVER:
        return -np.maximum(value, 0.0)
    if form == Form.UNDER:
        return np.minimum(value, 0.0)
    if form == Form.LESS:
        return -value
    if form == Form.LESS_SQUARED:
        return -((value / 10.0) * (value / 10.0))
    if form == Form.PER_100:
        return value / 100.0
    if form == Form.GAINED:
        return 1.0 if value == parameter else 0.0
    if form == Form.LOST:
        return -1.0 if value == parameter else -0.0
    return -1.0
