"""From danger to braking: the reaction time, and the build-up of braking."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from harness.game.arrays import BoolArray, FloatArray

CALM_S = 1.0
"""After this time without danger, the next danger needs the full reaction time again."""


@dataclass(frozen=True, kw_only=True)
class BrakeReaction:
    """Parameters of a driver's reaction to danger."""

    reaction_s: float
    jerk_mps3: float
    coasting_mps2: float = 0.0
    """Deceleration of the car while its driver reacts."""


class ReactionState(NamedTuple):
    """State of the reaction in each game, [N] each."""

    reacted_s: FloatArray
    """Time spent reacting."""
    calm_s: FloatArray
    """Time without danger."""
    braking_mps2: FloatArray
    """Braking built up so far."""


def react(
    state: ReactionState, *, danger: BoolArray, demand_mps2: FloatArray, parameters: BrakeReaction, step_s: float
) -> tuple[ReactionState, BoolArray, FloatArray]:
    """One step of N games: the new state, the games [N] in which the driver still reacts, and the braking [N], 0 in
    games without danger."""
    reacted, calm, braking = state
    reacting = danger & (reacted < parameters.reaction_s - 1e-9)
    acting = danger & ~reacting
    braking = np.where(acting, np.minimum(braking + parameters.jerk_mps3 * step_s, demand_mps2), braking)
    braking = np.where(reacting, np.maximum(braking, parameters.coasting_mps2), braking)
    reacted = np.where(reacting, reacted + step_s, reacted)
    calm = np.where(danger, 0.0, calm + step_s)
    over = calm >= CALM_S - 1e-9
    updated = ReactionState(np.where(over, 0.0, reacted), calm, np.where(over, 0.0, braking))
    return updated, reacting, np.where(danger, braking, 0.0)
