"""The vehicle that follows the ego in a share of the games. SUMO drives it; each game draws its driver here.

Without a vehicle behind it, an ego brakes as hard as it likes at no cost.
"""

from __future__ import annotations

from dataclasses import dataclass

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
