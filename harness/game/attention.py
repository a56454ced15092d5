"""Lapses of attention, missing blind-spot checks, and all human factors of a driver in one record.

During a lapse of attention the driver's actions are omitted and the car drifts. Paper, section 4.3.2: the distracted
driver "omits atomic actions from the RL model during random intervals", of about 5 s each. This is the time that
reading a text message takes (NHTSA).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.human_limits import (
    ALL_NOTICED,
    EXACT_SIGHT,
    FULL_SHARES,
    NO_DELAY,
    ActuatorShares,
    LookedButFailedToSee,
    Reaction,
    Sight,
)
from harness.game.jit import compiled
from harness.game.seeding import between


@dataclass(frozen=True, kw_only=True)
class Attention:
    """When attention lapses, and what the car does in a lapse.

    The time between lapses is exponentially distributed. A lapse lasts for a time drawn uniformly from `lapse_s`.
    During a lapse, pedals and wheel are released and the road steers: the crown of the road turns the wheel to the
    right, and bumps add an angle that is drawn for each lapse from a normal distribution.
    """

    mean_attentive_s: float
    lapse_s: tuple[float, float]
    crown_rad: float = 0.0
    bumps_rad: float = 0.0


@dataclass(frozen=True, kw_only=True)
class NoBlindSpotCheck:
    """A driver who does not always check the mirrors and the blind spot.

    In `share` of the games the driver sees only road users with a centre at least `ahead_m` ahead of its own.
    """

    share: float = 0.0
    ahead_m: float = 0.0


@dataclass(frozen=True, kw_only=True)
class HumanFactors:
    """The human factors of a driver: lapses of attention (None: no lapses), perception and the limits of the body."""

    attention: Attention | None = None
    no_blind_spot_check: NoBlindSpotCheck = NoBlindSpotCheck()
    looked_but_failed_to_see: LookedButFailedToSee = ALL_NOTICED
    reaction: Reaction = NO_DELAY
    sight: Sight = EXACT_SIGHT
    actuator_shares: ActuatorShares = FULL_SHARES

    @property
    def with_open_eyes(self) -> HumanFactors:
        """The same factors with every blind-spot check done and no failure to see."""
        return replace(self, no_blind_spot_check=NoBlindSpotCheck(), looked_but_failed_to_see=ALL_NOTICED)


@dataclass(frozen=True)
class Lapses:
    """The lapses of one player in a game of T steps, drawn before the game starts."""

    lapsed: BoolArray  # [T]
    steering_rad: FloatArray  # [T] steering angle that the road gives the wheel in a lapse

    @classmethod
    def none(cls, steps: int) -> Lapses:
        """No lapse in a game of `steps` steps."""
        return cls(np.zeros(steps, dtype=bool), np.zeros(steps))

    def with_reaction_delay(self, delay_steps: int) -> Lapses:
        """The same lapses, each longer by the steps that the first decision after it takes to reach the car."""
        steps = np.arange(len(self.lapsed))
        last = np.maximum.accumulate(np.where(self.lapsed, steps, -1 - len(steps)))
        released = steps - last <= delay_steps
        return Lapses(released, np.where(released, self.steering_rad[np.maximum(last, 0)], 0.0))


def draw_lapses(attention: Attention, steps: int, step_s: float, generator: np.random.Generator) -> Lapses:
    """Draw the lapses of one player for a game of `steps` steps of `step_s` seconds.

    Lapses also occur before the game. The probability that a game starts within a lapse is therefore the long-run
    share of time in lapses (stationary start of a renewal process).
    """
    lapses = Lapses.none(steps)
    mean_lapse_s = 0.5 * (attention.lapse_s[0] + attention.lapse_s[1])
    starts_within = generator.random() < mean_lapse_s / (mean_lapse_s + attention.mean_attentive_s)
    elapsed_share = generator.random() if starts_within else 0.0  # part of the first lapse before the game
    time_s = 0.0 if starts_within else generator.exponential(attention.mean_attentive_s)
    attentive_from = 0
    while time_s < steps * step_s:
        duration_s = between(attention.lapse_s, generator.random()) * (1.0 - elapsed_share)
        steering_rad = generator.normal(-attention.crown_rad, attention.bumps_rad)
        first = max(ceil(time_s / step_s), attentive_from)
        end = first + max(round(duration_s / step_s), 1)
        lapses.lapsed[first:end], lapses.steering_rad[first:end] = True, steering_rad
        attentive_from = end + 1  # one attentive step keeps two lapses apart
        time_s += duration_s + generator.exponential(attention.mean_attentive_s)
        elapsed_share = 0.0
    return lapses


@compiled
def release_controls(
    requested: tuple[FloatArray, FloatArray], lapses: tuple[BoolArray, FloatArray], step: IntArray, drove: BoolArray
) -> BoolArray:
    """Release pedals and wheel of the players whose attention lapses in this step.

    The requested accelerations and steering angles [G, P] are changed in place: no acceleration, and the steering angle
    of the road. `lapses` are the lapses of the games and the steering angle in them [G, P, T], step [G] the current
    steps, drove [G, P] the players that still drive. Returns [G, P]: the players with a lapse.
    """
    (acceleration_mps2, steering_rad), (lapsed, lapsed_steering_rad) = requested, lapses
    inattentive = np.zeros(drove.shape, dtype=np.bool_)
    for g, p in np.ndindex(drove.shape):
        if drove[g, p] and lapsed[g, p, step[g]]:
            inattentive[g, p] = True
            acceleration_mps2[g, p], steering_rad[g, p] = 0.0, lapsed_steering_rad[g, p, step[g]]
    return inattentive


def unseen_behind_m(no_blind_spot_check: NoBlindSpotCheck, draw: float) -> float:
    """Least distance ahead of a player at which it sees road users in one game; -inf: it sees them all around.

    `draw` is a number drawn uniformly from 0 to 1.
    """
    return no_blind_spot_check.ahead_m if draw < no_blind_spot_check.share else -np.inf
