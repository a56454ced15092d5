"""What both planners share: the protocol, the speeds of the route, and where it is aimed at."""

import json
import math
import sys
import traceback
from itertools import pairwise

SPACING_M = 0.5  # of the points of the route's line


def distance(point, line):
    """The distance of a point to a polyline."""
    (x, y), distances = point, []
    for (ax, ay), (bx, by) in pairwise(line):
        length = math.hypot(bx - ax, by - ay) or 1.0
        share = min(max(((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length**2, 0.0), 1.0)
        distances.append(math.hypot(ax + share * (bx - ax) - x, ay + share * (by - ay) - y))
    return min(distances)


def speeds_on(road, comfortable):
    """The speed at each point of the route's line: the limit of its lane, what is comfortable in the bend there, and
    what can be braked from comfortably to that of the points ahead."""
    line, lanes, speeds = road["route_line"], [road["lanes"][name] for name in road["route_lanes"]], []
    headings = [math.atan2(by - ay, bx - ax) for (ax, ay), (bx, by) in pairwise(line)]
    for k, point in enumerate(line):
        limit = min(lanes, key=lambda lane: distance(point, lane["line"]))["speed_limit_mps"]
        turned = math.remainder(headings[min(k + 3, len(headings) - 1)] - headings[max(k - 3, 0)], math.tau)
        speeds.append(min(limit, math.sqrt(comfortable * 6 * SPACING_M / max(abs(turned), 1e-6))))
    for k in reversed(range(len(line) - 1)):
        speeds[k] = min(speeds[k], math.sqrt(speeds[k + 1] ** 2 + 2 * comfortable * SPACING_M))
    return speeds


def pursuit(view, line, first, wheelbase):
    """The road wheel angle of pure pursuit of the route's line."""
    heading = view["heading_rad"]
    x, y = line[min(first + round((1.5 + 0.3 * view["speed_mps"]) / SPACING_M), len(line) - 1)]
    x -= view["x_m"] - 0.5 * wheelbase * math.cos(heading)  # from the rear axle
    y -= view["y_m"] - 0.5 * wheelbase * math.sin(heading)
    return math.atan2(2 * wheelbase * math.sin(math.atan2(y, x) - heading), math.hypot(x, y))


def run(decide):
    """Answer the harness: `decide(view, road, speeds, hello)` gives an acceleration and a road wheel angle."""
    hello = road = speeds = None
    for text in sys.stdin:
        message, answer = json.loads(text), {}
        if message["type"] == "hello":
            hello, answer = message, {"protocol": 2}
        elif message["type"] == "road":
            road = message["road"]
            speeds = speeds_on(road, hello["parameters"]["comfortable_mps2"])
        elif message["type"] == "decide":
            try:
                answer = {"actions": [decide(view, road, speeds, hello) for view in message["views"]]}
            except Exception as error:
                traceback.print_exc()
                answer = {"error": f"{type(error).__name__}: {error}"}
        print(json.dumps(answer), flush=True)
