"""The numbers of the rules that find causes, each with its source."""

from __future__ import annotations

import math

SINCE_S = 5.0
"""What a road user did longer than this before the contact is not its cause. As `ANSWER_WITHIN_S` of the manoeuvres."""
DANGER_TTC_S = 4.0
"""Danger begins at this time to collision where no body crosses a lane mark. Van der Horst and Hogema (1993),
"Time-to-collision and collision avoidance systems"."""
CROSSES_RAD = math.radians(60.0)
"""A road user at a larger angle to the ego crosses its way, at a smaller one it cuts in. As `CUT_IN_TURNED_RAD`."""
ONCOMING_RAD = math.radians(120.0)
"""A road user at a larger angle comes towards the ego. Our own."""
BRAKES_MPS2 = 2.0
"""Least deceleration that counts as braking. Our own: a car that coasts decelerates less."""
SWERVES_MPS2 = 2.0
"""Least lateral acceleration, to either side, that counts as steering away. As `SWERVE_MPS2`."""
SWERVES_RAD = math.radians(3.0)
"""It must also turn the ego by this out of the direction of its route. As `SWERVE_TURN_RAD`."""
STANDS_MPS = 0.5
"""A slower road user stands. Our own: half of a walking pace."""
BEFORE_S = 1.0
"""A reaction may begin this long before the lane mark is crossed: the ego sees the other come. Our own."""
SEEN_M = 120.0
"""The ego does not observe road users farther away."""
