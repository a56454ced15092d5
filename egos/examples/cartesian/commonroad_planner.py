"""CommonRoad's reactive planner as the ego: it samples trajectories along a reference path and drives the cheapest.

It gets the road and the views of docs/egos-in-cartesian.md. The route's line is the reference path, and the rails are
the edge of the road. Objects, and the stop lines of signals that are yellow or red, are obstacles that keep their
velocity; objects that follow the car in its lane are left out. Each step is planned anew from where the car is, and the
car follows the beginning of the plan. In a step without a plan, because all samples collide or none can be driven, the
car brakes firmly along the route's line.
"""

import contextlib
import math
import sys
from itertools import pairwise

import numpy as np
from commonroad.geometry.shape import Rectangle
from commonroad.prediction.prediction import TrajectoryPrediction
from commonroad.scenario.obstacle import DynamicObstacle, ObstacleType
from commonroad.scenario.scenario import Scenario
from commonroad.scenario.state import InitialState, KSState
from commonroad.scenario.trajectory import Trajectory
from commonroad_clcs.pycrccosy import CartesianProjectionDomainError
from commonroad_dc import pycrcc
from commonroad_rp.reactive_planner import ReactivePlanner
from commonroad_rp.state import ReactivePlannerState
from commonroad_rp.utility.config import ReactivePlannerConfiguration
from commonroad_rp.utility.utils_coordinate_system import create_coordinate_system
from planning import SPACING_M, pursuit, run

STEPS, STEP_S = 20, 0.2  # of a plan
AHEAD_S = 1.5  # the planner reaches a lower speed late: it gets that of the route so much later
STANDS_MPS = 0.05  # the planner takes it for standing
BEYOND_M = 100.0  # the reference path goes on at both ends of the route: plans end on it
MARGIN_M, HARDEST_MPS2 = 0.3, 8.0  # around obstacles; braking without a plan


def planner_on(road, hello):
    """The planner with the road's reference path, and the edge of the road."""
    limits, parameters = hello["limits"], ReactivePlannerConfiguration()
    car, sampling = parameters.vehicle, parameters.sampling
    car.length, car.width = limits["length_m"], limits["width_m"]
    car.wb_front_axle = car.wb_rear_axle = 0.5 * limits["wheelbase_m"]  # from the centre of the body
    car.wheelbase = limits["wheelbase_m"]
    car.a_max, car.v_switch = limits["max_braking_mps2"], limits["max_speed_mps"]
    car.delta_max, car.v_delta_max = limits["max_steering_rad"], limits["max_steering_rate_radps"]
    car.delta_min, car.v_delta_min = -car.delta_max, -car.v_delta_max
    parameters.planning.dt, parameters.planning.time_steps_computation = STEP_S, STEPS
    lane_m = min(road["lanes"][name]["width_m"] for name in road["route_lanes"])
    sampling.d_max = max(0.5 * (lane_m - car.width), 0.1)  # it stays in its lane
    sampling.d_min, sampling.pos_init_samples, sampling.num_sampling_levels = -sampling.d_max, 2, 3  # few: 0.1 s a step
    parameters.debug.multiproc, parameters.debug.logging_level = False, "ERROR"
    parameters.update(scenario=Scenario(STEP_S))
    planner = ReactivePlanner(parameters)
    line = np.array(road["route_line"])
    ends = [line[0] + BEYOND_M * (line[0] - line[4]) / math.dist(line[0], line[4])]
    ends += [line[-1] + BEYOND_M * (line[-1] - line[-5]) / math.dist(line[-1], line[-5])]
    before, behind = (np.linspace(end, at, int(BEYOND_M))[:-1] for end, at in zip(ends, line[[0, -1]], strict=True))
    path = create_coordinate_system(np.vstack([before, line, behind[::-1]]))
    edge = pycrcc.ShapeGroup()
    for (ax, ay), (bx, by) in (each for rail in road["rails"] for each in pairwise(rail)):
        length, heading = math.hypot(bx - ax, by - ay), math.atan2(by - ay, bx - ax)
        edge.add_shape(pycrcc.RectOBB(0.5 * length, 0.01, heading, 0.5 * (ax + bx), 0.5 * (ay + by)))
    return planner, path, edge


def obstacle(number, each):
    """An object, with a margin around it, as an obstacle that keeps its velocity."""
    at, velocity = np.array([each["x_m"], each["y_m"]]), np.array([each["velocity_x_mps"], each["velocity_y_mps"]])
    heading, speed = each["heading_rad"], math.hypot(*velocity)
    shape = Rectangle(each["length_m"] + 2 * MARGIN_M, each["width_m"] + 2 * MARGIN_M)
    later = [KSState(k, at + k * STEP_S * velocity, 0.0, speed, heading) for k in range(1, STEPS + 1)]
    prediction = TrajectoryPrediction(Trajectory(1, later), shape)
    return DynamicObstacle(number, ObstacleType.CAR, shape, InitialState(0, at, heading, speed), prediction)


def follows(each, at_m, path, half_lane_m):
    """Whether an object is behind the car in its lane."""
    try:
        station_m, aside_m = path.convert_to_curvilinear_coords(each["x_m"], each["y_m"])
    except CartesianProjectionDomainError:  # it is too far from the path
        return False
    return station_m < at_m and abs(aside_m) < half_lane_m


def stop_lines(view, road, front_m):
    """The stop lines before the car that it may not cross now, as standing objects across its lane."""
    for signal, now in zip(road["signals"], view["signals"], strict=True):
        if now["state"] in ("yellow", "red") and signal["station_m"] > front_m:
            k = min(round(signal["station_m"] / SPACING_M), len(road["route_line"]) - 2)
            (ax, ay), (bx, by) = road["route_line"][k : k + 2]
            pose = {"x_m": ax, "y_m": ay, "heading_rad": math.atan2(by - ay, bx - ax)}
            yield pose | {"length_m": 0.1, "width_m": 3.0, "velocity_x_mps": 0.0, "velocity_y_mps": 0.0}


class Adapter:
    """Between the messages of the harness and the planner, which it makes for the road of the first decision."""

    made = None

    def __call__(self, view, road, speeds, hello):
        """Acceleration and road wheel angle."""
        with contextlib.redirect_stdout(sys.stderr):  # the planner prints, and standard output is the protocol's
            self.made = self.made or planner_on(road, hello)
            plan = self.plan(view, road, speeds, hello["limits"])
        if plan is None:
            first = min(round(view["station_m"] / SPACING_M), len(speeds) - 1)
            return [-HARDEST_MPS2, pursuit(view, road["route_line"], first, hello["limits"]["wheelbase_m"])]
        soon = plan[0].state_list[1]
        return [(soon.velocity - view["speed_mps"]) / STEP_S, soon.steering_angle]

    def plan(self, view, road, speeds, limits):
        """The planner's trajectory from here, or None."""
        planner, path, edge = self.made
        heading, speed, wheelbase = view["heading_rad"], view["speed_mps"], limits["wheelbase_m"]
        at = np.array([view["x_m"], view["y_m"]])
        rear = at - 0.5 * wheelbase * np.array([math.cos(heading), math.sin(heading)])
        start = ReactivePlannerState(0, rear, view["steering_rad"], speed, heading)
        start.acceleration = max(view["acceleration_mps2"], -speed / STEP_S)  # a car that stops does not roll back
        start.yaw_rate = speed * math.tan(view["steering_rad"]) / wheelbase
        at_m, _ = path.convert_to_curvilinear_coords(*at)
        half_lane_m = 0.5 * limits["width_m"] + planner.config.sampling.d_max
        objects = [each for each in view["objects"] if not follows(each, at_m, path, half_lane_m)]
        objects += stop_lines(view, road, view["station_m"] + 0.5 * limits["length_m"])
        scenario = Scenario(STEP_S)
        scenario.add_objects([obstacle(number, each) for number, each in enumerate(objects, start=1)])
        planner.set_collision_checker(scenario, road_boundary_obstacle=edge)
        checker = planner.collision_checker
        planner.reset(initial_state_cart=start, collision_checker=checker, coordinate_system=path)
        first = min(round(view["station_m"] / SPACING_M), len(speeds) - 1)
        wanted = min(speeds[first : first + round(AHEAD_S * speed / SPACING_M) + 1]) * view["speed_limit_share"]
        planner.set_desired_velocity(wanted)
        planner.set_v_sampling_parameters(0.0, wanted)
        try:
            return planner.plan()
        except TypeError:  # of a message of release 2025.1 where the car stands and no sample can be driven
            if speed > STANDS_MPS:
                raise
            return None


run(Adapter())
