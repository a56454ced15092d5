"""Remarks of `harness check`, no mistakes: personas that a scene gives nothing to decide, or a reason to crash, and
human limits that an ego does not have."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import inf

import numpy as np

from harness.config.persona import Parametrised, Persona
from harness.game.roles import NON_EGO
from harness.game.world import World

_AT_STANDSTILL = {"speed_over_limit": -1.0, "speed_mps": 0.0}  # quantities of fuzzy terms


def persona_remarks(personas: Sequence[Persona], world: World, discount: float) -> list[str]:
    """A sentence for each payoff of a non-ego that does not suit the scene. `discount` is gamma of the training."""
    routes = world.road.routes
    rows = zip(routes.first_row[NON_EGO:], routes.last_row[NON_EGO:], strict=True)
    a_lane_ends = any(np.isfinite(routes.lane_end_m[first:last]).any() for first, last in rows)
    remarks = []
    for persona in personas:
        found = [] if a_lane_ends else [*_of_lanes(persona)]
        waiting, crash = waiting_cost(persona, world, discount), crash_cost(persona)
        if waiting > crash:
            found.append(
                f"a crash costs {crash:g}, and standing for long behind somebody {waiting:.3g} (discounted by "
                f"{discount:g} a step): the person may prefer the crash. Raise collision and rail, or lower "
                "time_pressure"
            )
        remarks += [f"warning: {persona.name}: {each}" for each in found]
    return remarks


def ego_persona_remarks(persona: Persona) -> list[str]:
    """A sentence on the human limits that the ego's persona names: the ego is a machine and has none."""
    named = sorted(persona.model_fields_set & {"attention", "perception", "reaction", "actuators"})
    if not named:
        return []
    tables = " and ".join(f"[{name}]" for name in named)
    return [f"warning: ego.persona: {persona.name} has {tables}, without effect: the ego takes the payoff alone"]


def waiting_cost(persona: Persona, world: World, discount: float) -> float:
    """What the player pays for standing until the time limit where it could drive, discounted to the first second: the
    sum of a geometric series."""
    human, operational = persona.human, persona.operational
    per_second = human.weight * sum(_weight(human.terms.get(name, 0.0)) for name in ("time_pressure", "waiting"))
    per_second += operational.weight * _weight(operational.terms.get("speed_under_limit", 0.0))
    for term in human.fuzzy:
        if term.quantity in _AT_STANDSTILL:
            value = float(term.function(np.array([_AT_STANDSTILL[term.quantity]]))[0])
            per_second -= human.weight * term.weight * value
    counted = world.steps if discount == 1.0 else (1.0 - discount**world.steps) / (1.0 - discount)
    return per_second * world.step_s * counted


def crash_cost(persona: Persona) -> float:
    """The least that the player pays for a collision or for touching a rail."""
    return persona.safety.weight * min(_weight(persona.safety.terms.get(name, 0.0)) for name in ("collision", "rail"))


def _of_lanes(persona: Persona) -> Iterator[str]:
    for term in persona.human.fuzzy:
        if term.quantity == "lane_end_m" and (value := float(term.function(np.array([inf]))[0])) != 0.0:
            yield (
                f"{term.name} asks how far the lane goes on, and no lane of its route ends: it is {value:g} per second "
                "everywhere. Choose a persona that has something to decide in this scene"
            )


def _weight(value: float | Parametrised) -> float:
    return value.weight if isinstance(value, Parametrised) else value
