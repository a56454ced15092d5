"""A planner of the standard library: the intelligent driver model along the route's line, and pure pursuit of it.

It gets the road and the views of docs/egos-in-cartesian.md.
"""

import math

from planning import SPACING_M, pursuit, run

AHEAD, BEHIND = 120, 240  # points of the route's line that matter: of those behind, for who follows
GRID_S, HORIZON_S = 0.5, 4.0  # of the prediction
MOST_MPS2, HARDEST_MPS2, STANDSTILL_M = 2.0, 8.0, 2.0


def meetings(each, line, first):
    """Where an object is, or will be at its velocity, on the route ahead: distance along it, speed along it."""
    for step in range(int(HORIZON_S / GRID_S)):
        window = range(max(first - (0 if step else BEHIND), 0), min(first + AHEAD, len(line) - 1))
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
    free = (speed / max(speeds[first] * view["speed_limit_share"], 0.1)) ** 4
    leaders = [meeting for each in view["objects"] for meeting in meetings(each, line, first)]
    for signal, now in zip(road["signals"], view["signals"], strict=True):
        if now["state"] in ("yellow", "red") and signal["station_m"] > front_m:
            leaders.append((signal["station_m"], 0.0))
    most = MOST_MPS2 * (1.0 - free)
    for end_m, other in leaders:
        closing = speed * (speed - other) / (2 * math.sqrt(MOST_MPS2 * comfortable))
        wanted_m = STANDSTILL_M + max(speed * parameters["time_gap_s"] + closing, 0.0)
        most = min(most, MOST_MPS2 * (1.0 - free - (wanted_m / max(end_m - front_m, 0.1)) ** 2))
    return [max(most, -HARDEST_MPS2), pursuit(view, line, first, limits["wheelbase_m"])]


run(decide)
