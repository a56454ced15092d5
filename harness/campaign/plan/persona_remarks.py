"""Personas that a scene gives nothing to decide, or a reason to crash: remarks of `harness check`, no mistakes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import inf

import numpy as np

from harness.config.persona import Parametrised, Persona
from harness.game.junctions import Control
from harness.game.roles import NON_EGO
from harness.game.world import World


def persona_remarks(personas: Sequence[Persona], world: World, discount: float) -> list[str]:
    """A sentence for each payoff of a non-ego that does not suit the scene. `discount` is gamma of the training."""
    places = range(NON_EGO, len(world.roles))
    ends = any(lane_ends(world, player) for player in places)
    signals = any(meets_signals(world, player) for player in places)
    return [
        f"warning: {persona.name}: {remark}"
        for persona in personas
        for remark in (*_of_lanes(persona, ends), *_of_waiting(persona, signals, world, discount))
    ]


def lane_ends(world: World, player: int) -> bool:
    """Whether a lane on the player's route ends."""
    routes = world.road.routes
    rows = slice(int(routes.first_row[player]), int(routes.last_row[player]))
    return bool(np.isfinite(routes.lane_end_m[rows]).any())


def meets_signals(world: World, player: int) -> bool:
    """Whether a traffic light is on the player's route."""
    lines = world.right_of_way.stop_lines
    return bool((lines.control[lines.player == player] == Control.SIGNAL).any())


def waiting_cost(persona: Persona, world: World, discount: float) -> float:
    """What the player pays for standing until the time limit, discounted to the first second: the sum of a geometric
    series."""
    human = persona.human
    per_second = human.weight * sum(_weight(human.terms.get(name, 0.0)) for name in ("time_pressure", "waiting"))
    counted = world.steps if discount == 1.0 else (1.0 - discount**world.steps) / (1.0 - discount)
    return per_second * world.step_s * counted


def crash_cost(persona: Persona) -> float:
    """The least that the player pays for a collision or for touching a rail."""
    return persona.safety.weight * min(_weight(persona.safety.terms.get(name, 0.0)) for name in ("collision", "rail"))


def _of_lanes(persona: Persona, ends: bool) -> Iterator[str]:
    if ends:
        return
    for term in persona.human.fuzzy:
        if term.quantity == "lane_end_m" and (value := float(term.function(np.array([inf]))[0])) != 0.0:
            yield (
                f"{term.name} asks how far the lane goes on, and no lane of its route ends: it is {value:g} per second "
                "everywhere. Choose a persona that has something to decide in this scene"
            )


def _of_waiting(persona: Persona, signals: bool, world: World, discount: float) -> Iterator[str]:
    waiting, crash = waiting_cost(persona, world, discount), crash_cost(persona)
    if signals and waiting > crash:
        yield (
            f"a crash costs {crash:g}, and a long wait at a red light {waiting:.3g} (discounted by {discount:g} a "
            "step): the person may prefer the crash. Raise collision and rail, or lower time_pressure"
        )


def _weight(value: float | Parametrised) -> float:
    return value.weight if isinstance(value, Parametrised) else value
