"""Model predictive control with the standard library: plans are drawn around the best one of the draw before, the
bicycle model drives each beside objects that keep their velocity, and the cheapest begins (the cross-entropy method).

It gets the road and the views of docs/egos-in-cartesian.md.
"""

import math
import random

from planning import SPACING_M, pursuit, run

STEPS, STEP_S = 8, 0.4  # of the prediction
DRAWS, PLANS, KEPT = 2, 40, 8
SPREAD = (1.5, 1.5, 0.04)  # of a plan: acceleration in each half of the prediction, steering beside pure pursuit
HARDEST_MPS2, MARGIN_M, CONTACT = 8.0, 0.5, 1000.0


def nearness(me, each, after_s, limits):
    """The cost of an object near the own car, in whose frame it is a box along the axes."""
    x = each["x_m"] + after_s * each["velocity_x_mps"] - me["x_m"]
    y = each["y_m"] + after_s * each["velocity_y_mps"] - me["y_m"]
    cos, sin = math.cos(me["heading_rad"]), math.sin(me["heading_rad"])
    turned = each["heading_rad"] - me["heading_rad"]
    across, along = abs(math.sin(turned)), abs(math.cos(turned))
    ahead = x * cos + y * sin
    gap_m = abs(ahead) - 0.5 * (limits["length_m"] + along * each["length_m"] + across * each["width_m"])
    aside_m = abs(y * cos - x * sin) - 0.5 * (limits["width_m"] + across * each["length_m"] + along * each["width_m"])
    if aside_m > MARGIN_M or gap_m > max(me["speed_mps"], 2.0) or (ahead < 0.0 and gap_m > 0.0):
        return 0.0
    return CONTACT if gap_m < MARGIN_M else 20.0


def cost(plan, view, road, speeds, hello):
    """The cost of a plan: comfort, speed, distance from the route's line, objects, and signals that are not green."""
    line, limits = road["route_line"], hello["limits"]
    me, k = dict(view), min(round(view["station_m"] / SPACING_M), len(line) - 1)
    front_m = 0.5 * limits["length_m"] + MARGIN_M
    stops = [
        signal["station_m"]
        for signal, now in zip(road["signals"], view["signals"], strict=True)
        if now["state"] in ("yellow", "red") and signal["station_m"] > view["station_m"] + 0.5 * limits["length_m"]
    ]
    total = 6.0 * (plan[0] ** 2 + (plan[1] - plan[0]) ** 2) + 300.0 * plan[2] ** 2
    for step in range(STEPS):
        steering = pursuit(me, line, k, limits["wheelbase_m"]) + plan[2]
        me["heading_rad"] += me["speed_mps"] * math.tan(steering) / limits["wheelbase_m"] * STEP_S
        me["speed_mps"] = max(me["speed_mps"] + plan[2 * step // STEPS] * STEP_S, 0.0)
        me["x_m"] += me["speed_mps"] * math.cos(me["heading_rad"]) * STEP_S
        me["y_m"] += me["speed_mps"] * math.sin(me["heading_rad"]) * STEP_S
        at = me["x_m"], me["y_m"]
        while k + 1 < len(line) and math.dist(line[k + 1], at) <= math.dist(line[k], at):
            k += 1
        too_fast_mps = max(me["speed_mps"] - speeds[k] * view["speed_limit_share"], 0.0)
        total += 30.0 * too_fast_mps**2 - 2.0 * me["speed_mps"] + 2.0 * math.dist(line[k], at) ** 2
        total += sum(CONTACT for station_m in stops if k * SPACING_M + front_m > station_m)
        total += sum(nearness(me, each, (step + 1) * STEP_S, limits) for each in view["objects"])
    return total


def decide(view, road, speeds, hello):
    """Acceleration and road wheel angle."""
    drawn, best, spread = random.Random(0), [[0.0, 0.0, 0.0]], SPREAD
    for _ in range(DRAWS):
        mean = [sum(each) / len(best) for each in zip(*best, strict=True)]
        plans = [mean, best[0], [-HARDEST_MPS2, -HARDEST_MPS2, 0.0]]
        plans += [[drawn.gauss(*each) for each in zip(mean, spread, strict=True)] for _ in range(PLANS)]
        best = sorted(plans, key=lambda plan: cost(plan, view, road, speeds, hello))[:KEPT]
        spread = [0.5 * each for each in spread]
    first = min(round(view["station_m"] / SPACING_M), len(road["route_line"]) - 1)
    steering = pursuit(view, road["route_line"], first, hello["limits"]["wheelbase_m"]) + best[0][2]
    return [max(best[0][0], -HARDEST_MPS2), steering]


run(decide)
