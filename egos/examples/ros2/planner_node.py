"""A ROS 2 node that drives by the topics of docs/egos-by-ros2.md: a template for your own.

It follows the route by pure pursuit, and by the intelligent driver model what is, or will be, on the route ahead.
"""

import math
from contextlib import suppress

import numpy as np
import rclpy
from geometry_msgs.msg import PolygonStamped, TwistStamped
from nav_msgs.msg import Odometry, Path
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from visualization_msgs.msg import Marker, MarkerArray

MOST_MPS2, HARDEST_MPS2, STANDSTILL_M, MARGIN_M = 2.0, 8.0, 2.0, 0.3
HORIZON_S = np.arange(0.0, 4.0, 0.5)  # of the prediction of objects, at their velocity


class Planner(Node):
    def __init__(self):
        super().__init__("planner")
        defaults = {"time_gap_s": 1.5, "comfortable_mps2": 1.5, "step_s": 0.1}
        self.declare_parameters("", list(defaults.items()))
        self.time_gap_s, self.comfortable_mps2, self.step_s = (self.get_parameter(name).value for name in defaults)
        self.came = {}  # the last message of each topic
        kept = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        topics = [("footprint", PolygonStamped, kept), ("route", Path, kept)]
        for topic, kind, qos in [*topics, ("objects", MarkerArray, 10), ("odom", Odometry, 10)]:
            self.create_subscription(kind, topic, lambda message, topic=topic: self.receive(topic, message), qos)
        self.commands = self.create_publisher(TwistStamped, "cmd_vel", 10)

    def receive(self, topic, message):
        """Decide once everything of a moment is here: a game starts at a full thousand of seconds, with its route."""
        self.came[topic] = message
        if topic == "route":
            self.begin(message)
        if len(self.came) == 4:
            now = self.came["odom"].header.stamp
            same_game = now.sec // 1000 == self.came["route"].header.stamp.sec // 1000
            if same_game and self.came["objects"].markers[0].header.stamp == now:
                command = TwistStamped(header=self.came["odom"].header)
                command.twist.linear.x, command.twist.angular.z = self.decide(self.came.pop("odom"))
                self.commands.publish(command)

    def begin(self, route):
        """A new game: the line, the stations of its points, and their speeds, from which it can be braked for bends."""
        self.line = np.array([(each.pose.position.x, each.pose.position.y) for each in route.poses])
        ways = np.diff(self.line, axis=0)
        lengths, headings = np.hypot(*ways.T), np.unwrap(np.arctan2(*ways.T[::-1]))
        self.stations, self.directions = np.append(0.0, np.cumsum(lengths)), ways / lengths[:, None]
        stamps = [(each.header.stamp.sec, each.header.stamp.nanosec) for each in route.poses]
        times = np.diff(stamps, axis=0) @ (1.0, 1e-9)  # by the speed limits; s
        smooth = np.convolve(np.pad(headings, 3, mode="edge"), np.ones(7) / 7, mode="valid")
        bends = np.abs(np.gradient(smooth, self.stations[:-1]))  # 1/m
        self.speeds = np.minimum(lengths / times, np.sqrt(self.comfortable_mps2 / np.maximum(bends, 1e-6)))
        for k in range(len(self.speeds) - 2, -1, -1):
            reachable = math.sqrt(self.speeds[k + 1] ** 2 + 2 * self.comfortable_mps2 * lengths[k])
            self.speeds[k] = min(self.speeds[k], reachable)
        self.at = None  # the point of the line where the car is

    def decide(self, odom):
        """Speed after the step, and yaw rate."""
        at, turn, speed = odom.pose.pose.position, odom.pose.pose.orientation, odom.twist.twist.linear.x
        here, heading = np.array([at.x, at.y]), 2 * math.atan2(turn.z, turn.w)
        first, last = (0, len(self.line)) if self.at is None else (max(self.at - 10, 0), self.at + 60)
        self.at = first + int(np.argmin(np.hypot(*(self.line[first:last] - here).T)))
        corners = np.array([(each.x, each.y) for each in self.came["footprint"].polygon.points])
        front_m, half_m = self.stations[self.at] + corners[:, 0].max(), corners[:, 1].max()
        free = (speed / max(self.speeds[min(self.at, len(self.speeds) - 1)], 0.1)) ** 4
        most = MOST_MPS2 * (1 - free)
        for end_m, other in self.leaders(half_m):
            closing = speed * (speed - other) / (2 * math.sqrt(MOST_MPS2 * self.comfortable_mps2))
            wanted_m = STANDSTILL_M + max(speed * self.time_gap_s + closing, 0.0)
            most = min(most, MOST_MPS2 * (1 - free - (wanted_m / max(end_m - front_m, 0.1)) ** 2))
        after = max(speed + max(most, -HARDEST_MPS2) * self.step_s, 0.0)
        aim = self.stations[self.at] + 3.0 + 0.3 * speed
        x, y = self.line[min(int(np.searchsorted(self.stations, aim)), len(self.line) - 1)] - here
        curvature = 2 * math.sin(math.atan2(y, x) - heading) / math.hypot(x, y)
        return after, after * curvature

    def leaders(self, half_m):
        """Where each object is, or will be, on the route ahead: the station of its end, its speed along the route."""
        markers = self.came["objects"].markers
        arrows = {each.id: np.array([(p.x, p.y) for p in each.points]) for each in markers if each.ns == "velocity"}
        for each in markers:
            if each.type == Marker.CUBE and each.action == Marker.ADD:
                start = np.array([each.pose.position.x, each.pose.position.y])
                velocity = np.zeros(2) if each.ns == "stop_line" else np.diff(arrows[each.id], axis=0)[0]
                for time_s in HORIZON_S:
                    gaps = np.hypot(*(self.line[:-1] - start - time_s * velocity).T)
                    k = int(np.argmin(gaps))
                    if gaps[k] < half_m + MARGIN_M + 0.5 * each.scale.y:
                        if k > self.at:
                            yield self.stations[k] - 0.5 * each.scale.x, max(velocity @ self.directions[k], 0.0)
                        elif time_s == 0.0:
                            break  # it follows


rclpy.init()
with suppress(KeyboardInterrupt, ExternalShutdownException):
    rclpy.spin(Planner())
