"""Vehicles that SUMO drives with parameters of one game: the one that follows the ego in a share of the games, and the
one in the place of a person where a search varies how it drives.

Without a vehicle behind it, an ego brakes as hard as it likes at no cost.
"""

from __future__ import annotations

from dataclasses import dataclass

from harness.game.arrays import FloatArray
from harness.game.seeding import between, generator_of

FOLLOWER = "follower"
"""Its name among the road users of a game."""
TIME_GAPS_S = (1.0, 2.0)
"""Range of the time gap: headways in the rush hour on US-101 are 1 to 2 s, and seldom shorter."""
REACTIONS_S = (1.25, 1.5)
"""Range of the longest reaction: 1.25 s to the brake lights of the car ahead, 1.5 s if surprised (Green 2000)."""
ROOM_M = 2.5
"""The gap that it keeps at rest: the minGap of SUMO's cars."""


@dataclass(frozen=True, kw_only=True)
class Follower:
    """The driver that follows the ego in one game."""

    time_gap_s: float
    """SUMO's `tau`."""
    reaction_s: float
    """SUMO's `actionStepLength`, the time between two decisions: a reaction takes between none and all of it."""

    def gap_m(self, speed_mps: float) -> float:
        """The gap to the ego, bumper to bumper, at which it follows at this speed."""
        return ROOM_M + speed_mps * self.time_gap_s


def draw_follower(share: float, *parts: str | int) -> Follower | None:
    """Draw who follows the ego, from a generator of its own: nobody in 1 - `share` of the games."""
    if not share:
        return None
    followed, time_gap, reaction = generator_of(*parts, "follower").random(3).tolist()
    if followed >= share:
        return None
    return Follower(time_gap_s=between(TIME_GAPS_S, time_gap), reaction_s=between(REACTIONS_S, reaction))


@dataclass(frozen=True, kw_only=True)
class OrdinaryDriver:
    """Parameters of SUMO's models of following, lane changing and junctions."""

    speed_factor: float
    """Desired speed, as a share of the limit."""
    time_gap_s: float
    """SUMO's `tau`."""
    assertive: float
    """SUMO's `lcAssertive`: the gaps that a lane change requires are divided by it."""
    impatience: float
    """SUMO's `impatience`: the willingness to make road users with priority brake."""


SPEED_FACTORS = (0.8, 1.2)
"""Two standard deviations of SUMO's default distribution, normc(1, 0.1)."""
ASSERTIVE = (1.0, 2.0)
"""From SUMO's default to half of the required gaps. Chosen here."""
IMPATIENCE = (0.0, 1.0)
"""All that SUMO has."""
RANGES = (SPEED_FACTORS, TIME_GAPS_S, ASSERTIVE, IMPATIENCE)


def ordinary_driver_at(shares: FloatArray) -> OrdinaryDriver:
    """The driver at a point [len(RANGES)] of the unit cube, whose edges are the `RANGES`."""
    speed_factor, time_gap_s, assertive, impatience = map(between, RANGES, shares.tolist())
    return OrdinaryDriver(speed_factor=speed_factor, time_gap_s=time_gap_s, assertive=assertive, impatience=impatience)
