"""The numbers of the rules that name manoeuvres, each with its source. `docs/manoeuvres.md` says what they mean."""

from __future__ import annotations

import math

# --- cut_in: enters the other's way ahead of it, near enough to matter ---

CUT_IN_TIME_GAP_S = 1.5
"""Largest gap over the follower's speed. UN Regulation No. 157 (automated lane keeping, 5.2.3.3): the least time gap
that it lets an automated car keep at 50 km/h, the limit of the paper's road."""
CUT_IN_TTC_S = 4.0
"""Or else: largest time to collision. Van der Horst and Hogema (1993), "Time-to-collision and collision avoidance
systems": 4 s parts drivers who are in danger from those who are in control."""
CUT_IN_LOOK_BACK_S = 1.0
"""Over this time before, the one that moved more towards the other's way is the one that enters it. Our own."""

# --- hard_brake ---

HARD_BRAKE_MPS2 = 4.0
"""Least deceleration. UN Regulation No. 157 (5.5.1): the most that an automated car should brake with when it stops
without an emergency. Near it: 3.4 m/s2, what AASHTO holds to be comfortable, and 0.45 g = 4.4 m/s2, from which on
naturalistic studies count (Simons-Morton et al. 2012, Am. J. Epidemiology 175:1075)."""
HARD_BRAKE_LEAST_S = 0.3
"""Least duration: shorter is a touch of the pedal. Our own."""

# --- swerve ---

SWERVE_MPS2 = 2.0
"""Least lateral acceleration beyond what the curve of the road takes. UN Regulation No. 79 allows an automatic lane
change (ACSF of category C) 1 m/s2 beyond the curve; twice that is no ordinary lane change."""
SWERVE_TURN_RAD = math.radians(3.0)
"""Least angle to the road that the car is turned to by it: steering that only straightens the car is none. Our own:
at 14 m/s it moves sideways at 0.7 m/s then, and leaves a lane of 3.2 m within about a second."""
SWERVE_LEAST_S = 0.2
"""Least duration. Our own."""

# --- drift: sideways with nobody steering ---

DRIFT_M = 0.5
"""Least movement across the lanes. Drivers who attend weave by a standard deviation of about 0.2 m (Verster and Roth
2011, "Standard operation procedures for conducting the on-the-road driving test"): 0.5 m is more than twice that."""
HANDS_OFF_LEAST_S = 2.0
"""Least time of a still wheel, where no lapse is recorded. Klauer et al. 2006 (100-car study, DOT HS 810 594): eyes
off the road for longer than 2 s double the risk of a crash."""
HANDS_OFF_RADPS = math.radians(0.1)
"""A road wheel that turns slower is held still. Our own: of the steering wheel that is 1.5 degrees per second."""
OUT_OF_LANE_M = 0.7
"""Without a recorded lapse the car must also be so far from the centre of the nearest lane: a car of 1.8 m then
touches the edge of a lane of 3.2 m (SUMO's default width)."""

# --- overtake: on the lane that ends ---

OVERTAKE_FROM_M = 2.0
"""How far behind the other's middle its own has been before. Our own: half a car."""

# --- tailgate ---

TAILGATE_TIME_GAP_S = 1.0
"""Largest gap over own speed. UN Regulation No. 157 (5.2.3.3): the shortest it allows at any speed."""
TAILGATE_LEAST_S = 2.0
"""Least duration: the reaction time that a driver is taught to leave, and longer than a merging takes. Our own."""
TAILGATE_SPEED_MPS = 5.0
"""Least own speed: below, cars close up as they queue. Our own."""

# --- forced_stop ---

STANDSTILL_MPS = 2.2
"""Largest speed. Highway Capacity Manual 2010: a vehicle below 5 mi/h is counted as stopped."""
FORCED_FROM_MPS = 5.0
"""How fast it has driven before. Our own."""
FORCED_GAP_M = 10.0
"""Largest gap to who stands in its way. Our own: two cars' lengths."""
FORCED_LANE_END_M = 15.0
"""Or else: largest distance to the end of its lane. Our own: three cars' lengths."""
FORCED_LEAST_S = 0.5
"""Least duration. Our own."""

# --- all ---

SAME_WITHIN_S = 0.5
"""Two of a kind with a shorter pause between them are one. Our own."""
ANSWER_WITHIN_S = 5.0
"""An answer begins at most so long after what it answers has ended. Our own: five times the second that drivers take
to react to the unexpected (Green 2000, "How long does it take to stop?": 1.25 to 1.5 s)."""
AFTERMATH_S = 2.0
"""What the non-ego begins so long after an answer of the ego has ended may still be a part of how that goes on; what
it begins later is a new cause. Our own."""
