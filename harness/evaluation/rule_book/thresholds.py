"""The numbers of the rules, each with its source. `docs/manoeuvres.md` describes the rules."""

from __future__ import annotations

import math

CUT_IN_TIME_GAP_S = 1.5
"""Largest gap over the follower's speed. UN Regulation No. 157 (automated lane keeping, 5.2.3.3): the least time gap
of an automated car at 50 km/h, the speed limit of the paper's road."""
CUT_IN_TTC_S = 4.0
"""Alternatively: largest time to collision. Van der Horst and Hogema (1993), "Time-to-collision and collision avoidance
systems": 4 s separates drivers in danger from drivers in control."""
CROSSES_RAD = math.radians(60.0)
"""A body at a larger angle to the other crosses its way, at a smaller one it cuts in. Our own."""
ONCOMING_RAD = math.radians(120.0)
"""A body at a larger angle comes towards the other. Our own."""
HALF_LANE_M = 1.6
"""From the centre of a lane to its mark, where no other lane is nearer, as inside a junction: SUMO's default lane has
3.2 m."""
LANE_CHANGE_M = 1.0
"""The centre of a driver's lane that moves by more than this in a step is that of another lane: it changes lanes. Our
own."""
HARD_BRAKE_MPS2 = 4.0
"""Least deceleration. UN Regulation No. 157 (5.5.1): the largest deceleration of an automated car that stops
without an emergency. Similar numbers: 90 % of drivers brake harder than 3.4 m/s2 for what they do not expect
(AASHTO), and 0.45 g = 4.4 m/s2, the threshold of naturalistic studies (Simons-Morton et al. 2012, Am. J. Epidemiology
175:1075)."""
HARD_BRAKE_LEAST_S = 0.3
"""Least duration: a shorter one is a touch of the pedal. Our own."""
SWERVE_MPS2 = 2.0
"""Least lateral acceleration beyond that of the road's curve. UN Regulation No. 79 allows an automatic lane change
(ACSF of category C) 1 m/s2 beyond the curve; twice that is more than an ordinary lane change."""
SWERVE_TURN_RAD = math.radians(3.0)
"""Least angle between car and road that results: steering that only straightens the car is not a swerve. Our own: at
14 m/s the car then moves sideways at 0.7 m/s, and leaves a lane of 3.2 m within about a second."""
SWERVE_LEAST_S = 0.2
"""Least duration. Our own."""
DRIFT_M = 0.5
"""Least movement across the lanes without steering. Attentive drivers weave by a standard deviation of about 0.2 m
(Verster and Roth 2011, "Standard operation procedures for conducting the on-the-road driving test"): 0.5 m is more than
twice that."""
HANDS_OFF_LEAST_S = 2.0
"""Least time of a still wheel without a recorded lapse. Klauer et al. 2006 (100-car study, DOT HS 810 594): eyes
off the road for longer than 2 s double the risk of a crash."""
HANDS_OFF_RADPS = math.radians(0.1)
"""A road wheel that turns slower than this is still. Our own: it is 1.5 degrees per second of the steering wheel."""
OUT_OF_LANE_M = 0.7
"""Without a recorded lapse the car must also be this far from the centre of the nearest lane: a car of 1.8 m then
touches the edge of a lane of 3.2 m (SUMO's default width)."""
OVERTAKE_FROM_M = 2.0
"""On a lane that ends, the player's centre was at least this far behind the other's before. Our own: half a car."""
TAILGATE_TIME_GAP_S = 1.0
"""Largest gap over own speed. UN Regulation No. 157 (5.2.3.3): the shortest time gap at any speed."""
TAILGATE_LEAST_S = 2.0
"""Least duration: the time gap that drivers are taught to keep, and longer than merging takes. Our own."""
TAILGATE_SPEED_MPS = 5.0
"""Least own speed: slower cars close up in a queue. Our own."""
STANDSTILL_MPS = 2.2
"""Largest speed. Highway Capacity Manual 2010: a vehicle below 5 mi/h counts as stopped."""
FORCED_FROM_MPS = 5.0
"""Least speed at some earlier time. Our own."""
FORCED_GAP_M = 10.0
"""Largest gap to the leader. Our own: two car lengths."""
FORCED_LANE_END_M = 15.0
"""Alternatively: largest distance to the end of the lane. Our own: three car lengths."""
FORCED_LEAST_S = 0.5
"""Least duration. Our own."""
FAILS_TO_YIELD_S = 3.0
"""Largest gap, from the player's entry into the other's way until the other would be there. A car needs about a second
to pass, and interactions with more than 2 s between the passages are normal (Varhelyi 1998, "Drivers' speed behaviour
at a zebra crossing"). One driver in two accepts 6.5 s (Fitzpatrick 1991, Transportation Research Record 1303)."""
TURNS_ACROSS_S = 4.1
"""Largest gap. Highway Capacity Manual 2010: the critical headway of a left turn from a major road."""
STOPPED_MPS = 0.5
"""At a stop sign, a car that is not slower has not stopped. Our own: half of a walking pace."""
STOPS_WITHIN_M = 5.0
"""A stop counts in front of the line by at most this. Our own: one car, which may wait at the line already."""
WRONG_WAY_LEAST_S = 1.0
"""Least duration: shorter ones are corners cut. Our own."""
SAME_WITHIN_S = 0.5
"""Two manoeuvres of one kind with at most this pause between them are one. Our own."""

# --- causes of failures ---

SINCE_S = 5.0
"""What a road user did longer than this before the end is not its cause. Our own: five times the second in which
drivers react to the unexpected (Green 2000, "How long does it take to stop?": 1.25 to 1.5 s)."""
DANGER_TTC_S = CUT_IN_TTC_S
"""Danger begins at this time to collision where no body enters a lane."""
BRAKES_MPS2 = 2.0
"""Least deceleration that counts as braking. Our own: a car that coasts decelerates less."""
STANDS_MPS = STOPPED_MPS
"""A slower road user stands."""
BEFORE_S = 1.0
"""A reaction may begin this long before the other enters the lane: the ego sees it come. Our own."""
SEEN_M = 120.0
"""The ego does not observe road users farther away."""
