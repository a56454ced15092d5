"""ROS 2 nodes that are written for a test, and the bridge that they drive by."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from harness.drivers.car import Car
from harness.drivers.process import PlanningProcess
from harness.game.arrays import FloatArray
from harness.game.cartesian_view import CartesianView
from harness.game.observation_layout import SIZE
from tests.support.repository import REPOSITORY

EXAMPLE = REPOSITORY / "egos" / "examples" / "ros2"
GAMES, SEEN, NOISE = np.array([0]), np.zeros((1, SIZE), dtype=np.float32), np.zeros((1, 2))
NODE = """
import json, os, sys, time
import rclpy
from geometry_msgs.msg import PolygonStamped, Twist, TwistStamped
from nav_msgs.msg import Odometry, Path
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosgraph_msgs.msg import Clock
from visualization_msgs.msg import MarkerArray

rclpy.init()
node = rclpy.create_node("node")
kept = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
commands = node.create_publisher({kind}, "cmd_vel", 10)
count, first, other = 0, None, None


def plain(message):
    if hasattr(message, "get_fields_and_field_types"):
        return {{name: plain(getattr(message, name)) for name in message.get_fields_and_field_types()}}
    values = message.tolist() if hasattr(message, "tolist") else message
    return [plain(each) for each in values] if isinstance(values, (list, tuple)) else values


def write(topic, message):
    with open("received.jsonl", "a") as file:
        file.write(json.dumps([topic, plain(message)]) + chr(10))


def drive(odom):
    global count, first, other
    write("odom", odom)
    count, first = count + 1, first or odom.header
    command = TwistStamped(header=odom.header)
    command.twist.linear.x, command.twist.angular.z = odom.twist.twist.linear.x + 0.1, 0.2
    {change}
    commands.publish(command)


for topic, kind in {{"footprint": PolygonStamped, "route": Path, "road": MarkerArray}}.items():
    node.create_subscription(kind, topic, lambda message, topic=topic: write(topic, message), kept)
for topic, kind in {{"/clock": Clock, "objects": MarkerArray}}.items():
    node.create_subscription(kind, topic, lambda message, topic=topic: write(topic, message), 10)
node.create_subscription(Odometry, "odom", drive, 10)
open("node.json", "w").write(json.dumps([os.getpid(), os.environ["ROS_DOMAIN_ID"]]))
rclpy.spin(node)
"""


def bridge(folder: Path, car: Car, *command: str, node_within_s: float, command_within_s: float) -> PlanningProcess:
    """A bridge that starts the node by a command, in a folder."""
    parameters = {"node_within_s": node_within_s, "command_within_s": command_within_s}
    program = ["python3", str(EXAMPLE / "bridge.py"), *command]
    options: dict[str, Any] = {"units": "si", "deadline_s": 120.0, "start_deadline_s": 120.0, "parameters": parameters}
    return PlanningProcess(program, folder, car, history_s=0.0, **options)


class Driven:
    """A bridge with a node that writes down what it receives, and commands a bit more speed and a yaw rate."""

    def __init__(self, folder: Path, car: Car, change: str, kind: str, within_s: float) -> None:
        """`change` is the node's code before it publishes a command; `kind` is the type of its commands."""
        folder.mkdir()
        (folder / "node.py").write_text(NODE.format(change=change, kind=kind))
        self._folder = folder
        limits = {"node_within_s": 60.0, "command_within_s": within_s}
        self._process = bridge(folder, car, "python3", "node.py", **limits)

    def reset(self) -> None:
        self._process.reset(GAMES)

    def decide(self, view: CartesianView) -> FloatArray:
        """The actions [1, 2]."""
        self._process.see(GAMES, [view])
        return self._process.decide(GAMES, SEEN, NOISE)

    def close(self) -> None:
        self._process.close()

    def received(self, topic: str) -> list[Any]:
        """What the node received on a topic."""
        lines = (self._folder / "received.jsonl").read_text().splitlines()
        return [message for name, message in map(json.loads, lines) if name == topic]

    def process_and_domain(self) -> tuple[int, str]:
        """The process id of the node, and its ROS domain."""
        pid, domain = json.loads((self._folder / "node.json").read_text())
        return pid, domain
