"""How SUMO's driver in the place of a person drives in one game, where a search varies it."""

from __future__ import annotations

from dataclasses import dataclass

from harness.game.arrays import FloatArray
from harness.game.follower import TIME_GAPS_S
from harness.game.seeding import between


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
