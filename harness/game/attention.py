"""How a person attends to the road: lapses of attention, and what is overlooked.

While a lapse lasts, a driver's actions are omitted and the car drifts. The paper (section 4.3.2): the distracted
driver "omits atomic actions from the RL model during random intervals", about 5 s each, as reading a text message
takes (NHTSA).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.human_limits import ALL, AT_ONCE, EXACT, NOBODY, LookedButFailedToSee, Reaction, Sight, Uses
from harness.game.jit import compiled
from harness.game.seeding import between


@dataclass(frozen=True)
class Attention:
    """When attention lapses. A lapse begins after an exponentially distributed time of attention, and lasts for a time
    drawn uniformly; in it pedals and wheel are let go, and the road steers: its crown to the right, and bumps by an
    angle drawn per lapse from a normal distribution."""

    mean_attentive_s: float
    lapse_s: tuple[float, float]
    crown_rad: float = 0.0
    bumps_rad: float = 0.0


@dataclass(frozen=True)
class NoBlindSpotCheck:
    """A driver who does not always look into the mirrors and over the shoulder: in `share` of the drives, others whose
    centre is not at least `ahead_m` ahead of the driver's own are not seen."""

    share: float = 0.0
    ahead_m: float = 0.0


@dataclass(frozen=True)
class HumanFactors:
    """How a person attends: when attention lapses (None: never), who is overlooked or missed; and the body's limits."""

    attention: Attention | None = None
    no_blind_spot_check: NoBlindSpotCheck = NoBlindSpotCheck()
    looked_but_failed_to_see: LookedButFailedToSee = NOBODY
    reaction: Reaction = AT_ONCE
    sight: Sight = EXACT
    uses: Uses = ALL

    @property
    def with_open_eyes(self) -> HumanFactors:
        """The same person who overlooks and misses nobody."""
        return replace(self, no_blind_spot_check=NoBlindSpotCheck(), looked_but_failed_to_see=LookedButFailedToSee())


@dataclass(frozen=True)
class Lapses:
    """One player's lapses over a game of T steps, drawn before it starts."""

    lapsed: BoolArray  # [T]
    steering_rad: FloatArray  # [T] the angle that the road turns the wheel to in a lapse

    @classmethod
    def none(cls, steps: int) -> Lapses:
        """Attention all the time."""
        return cls(np.zeros(steps, dtype=bool), np.zeros(steps))

    def until_hands_obey(self, delay_steps: int) -> Lapses:
        """The same lapses, each with the steps that the first decision after it takes to reach pedals and wheel."""
        steps = np.arange(len(self.lapsed))
        last = np.maximum.accumulate(np.where(self.lapsed, steps, -1 - len(steps)))
        release_controls = steps - last <= delay_steps
        return Lapses(release_controls, np.where(release_controls, self.steering_rad[np.maximum(last, 0)], 0.0))


def draw_lapses(attention: Attention, steps: int, step_s: float, generator: np.random.Generator) -> Lapses:
    """Draw when one player's attention lapses in a game of `steps` steps.

    Who drives up to the scene has been lapsing before: a game starts within a lapse as often as lapses take time (the
    stationary start of a renewal process).
    """
    lapses = Lapses.none(steps)
    mean_lapse_s = 0.5 * (attention.lapse_s[0] + attention.lapse_s[1])
    starts_within = generator.random() < mean_lapse_s / (mean_lapse_s + attention.mean_attentive_s)
    passed = generator.random() if starts_within else 0.0  # share of the first lapse that is over
    time = 0.0 if starts_within else generator.exponential(attention.mean_attentive_s)
    attentive_from = 0
    while time < steps * step_s:
        lasts = between(attention.lapse_s, generator.random()) * (1.0 - passed)
        turns = generator.normal(-attention.crown_rad, attention.bumps_rad)
        first = max(ceil(time / step_s), attentive_from)
        end = first + max(round(lasts / step_s), 1)
        lapses.lapsed[first:end], lapses.steering_rad[first:end] = True, turns
        attentive_from = end + 1  # a glance at the road, or two lapses were one
        time += lasts + generator.exponential(attention.mean_attentive_s)
        passed = 0.0
    return lapses


@compiled
def release_controls(
    acceleration_mps2: FloatArray,
    steering_rad: FloatArray,
    lapsed: BoolArray,
    lapsed_steering_rad: FloatArray,
    step: IntArray,
    drove: BoolArray,
) -> BoolArray:
    """[G, P] whose attention is elsewhere in this step [G] of those who drove, by the lapses [G, P, T] of their games.
    In place: they let go of the pedals, and the road turns the wheel."""
    elsewhere = np.zeros(drove.shape, dtype=np.bool_)
    for g, p in np.ndindex(drove.shape):
        if drove[g, p] and lapsed[g, p, step[g]]:
            elsewhere[g, p] = True
            acceleration_mps2[g, p], steering_rad[g, p] = 0.0, lapsed_steering_rad[g, p, step[g]]
    return elsewhere


def unseen_behind_m(neglect: NoBlindSpotCheck, luck: float) -> float:
    """How far ahead of a player others must be to be seen by it in one game, by a number drawn from 0 to 1; -inf:
    anywhere."""
    return neglect.ahead_m if luck < neglect.share else -np.inf
