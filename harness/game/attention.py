"""Lapses of attention: while one lasts, a driver's actions are omitted and the car drifts.

The paper (section 4.3.2): the distracted driver "omits atomic actions from the RL model during random intervals",
about 5 s each, as reading a text message takes (NHTSA).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from harness.game.arrays import BoolArray, FloatArray


@dataclass(frozen=True)
class Attention:
    """How a person attends. A lapse begins after an exponentially distributed time of attention, and lasts for
    a time drawn uniformly; in it the pedals are released, the wheel stays where it was, and road crown and bumps
    turn it by an angle drawn per lapse from a normal distribution."""

    mean_attentive_s: float
    lapse_s: tuple[float, float]
    drift_rad: float


@dataclass(frozen=True)
class Lapses:
    """One player's lapses over a game of T steps, drawn before it starts."""

    lapsed: BoolArray  # [T]
    drift_rad: FloatArray  # [T] added to the steering angle the lapse began with


def draw_lapses(attention: Attention | None, steps: int, step_s: float, generator: np.random.Generator) -> Lapses:
    """Draw when one player's attention lapses in a game of `steps` steps. None: never.

    The time since the last lapse before the game is unknown, so the first waiting time is exponential as well.
    """
    lapsed = np.zeros(steps, dtype=bool)
    drift = np.zeros(steps)
    if attention is not None:
        time, attentive_from = 0.0, 0
        while True:
            time += generator.exponential(attention.mean_attentive_s)
            lasts = generator.uniform(*attention.lapse_s)
            drifts = generator.normal(0.0, attention.drift_rad)
            first = max(int(np.ceil(time / step_s)), attentive_from)
            if first >= steps:
                break
            end = first + max(round(lasts / step_s), 1)
            lapsed[first:end], drift[first:end] = True, drifts
            attentive_from = end + 1  # a glance at the road, or two lapses were one
            time += lasts
    return Lapses(lapsed, drift)
