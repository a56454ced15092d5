"""Reference drivers: the yardsticks by which a failure counts as preventable (docs/preventability.md).

The upper bound is no driver that exists: none reacts sooner or brakes harder. It bounds what braking can do for a road
user ahead. Where ways cross, a driver who brakes less may pass before the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np

from harness.config.rule_driver import CarefulAndCompetent, Cruise, FuzzySafety, Rss, Rules
from harness.drivers.car import Car, car_of
from harness.drivers.rules_driver import RulesDriver
from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.roles import EGO
from harness.game.world import World

PERSONS = ("careful_and_competent", "fuzzy", "rss")
"""The reference drivers with a reaction time."""
UPPER_BOUND = "upper_bound"
REFERENCES = (*PERSONS, UPPER_BOUND)
"""All reference drivers, by name."""

_DESCRIPTION = "A reference driver, which judges whether a failure could have been prevented."
_USUAL_LANE_M = (2.0, 5.0)


def reference_driver(name: str, world: World) -> ReferenceDriver:
    """A reference driver of `REFERENCES` for the ego of a world."""
    car, lane_width_m = car_of(world, EGO), lane_width_of(world)
    if name == UPPER_BOUND:
        return StrongestBraking(car, [RulesDriver(reference_rules(each, lane_width_m), car) for each in PERSONS])
    return RulesDriver(reference_rules(name, lane_width_m), car)


def reference_rules(name: str, lane_width_m: float) -> Rules:
    """The rules of a reference driver of `PERSONS`, with the parameters of its source."""
    reactions = {
        "careful_and_competent": CarefulAndCompetent(lane_width_m=lane_width_m),
        "fuzzy": FuzzySafety(),
        "rss": Rss(),
    }
    return _rules(name).model_copy(update={name: reactions[name]})


def reference_identity() -> dict[str, Any]:
    """Everything that the decisions of the reference drivers depend on, but for the car and the road."""
    usual_m = CarefulAndCompetent().lane_width_m
    return {name: reference_rules(name, usual_m).model_dump(mode="json") for name in PERSONS}


def lane_width_of(world: World) -> float:
    """The usual width of the lanes of the ego's road: the distance between the centres of neighbouring lanes. The
    default of the careful and competent driver where the road has one lane."""
    routes = world.road.routes
    rows = slice(int(routes.first_row[EGO]), int(routes.last_row[EGO]) + 1)
    apart_m = np.diff(np.sort(routes.lane_offset_m[rows], axis=1), axis=1)
    apart_m = apart_m[np.isfinite(apart_m)]
    if not len(apart_m):
        return CarefulAndCompetent().lane_width_m
    return float(np.clip(np.median(apart_m), *_USUAL_LANE_M))


class StrongestBraking:
    """Cruises and keeps its lane; brakes fully in every step in which one of several drivers' rules says danger."""

    takes_over = True

    def __init__(self, car: Car, rules: Sequence[RulesDriver]) -> None:
        self._rules, self._cruising = rules, RulesDriver(_rules("cruising"), car)

    def reset(self, games: IntArray) -> None:
        """Reset games [N]: the cruise control requests no acceleration."""
        self._cruising.reset(games)

    def sees_danger(self, observation: FloatArray) -> BoolArray:
        """[N] whether one of the rules says danger."""
        return np.logical_or.reduce([each.sees_danger(observation) for each in self._rules])

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        """Actions [N, 2] from observations [N, SIZE]. The motion clips full braking to what tyres and brakes give."""
        actions = self._cruising.decide(games, observation, noise)
        actions[self.sees_danger(observation), 0] = -1.0
        return actions


ReferenceDriver: TypeAlias = RulesDriver | StrongestBraking
"""A driver with a rule that says danger."""


class FullBraking(StrongestBraking):
    """Keeps its lane and brakes as hard as tyres and brakes allow, until the car stands."""

    def __init__(self, world: World) -> None:
        super().__init__(car_of(world, EGO), [])

    def sees_danger(self, observation: FloatArray) -> BoolArray:
        """[N] true: it brakes in every step."""
        return np.ones(len(observation), dtype=bool)


def _rules(name: str) -> Rules:
    return Rules(kind="rules", name=name, description=_DESCRIPTION, cruise=Cruise(anticipates_s=0.0))
