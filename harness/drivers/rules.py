"""A driver by rules: cruises, keeps its lane, and reacts to danger as its document says.

The reference drivers of UN R157 say only how one reacts to danger. How such a driver cruises and steers is not theirs:
it is the adaptive cruise control and lane keeping of the same document. While a driver reacts, what it did before goes
on: the foot is on its way to the brake.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from harness.config.rule_driver import ReferenceReaction, Rules
from harness.drivers import emergency_braking
from harness.drivers.adaptive_cruise import cruise_mps2
from harness.drivers.car import Car
from harness.drivers.lane_keeping import steering_rad
from harness.drivers.perception import Encounters, OwnMotion, look
from harness.drivers.reaction import Alert, Manner, react
from harness.game.arrays import BoolArray, FloatArray, IntArray

UNKNOWN_LIMIT_MPS = 5.0
"""Who starts from standing has not seen the limit yet, and drives up to this until it has."""


@dataclass
class _Memory:
    """What is remembered of every game, [games] each."""

    reacted_s: FloatArray
    calm_s: FloatArray
    braking_mps2: FloatArray
    limit_mps: FloatArray
    cruising_mps2: FloatArray
    asked_mps2: FloatArray

    @classmethod
    def of(cls, games: int) -> _Memory:
        return cls(*(np.zeros(games) for _ in fields(cls)))


class RulesDriver:
    """Drives one player's car by a document's rules, as many games at once as are asked for."""

    takes_over = True

    def __init__(self, rules: Rules, car: Car) -> None:
        self._rules, self._car = rules, car
        self._memory = _Memory.of(0)
        self._manner = _manner(rules)

    def reset(self, games: IntArray) -> None:
        """Games [N] start anew: nobody is alert, the limit is not known yet."""
        memory, missing = self._memory, int(games.max(initial=-1)) + 1 - len(self._memory.limit_mps)
        for each in fields(memory):
            values = np.pad(getattr(memory, each.name), (0, max(missing, 0)))
            values[games] = UNKNOWN_LIMIT_MPS if each.name == "limit_mps" else 0.0
            setattr(memory, each.name, values)

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        """Actions [N, 2] from observations [N, SIZE]. Decisions do not vary: `noise` is not used."""
        memory, rules, car = self._memory, self._rules, self._car
        view, met = look(car, observation)
        limit = np.where(np.isfinite(view.limit_mps), view.limit_mps, memory.limit_mps[games])
        cruising = cruise_mps2(view, met, limit, memory.cruising_mps2[games], rules.cruise, car.step_s)
        asked = self._react(games, view, met, cruising)
        memory.limit_mps[games], memory.cruising_mps2[games], memory.asked_mps2[games] = limit, cruising, asked
        wheelbase = float(car.actuators.wheelbase_m[0])
        return car.asked(asked, steering_rad(view, rules.lane_keeping, wheelbase, car.step_s), observation)

    def _react(self, games: IntArray, view: OwnMotion, met: Encounters, cruising_mps2: FloatArray) -> FloatArray:
        if self._manner is None:
            return cruising_mps2
        memory = self._memory
        alert = Alert(memory.reacted_s[games], memory.calm_s[games], memory.braking_mps2[games])
        each, demands = self._dangers(view, met, alert)
        demand = np.where(each, demands, 0.0).max(axis=1)
        alert, reacting, braking = react(alert, np.any(each, axis=1), demand, self._manner, self._car.step_s)
        for name, values in alert._asdict().items():
            getattr(memory, name)[games] = values
        going_on = np.minimum(memory.asked_mps2[games], -self._manner.coasting_mps2)
        return np.where(reacting, going_on, np.minimum(cruising_mps2, np.where(braking > 0.0, -braking, np.inf)))

    def _dangers(self, view: OwnMotion, met: Encounters, alert: Alert) -> tuple[BoolArray, FloatArray]:
        rules, own = self._rules, view.speed_mps[:, None]
        began = alert.braking_mps2[:, None]
        if (braking := rules.emergency_braking) is not None:
            return emergency_braking.emergency(met, own, began > braking.warning_braking_mps2, braking)
        if (person := rules.careful_and_competent) is not None:
            return emergency_braking.careful_and_competent(met, own, began > person.coasting_mps2, person)
        if rules.rss is not None:
            return emergency_braking.rss(met, own, rules.rss)
        assert rules.fuzzy is not None, "who has a manner of reacting has one of the four"
        return emergency_braking.fuzzy(met, own, view.acceleration_mps2[:, None], rules.fuzzy)


def _manner(rules: Rules) -> Manner | None:
    """How a driver comes to brake; None: by cruising only."""
    if rules.emergency_braking is not None:
        return Manner(0.0, rules.emergency_braking.build_up_mps3)
    person: ReferenceReaction | None = rules.careful_and_competent or rules.rss or rules.fuzzy
    if person is None:
        return None
    coasting = rules.careful_and_competent.coasting_mps2 if rules.careful_and_competent else 0.0
    return Manner(person.reaction_s, person.jerk_mps3, coasting)
