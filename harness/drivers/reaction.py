"""From danger to braking: the time a reaction takes, and braking that grows no faster than it can."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from harness.game.arrays import BoolArray, FloatArray

CALM_S = 1.0
"""Without danger for so long, the next one comes as a surprise again."""


@dataclass(frozen=True)
class Manner:
    """How a driver comes to brake."""

    reaction_s: float
    jerk_mps3: float
    coasting_mps2: float = 0.0
    """What the car slows by while its driver reacts."""


class Alert(NamedTuple):
    """What is remembered of each game, [N] each."""

    reacted_s: FloatArray
    """Time spent reacting."""
    calm_s: FloatArray
    """Time without danger."""
    braking_mps2: FloatArray
    """How far the braking has grown."""


def react(
    alert: Alert, danger: BoolArray, demand_mps2: FloatArray, manner: Manner, step_s: float
) -> tuple[Alert, BoolArray, FloatArray]:
    """One step of N games: what is remembered now, who still reacts [N], and the braking [N] of who is in danger."""
    reacted, calm, braking = alert
    reacting = danger & (reacted < manner.reaction_s - 1e-9)
    acting = danger & ~reacting
    braking = np.where(acting, np.minimum(braking + manner.jerk_mps3 * step_s, demand_mps2), braking)
    braking = np.where(reacting, np.maximum(braking, manner.coasting_mps2), braking)
    reacted = np.where(reacting, reacted + step_s, reacted)
    calm = np.where(danger, 0.0, calm + step_s)
    over = calm >= CALM_S - 1e-9
    remembered = Alert(np.where(over, 0.0, reacted), calm, np.where(over, 0.0, braking))
    return remembered, reacting, np.where(danger, braking, 0.0)
