"""Seeded sample drives of a persona: lapses of attention and missing shoulder glances, drawn as in the game."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from harness.config.persona import Persona
from harness.config.road_user import Actuators
from harness.game.human_factors import glances_over_shoulder
from harness.game.lapses import Attention, Lapses, draw_lapses
from harness.game.seeding import generator_of

DRIVES, DRIVE_S, STEP_S = 8, 60.0, 0.1
DRIFT_SPEED_MPS = 50.0 / 3.6
WHEELBASE_M = float(Actuators.model_fields["wheelbase_m"].default)


@dataclass(frozen=True, kw_only=True)
class SampleDrive:
    lapses: tuple[tuple[float, float], ...]
    """Begin and end of each lapse, s."""
    shoulder_glance: bool
    """Whether the person glances over the shoulder in this drive."""

    @property
    def lapsed_share(self) -> float:
        return sum(end - begin for begin, end in self.lapses) / DRIVE_S


def sample(persona: Persona) -> list[SampleDrive]:
    """`DRIVES` drives, the same for equal personas."""
    human_factors, steps = persona.human_factors, round(DRIVE_S / STEP_S)
    drives = []
    for k in range(DRIVES):
        lapses = Lapses.none(steps)
        if human_factors.attention is not None:
            lapses = draw_lapses(
                human_factors.attention, steps, STEP_S, generator_of("portrait", persona.name, "attention", k)
            )
        draw = generator_of("portrait", persona.name, "start", k).random()
        changes = np.flatnonzero(np.diff(np.concatenate(([0], lapses.lapsed.astype(int), [0])))).reshape(-1, 2) * STEP_S
        spans = tuple((float(begin), float(end)) for begin, end in changes)
        glance = glances_over_shoulder(human_factors.sight, draw)
        drives.append(SampleDrive(lapses=spans, shoulder_glance=glance))
    return drives


def lapsed_share(attention: Attention) -> float:
    """Share of the time in lapses of attention, in the long run.

    Lapses and attentive stretches alternate, so it is mean lapse / (mean lapse + mean attentive stretch): the share
    of time of an alternating renewal process (Ross, Introduction to Probability Models, section 7.5).
    """
    return attention.mean_lapse_s / (attention.mean_lapse_s + attention.mean_attentive_s)


def lapses_per_minute(attention: Attention) -> float:
    """Lapses per minute, in the long run: one in each mean lapse + mean attentive stretch."""
    return 60.0 / (attention.mean_lapse_s + attention.mean_attentive_s)


def free_share(attention: Attention) -> float:
    """Share of the drives of `DRIVE_S` without a lapse.

    Such a drive starts attentive (1 - lapsed share), and its first lapse, exponentially distributed, begins after its
    end: (1 - lapsed share) exp(-drive / mean attentive stretch).
    """
    return (1.0 - lapsed_share(attention)) * math.exp(-DRIVE_S / attention.mean_attentive_s)


def drift_m(steering_rad: float, lapse_s: float) -> float:
    """Lateral displacement of an uncontrolled car in a lapse, on a straight road, wheel at an angle; m, positive: left.

    The kinematic bicycle of harness.game.bicycle at small angles: its slip angle is half the steering angle, and it
    turns by v tan(angle) / wheelbase per second, so v t tan(angle) / 2 + v² t² tan(angle) / (2 wheelbase).
    """
    way, turn = DRIFT_SPEED_MPS * lapse_s, math.tan(steering_rad)
    return way * turn / 2.0 + way**2 * turn / (2.0 * WHEELBASE_M)
