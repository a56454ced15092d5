"""A planner of the standard library: the intelligent driver model along the route's line, and pure pursuit of it.

It gets the road and the views of docs/egos-in-cartesian.md.
"""

import json
import math
import sys
from itertools import pairwise

SPACING_M, AHEAD, BEHIND = 0.5, 120, 40  # of the points of the route's line; how many of them matter
GRID_S, HORIZON_S = 0.5, 4.0  # of the prediction
MOST_MPS2, HARDEST_MPS2, STANDSTILL_M = 2.0, 8.0, 2.0


def distance(point, line):
    """The distance of a point to a polyline."""
    (x, y), distances = point, []
    for (ax, ay), (bx, by) in pairwise(line):
        length = math.hypot(bx - ax, by - ay) or 1.0
        share = min(max(((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length**2, 0.0), 1.0)
        distances.append(math.hypot(ax + share * (bx - ax) - x, ay + share * (by - ay) - y))
    return min(distances)


def speeds_on(road, comfortable):
    """The speed at each point of the route's line: the limit of its lane, and what is comfortable in the bend there."""
    line, lanes, speeds = road["route_line"], [road["lanes"][name] for name in road["route_lanes"]], []
    headings = [math.atan2(by - ay, bx - ax) for (ax, ay), (bx, by) in pairwise(line)]
    for k, point in enumerate(line):
        limit = min(lanes, key=lambda lane: distance(point, lane["line"]))["speed_limit_mps"]
        turned = math.remainder(headings[min(k + 3, len(headings) - 1)] - headings[max(k - 3, 0)], math.tau)
        speeds.append(min(limit, math.sqrt(comfortable * 6 * SPACING_M / max(abs(turned), 1e-6))))
    return speeds


def meetings(each, line, first):
    """Where an object is, or will be at its velocity, on the route ahead: distance along it, speed along it."""
    window = range(max(first - BEHIND, 0), min(first + AHEAD, len(line) - 1))
    for step in range(int(HORIZON_S / GRID_S)):
        x = each["x_m"] + step * GRID_S * each["velocity_x_mps"]
        y = each["y_m"] + step * GRID_S * each["velocity_y_mps"]
        k = min(window, key=lambda k: math.hypot(line[k][0] - x, line[k][1] - y))
        (ax, ay), (bx, by) = line[k], line[k + 1]
        if math.hypot(ax - x, ay - y) < 1.2 + 0.5 * each["width_m"]:
            if k > first:
                along = (each["velocity_x_mps"] * (bx - ax) + each["velocity_y_mps"] * (by - ay)) / SPACING_M
                yield k * SPACING_M - 0.5 * each["length_m"], max(along, 0.0)
            elif step == 0:
                return  # it follows


def decide(view, road, speeds, hello):
    """Acceleration and road wheel angle."""
    line, speed, limits, parameters = road["route_line"], view["speed_mps"], hello["limits"], hello["parameters"]
    comfortable, front_m = parameters["comfortable_mps2"], view["station_m"] + 0.5 * limits["length_m"]
    first = min(max(round(view["station_m"] / SPACING_M), 0), len(line) - 2)
    braked = [math.sqrt(v**2 + 2 * comfortable * k * SPACING_M) for k, v in enumerate(speeds[first : first + AHEAD])]
    free = (speed / max(min(braked) * view["speed_limit_share"], 0.1)) ** 4
    leaders = [meeting for each in view["objects"] for meeting in meetings(each, line, first)]
    for signal, now in zip(road["signals"], view["signals"], strict=True):
        if now["state"] in ("yellow", "red") and signal["station_m"] > front_m:
            leaders.append((signal["station_m"], 0.0))
    most = MOST_MPS2 * (1.0 - free)
    for end_m, other in leaders:
        closing = speed * (speed - other) / (2 * math.sqrt(MOST_MPS2 * comfortable))
        wanted_m = STANDSTILL_M + max(speed * parameters["time_gap_s"] + closing, 0.0)
        most = min(most, MOST_MPS2 * (1.0 - free - (wanted_m / max(end_m - front_m, 0.1)) ** 2))
    wheelbase, heading = limits["wheelbase_m"], view["heading_rad"]
    x, y = line[min(first + round((1.5 + 0.3 * speed) / SPACING_M), len(line) - 1)]
    x -= view["x_m"] - 0.5 * wheelbase * math.cos(heading)  # from the rear axle
    y -= view["y_m"] - 0.5 * wheelbase * math.sin(heading)
    steering = math.atan2(2 * wheelbase * math.sin(math.atan2(y, x) - heading), math.hypot(x, y))
    return [max(most, -HARDEST_MPS2), steering]


hello = road = speeds = None
for text in sys.stdin:
    message, answer = json.loads(text), {}
    if message["type"] == "hello":
        hello, answer = message, {"protocol": 2}
    elif message["type"] == "road":
        road = message["road"]
        speeds = speeds_on(road, hello["parameters"]["comfortable_mps2"])
    elif message["type"] == "decide":
        answer = {"actions": [decide(view, road, speeds, hello) for view in message["views"]]}
    print(json.dumps(answer), flush=True)
