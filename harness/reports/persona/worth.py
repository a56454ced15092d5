"""The payoff of a persona's terms and functions in examples, computed by the code of the game itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from harness.config.json_schema import unit_of
from harness.config.persona import Persona
from harness.game.arrays import FloatArray
from harness.game.outcome import Outcome
from harness.game.payoff import Payoff, Weighted
from harness.game.payoff_terms import FUZZY_QUANTITIES, TERMS

EXAMPLES: Mapping[str, tuple[str, str, float]] = {
    "collision": ("once", "outcome", float(Outcome.COLLISION)),
    "rail": ("once", "outcome", float(Outcome.RAIL)),
    "speed_over_limit": ("at 10 % over", "speed_over_permitted", 0.1),
    "wrong_way": ("on the wrong side", "wrong_way", 1.0),
    "goal": ("once", "outcome", float(Outcome.GOAL)),
    "timeout": ("once", "outcome", float(Outcome.TIMEOUT)),
    "progress": ("for 100 m", "advanced_m", 100.0),
    "speed_under_limit": ("at 10 % under", "speed_over_permitted", -0.1),
    "lane_offset": ("at 1 m", "lane_offset_m", 1.0),
    "acceleration": ("at 5 m/s²", "acceleration_mps2", 5.0),
    "lateral_acceleration": ("at 3 m/s²", "lateral_acceleration_mps2", 3.0),
    "time_pressure": ("always", "advanced_m", 0.0),
    "on_carriageway": ("on the carriageway", "on_carriageway", 1.0),
    "waiting": ("standing", "stands", 1.0),
}
"""An example for each term without a limit: in words, with the quantity that is not as in a calm moment."""
LIMITED: Mapping[str, str] = {
    "clearance": "clearance_m",
    "vehicle_clearance": "vehicle_clearance_m",
    "time_gap": "time_gap_s",
    "time_to_collision": "time_to_collision_s",
    "yield": "entered_before_s",
    "gap": "gap_s",
}
"""The quantity of each term that counts within a limit. In the example it is half of the limit."""
FROM: Mapping[str, str] = {"red_light": "passed_red_s", "stop_sign": "passed_stop_sign_mps"}
"""The quantity of each term that counts from a limit on. In the example it is at the limit."""
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
    """A fuzzy term as a function of its quantity."""

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
        limit, moment, worth = "", "", np.nan
        if each.parameter is not None:
            unit, word = unit_of(term.parameter), term.parameter.split("_")[0]
            limit = f"{word} {each.parameter:g} {unit}"
            at = each.parameter if each.name in FROM else each.parameter / 2
            moment = f"at {at:g} {unit}"
            worth = _in_a_second(payoff, each, {{**FROM, **LIMITED}[each.name]: at})
        elif each.name in EXAMPLES:
            moment, quantity, value = EXAMPLES[each.name]
            worth = _in_a_second(payoff, each, {quantity: value})
        if term.per_second and moment:
            moment = f"per second {moment}"
        alpha = payoff.alpha[term.group]
        found.append(
            TermExample(
                group=term.group,
                name=each.name,
                alpha=alpha,
                weight=each.weight,
                meaning=term.meaning,
                limit=limit,
                moment=moment,
                worth=worth,
            )
        )
    return found


def payoff_functions(persona: Persona) -> list[PayoffFunction]:
    """Every fuzzy term of a persona's payoff."""
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


def _in_a_second(payoff: Payoff, term: Weighted, quantities: Mapping[str, float]) -> float:
    """The payoff of one term in a step of one second. All quantities but these are those of a calm moment."""

    def array(name: str, calm: float) -> FloatArray:
        return np.array([[quantities.get(name, calm)]])

    far = {name: array(name, np.inf) for name in LIMITED.values()}
    state: Any = SimpleNamespace(
        step=np.array([0]),
        x_m=np.zeros((1, 1)),
        speed_mps=np.zeros((1, 1)),
        outcome=array("outcome", float(Outcome.RUNNING)),
        acceleration_mps2=array("acceleration_mps2", 0.0),
    )
    moment: Any = SimpleNamespace(
        world=SimpleNamespace(step_s=1.0),
        state=state,
        advanced_m=array("advanced_m", 0.0),
        speed_over_permitted=array("speed_over_permitted", 0.0),
        along=SimpleNamespace(wrong_way=array("wrong_way", 0.0)),
        rules=SimpleNamespace(**{name: array(name, -1.0) for name in FROM.values()}),
        on_carriageway=array("on_carriageway", 0.0),
        stands=array("stands", 0.0),
        lane_offset_m=array("lane_offset_m", 0.0),
        lateral_acceleration_mps2=array("lateral_acceleration_mps2", 0.0),
        **far,
    )
    return float(Payoff(alpha=payoff.alpha, terms=(term,), fuzzy={}).evaluate(moment, 0)[term.name][0])
