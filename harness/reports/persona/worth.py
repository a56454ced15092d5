"""The payoff of a persona's terms and functions in examples, computed by the code of the game itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from harness.config.json_schema import unit_of
from harness.config.persona import Persona
from harness.game.arrays import FloatArray
from harness.game.payoff import unweighted
from harness.game.payoff_terms import FUZZY_QUANTITIES, TERMS, Form

POINTS = 401
"""How many evenly spaced inputs a function is evaluated at, besides the points of its sets."""


@dataclass(frozen=True, kw_only=True)
class TermExample:
    """A term of a persona's payoff, with its value in an example."""

    group: str
    name: str
    alpha: float
    weight: float
    meaning: str
    limit: str
    """E.g. "within 0.6 m"; empty without a limit."""
    moment: str
    """The example in words, e.g. "per second at 0.3 m"."""
    worth: float
    """The payoff in this example: once, or in one second."""


@dataclass(frozen=True, kw_only=True)
class PayoffFunction:
    name: str
    quantity: str
    meaning: str
    unit: str
    inputs: FloatArray
    """[N] the quantity, rising over the range of the sets' points and a margin on both sides."""
    sets: tuple[tuple[str, float, FloatArray], ...]
    """Name, value and memberships [N] of each set."""
    alpha: float
    weight: float
    worth: FloatArray
    """[N] payoff per second, alpha and weight applied."""

    @property
    def best(self) -> tuple[float, float, float]:
        """The greatest payoff per second, and its first stretch of the quantity (from, to)."""
        return self._stretch(self.worth.max())

    @property
    def worst(self) -> tuple[float, float, float]:
        """The least payoff per second, and its first stretch of the quantity (from, to)."""
        return self._stretch(self.worth.min())

    def _stretch(self, value: float) -> tuple[float, float, float]:
        there = np.abs(self.worth - value) < 1e-9
        first = int(there.argmax())
        last = first + int(np.append(~there[first:], True).argmax()) - 1
        edge = (-np.inf if first == 0 else self.inputs[first], np.inf if last == len(there) - 1 else self.inputs[last])
        return float(value), float(edge[0]), float(edge[1])


def term_examples(persona: Persona) -> list[TermExample]:
    """Every named term of a persona's payoff, in the order of the document."""
    payoff = persona.payoff
    found = []
    for each in payoff.terms:
        term = TERMS[each.name]
        limit, (moment, value) = "", term.example
        if each.parameter is not None:
            unit, word = unit_of(term.parameter), term.parameter.split("_")[0]
            limit = f"{word} {each.parameter:g} {unit}"
            value = each.parameter if term.form == Form.FROM else each.parameter / 2
            moment = f"at {value:g} {unit}"
        parameter = float(term.outcome if each.parameter is None else each.parameter)
        alpha = payoff.alpha[term.group]
        found.append(
            TermExample(
                group=term.group,
                name=each.name,
                alpha=alpha,
                weight=each.weight,
                meaning=term.meaning,
                limit=limit,
                moment=f"per second {moment}" if term.per_second else moment,
                worth=alpha * each.weight * unweighted(value, int(term.form), parameter),
            )
        )
    return found


def payoff_functions(persona: Persona) -> list[PayoffFunction]:
    found = []
    alpha = persona.payoff.alpha["human"]
    for name, (weight, function) in persona.payoff.fuzzy.items():
        points = np.unique(np.concatenate([each.inputs for each in function.sets]))
        span = float(np.ptp(points)) or abs(float(points[0])) or 1.0
        low, high = points[0] - 0.15 * span, points[-1] + 0.15 * span
        if function.quantity not in _BELOW_ZERO:
            low = max(low, 0.0)
        inputs = np.unique(np.concatenate([np.linspace(low, high, POINTS), points[points >= low]]))
        sets = tuple(
            (each.name, each.value, np.interp(inputs, each.inputs, each.memberships)) for each in function.sets
        )
        found.append(
            PayoffFunction(
                name=name,
                quantity=function.quantity,
                meaning=FUZZY_QUANTITIES[function.quantity],
                unit=unit_of(function.quantity),
                inputs=inputs,
                sets=sets,
                alpha=alpha,
                weight=weight,
                worth=alpha * weight * function(inputs),
            )
        )
    return found


_BELOW_ZERO = ("speed_over_limit", "goal_m")  # quantities that can be negative
