"""Equation 1 of the paper: a player's payoff as a weighted sum of safety, operational and human terms.

    payoff = a0 * sum(safety terms) + a1 * sum(operational terms) + a2 * sum(human terms)

summed over all steps of a game. Terms depend only on the player's own actions and results, not on another player's
payoff, and weights are not negative. A persona can therefore not reward harm to another player. This holds for fuzzy
terms as well: contact must be the worst of the distances.

A fuzzy term is declared by membership functions (zero-order Sugeno inference): it is the average of the sets' values,
weighted by the input's membership in each set (Sugeno, An introductory survey of fuzzy control, Information Sciences
36, 1985).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from operator import attrgetter

import numpy as np

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.jit import compiled
from harness.game.payoff_terms import TERMS, Form
from harness.game.quantities import Quantities


@dataclass(frozen=True, kw_only=True)
class Weighted:
    """A term of a payoff: its name, its weight and its parameter (None if it has none)."""

    name: str
    weight: float
    parameter: float | None = None


@dataclass(frozen=True, kw_only=True)
class FuzzySet:
    """A membership function through points (input, membership from 0 to 1), linear between them, constant outside."""

    name: str
    inputs: tuple[float, ...]
    memberships: tuple[float, ...]
    value: float


@dataclass(frozen=True)
class FuzzyFunction:
    """A function of one quantity of the game, defined by fuzzy sets."""

    quantity: str
    sets: tuple[FuzzySet, ...]

    def __call__(self, value: FloatArray) -> FloatArray:
        """[...] values of the function: 0 where the input belongs to no set, NaN where the input is NaN."""
        value = np.asarray(value, dtype=float)
        return _infer(value.ravel(), *self._points).reshape(value.shape)

    @cached_property
    def _points(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """[S, N] inputs and memberships of the sets' points, the last one repeated, and [S] the sets' values."""
        most = max(len(each.inputs) for each in self.sets)
        inputs, memberships = (
            [[*points, *[points[-1]] * (most - len(points))] for points in columns]
            for columns in zip(*((each.inputs, each.memberships) for each in self.sets), strict=True)
        )
        return np.array(inputs), np.array(memberships), np.array([each.value for each in self.sets])


@dataclass(frozen=True, kw_only=True)
class Payoff:
    """Equation 1 of one player."""

    alpha: Mapping[str, float]  # by group: a0, a1, a2
    terms: tuple[Weighted, ...]
    fuzzy: Mapping[str, tuple[float, FuzzyFunction]]  # human terms, per second: weight and function

    def evaluate(self, q: Quantities, player: int) -> dict[str, FloatArray]:
        """The weighted value [G] of each term in this step, by name; the sum is the step's payoff."""
        values = self._term_values(q, player)[:-1]
        fuzzy = self._fuzzy_values(q, player)
        return dict(zip((*(each.name for each in self.terms), *self.fuzzy), (*values, *fuzzy), strict=True))

    def total(self, q: Quantities, player: int) -> FloatArray:
        """[G] one player's payoff of the step."""
        total: FloatArray = self._term_values(q, player)[-1]
        for value in self._fuzzy_values(q, player):
            total += value
        return total

    def _term_values(self, q: Quantities, player: int) -> FloatArray:
        of_terms, columns = self._columns
        quantities = np.empty((len(of_terms), len(q.state.step)))
        for row, quantity in enumerate(of_terms):
            quantities[row] = quantity(q)[:, player]
        return _term_values(quantities, columns, q.world.step_s)

    def _fuzzy_values(self, q: Quantities, player: int) -> Iterator[FloatArray]:
        for weight, function in self.fuzzy.values():
            yield self.alpha["human"] * weight * q.world.step_s * function(getattr(q, function.quantity)[:, player])

    @cached_property
    def _columns(
        self,
    ) -> tuple[list[attrgetter[FloatArray]], tuple[IntArray, IntArray, FloatArray, FloatArray, BoolArray]]:
        """The quantities of the terms without the fuzzy ones, each once, and [T] for each term: row of its quantity,
        form, the form's parameter, weight times alpha, whether it is a rate."""
        terms = [(each, TERMS[each.name]) for each in self.terms]
        names = list(dict.fromkeys(term.quantity for _, term in terms))
        parameters = [term.outcome if each.parameter is None else each.parameter for each, term in terms]
        columns = (
            np.array([names.index(term.quantity) for _, term in terms], dtype=np.int64),
            np.array([int(term.form) for _, term in terms], dtype=np.int64),
            np.array(parameters, dtype=float),
            np.array([self.alpha[term.group] * each.weight for each, term in terms], dtype=float),
            np.array([term.per_second for _, term in terms], dtype=bool),
        )
        return [attrgetter(name) for name in names], columns


@compiled
def _term_values(
    quantities: FloatArray, terms: tuple[IntArray, IntArray, FloatArray, FloatArray, BoolArray], step_s: float
) -> FloatArray:
    """[T + 1, G] weighted values of T terms of quantities [Q, G], and their sum, added in the order of the terms.

    `terms` are the columns of `Payoff._columns`.
    """
    row, form, parameter, weight, per_second = terms
    values = np.zeros((len(form) + 1, quantities.shape[1]))
    for term in range(len(form)):
        scale = weight[term] * (step_s if per_second[term] else 1.0)
        for g in range(quantities.shape[1]):
            value = scale * unweighted(quantities[row[term], g], form[term], parameter[term])
            values[term, g] = value
            values[-1, g] += value
    return values


@compiled
def unweighted(value: float, form: int, parameter: float) -> float:
    """The form of a term, applied to its quantity: the term's value, per second or once, before weight and alpha."""
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
    if form == Form.FROM:
        return -1.0 if value >= parameter else -0.0
    return -1.0


@compiled
def _infer(value: FloatArray, inputs: FloatArray, memberships: FloatArray, values: FloatArray) -> FloatArray:
    result = np.zeros(value.shape)
    for n in range(len(value)):
        total, weighted = 0.0, 0.0
        for k in range(len(values)):
            membership = np.interp(value[n], inputs[k], memberships[k])
            total += membership
            weighted += membership * values[k]
        if not total <= 0.0:
            result[n] = weighted / total
    return result
