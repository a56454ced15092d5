"""Equation 1 of the paper: a player's payoff as a weighted sum of safety, operational and human terms.

    payoff = a0 * sum(safety terms) + a1 * sum(operational terms) + a2 * sum(human terms)

summed over all steps of a game. Terms depend only on the player's own actions and results, not on another player's
payoff, and weights are not negative. A persona can therefore not reward harm to another player. This holds for fuzzy
terms as well: contact must be the worst of the distances.
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
"""The quantities that a fuzzy term can use, with their descriptions."""
NEARNESS = ("time_gap_s", "clearance_m")  # the fuzzy quantities that are 0 at contact


class Form(IntEnum):
    """The function that a term applies to its quantity."""

    BELOW = 0  # 0 at the parameter and above, linear to -1 at zero
    OVER = 1  # minus the positive part
    UNDER = 2  # the negative part
    LESS = 3  # minus the quantity
    LESS_SQUARED = 4  # minus the square, in units of 10 m/s2
    PER_100 = 5  # a hundredth of the quantity
    GAINED = 6  # 1 if equal to the parameter
    LOST = 7  # -1 if equal to the parameter
    ALWAYS = 8  # -1


@dataclass(frozen=True, kw_only=True)
class Term:
    """A named term of equation 1.

    `quantity` is the name of its quantity [G, P] in `Quantities`. `per_second` terms are rates and are multiplied by
    the step length. The other terms are events and count in the step in which they occur.
    """

    group: str
    meaning: str
    quantity: str
    form: Form
    per_second: bool = False
    parameter: str = ""
    """The name of the form's parameter, if a persona sets it: a limit in the quantity's unit."""
    outcome: Outcome = Outcome.RUNNING
    """The form's parameter, if it is an outcome."""


def _outcome_term(*, group: str, meaning: str, form: Form, outcome: Outcome) -> Term:
    return Term(group=group, meaning=meaning, quantity="state.outcome", form=form, outcome=outcome)


TERMS: Mapping[str, Term] = {
    "collision": _outcome_term(
        group="safety", meaning="touching a vehicle or person, once", form=Form.LOST, outcome=Outcome.COLLISION
    ),
    "rail": _outcome_term(
        group="safety", meaning="touching the edge of the road, once", form=Form.LOST, outcome=Outcome.RAIL
    ),
    "clearance": Term(
        group="safety",
        meaning="nearness to the nearest surface, rail or vehicle",
        quantity="clearance_m",
        form=Form.BELOW,
        per_second=True,
        parameter="within_m",
    ),
    "vehicle_clearance": Term(
        group="safety",
        meaning="nearness to the nearest vehicle",
        quantity="vehicle_clearance_m",
        form=Form.BELOW,
        per_second=True,
        parameter="within_m",
    ),
    "time_gap": Term(
        group="safety",
        meaning="following closer than a time gap",
        quantity="time_gap_s",
        form=Form.BELOW,
        per_second=True,
        parameter="within_s",
    ),
    "time_to_collision": Term(
        group="safety",
        meaning="being on a course to contact sooner than this",
        quantity="time_to_collision_s",
        form=Form.BELOW,
        per_second=True,
        parameter="within_s",
    ),
    "speed_over_limit": Term(
        group="safety",
        meaning="speed over the limit, as a share of it",
        quantity="speed_over_limit",
        form=Form.OVER,
        per_second=True,
    ),
    "goal": _outcome_term(
        group="operational", meaning="reaching the goal, once", form=Form.GAINED, outcome=Outcome.GOAL
    ),
    "timeout": _outcome_term(
        group="operational", meaning="not reaching the goal in time, once", form=Form.LOST, outcome=Outcome.TIMEOUT
    ),
    "progress": Term(
        group="operational",
        meaning="way along the route, per 100 m",
        quantity="advanced_m",
        form=Form.PER_100,
    ),
    "speed_under_limit": Term(
        group="operational",
        meaning="speed under the limit, as a share of it",
        quantity="speed_over_limit",
        form=Form.UNDER,
        per_second=True,
    ),
    "lane_offset": Term(
        group="operational",
        meaning="distance from the nearest lane's centre, m",
        quantity="lane_offset_m",
        form=Form.LESS,
        per_second=True,
    ),
    "acceleration": Term(
        group="operational",
        meaning="squared acceleration or braking, as a share of 10 m/s2",
        quantity="state.acceleration_mps2",
        form=Form.LESS_SQUARED,
        per_second=True,
    ),
    "lateral_acceleration": Term(
        group="operational",
        meaning="squared lateral acceleration, as a share of 10 m/s2",
        quantity="lateral_acceleration_mps2",
        form=Form.LESS_SQUARED,
        per_second=True,
    ),
    "time_pressure": Term(
        group="human",
        meaning="every second on the way",
        quantity="state.speed_mps",
        form=Form.ALWAYS,
        per_second=True,
    ),
}


@dataclass(frozen=True, kw_only=True)
class Weighted:
    """A term of a payoff: its name, its weight and its parameter (None if it has none)."""

    name: str
    weight: float
    parameter: float | None = None


@dataclass(frozen=True, kw_only=True)
class Payoff:
    """Equation 1 of one player."""

    alpha: Mapping[str, float]  # by group: a0, a1, a2
    terms: tuple[Weighted, ...]
    fuzzy: Mapping[str, tuple[float, FuzzyFunction]]  # human terms, per second: weight and function

    def evaluate(self, q: Quantities, player: int) -> dict[str, FloatArray]:
        """The weighted value [G] of each term in this step, by name; the sum is the step's payoff."""
        values, _ = self._term_values(q, player)
        fuzzy = self._fuzzy_values(q, player)
        return dict(zip((*(each.name for each in self.terms), *self.fuzzy), (*values, *fuzzy), strict=True))

    def total(self, q: Quantities, player: int) -> FloatArray:
        """[G] one player's payoff of the step."""
        _, total = self._term_values(q, player)
        for value in self._fuzzy_values(q, player):
            total += value
        return total

    def _term_values(self, q: Quantities, player: int) -> tuple[FloatArray, FloatArray]:
        """[T, G] weighted values of the terms without the fuzzy ones, and [G] their sum."""
        quantities = np.empty((len(self._quantities), len(q.state.step)))
        for row, quantity in enumerate(self._quantities):
            quantities[row] = quantity(q)[:, player]
        return _term_values(quantities, *self._weights, q.world.step_s)

    def _fuzzy_values(self, q: Quantities, player: int) -> Iterator[FloatArray]:
        """[G] weighted value of each fuzzy term."""
        for weight, function in self.fuzzy.values():
            yield self.alpha["human"] * weight * q.world.step_s * function(getattr(q, function.quantity)[:, player])

    @cached_property
    def _quantities(self) -> list[Callable[[Quantities], NDArray[Any]]]:
        """Getters of the quantities that the terms without the fuzzy ones use, each once."""
        return [attrgetter(name) for name in self._quantity_names]

    @cached_property
    def _quantity_names(self) -> list[str]:
        return list(dict.fromkeys(TERMS[each.name].quantity for each in self.terms))

    @cached_property
    def _weights(self) -> tuple[IntArray, IntArray, FloatArray, FloatArray, BoolArray]:
        """[T] for each term without the fuzzy ones: row of its quantity, form, the form's parameter, weight times
        alpha, whether it is a rate."""
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
def _term_values(
    quantities: FloatArray,
    row: IntArray,
    form: IntArray,
    parameter: FloatArray,
    weight: FloatArray,
    per_second: BoolArray,
    step_s: float,
) -> tuple[FloatArray, FloatArray]:
    """[T, G] weighted values of T terms of quantities [Q, G], and [G] their sum, added in the order of the terms."""
    values, total = np.empty((len(form), quantities.shape[1])), np.zeros(quantities.shape[1])
    for term in range(len(form)):
        scale = weight[term] * (step_s if per_second[term] else 1.0)
        for g in range(quantities.shape[1]):
            value = scale * _unweighted(quantities[row[term], g], form[term], parameter[term])
            values[term, g] = value
            total[g] += value
    return values, total


@compiled
def _unweighted(value: float, form: int, parameter: float) -> float:
    """The form of a term, applied to its quantity."""
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
