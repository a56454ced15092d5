"""A ROS 2 node as the ego: a bridge between the harness and ROS 2 topics, in lock step.

    python3 bridge.py COMMAND...

It speaks the protocol of docs/egos-by-programs.md with the harness, and starts COMMAND, which starts the node, once for
each game that is played at the same time, each in a ROS domain of its own on this machine alone. For each decision it
publishes the state, and waits for the command that has the stamp of this state. docs/egos-by-ros2.md has the topics.
"""

import json
import os
import shlex
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import traceback
from contextlib import suppress
from pathlib import Path

import rclpy
from geometry_msgs.msg import PolygonStamped, TwistStamped
from nav_msgs.msg import Odometry
from nav_msgs.msg import Path as Route
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.utilities import get_rmw_implementation_identifier
from rosgraph_msgs.msg import Clock
from visualization_msgs.msg import MarkerArray

HERE = Path(__file__).resolve().parent
sys.path.append(str(HERE.parent / "cartesian"))

import messages  # noqa: E402

DOMAINS = range(101, 0, -1)  # up to 101 the ports of a domain are none that Linux gives to others
GAME_NS = 1000 * messages.NS  # each game starts at a later full thousand of seconds
COMMAND = "geometry_msgs/msg/TwistStamped"
AGAIN_S = 1.0  # a node that has just started may miss a message


class Problem(Exception):
    """The game can't go on, for the reason in the message."""


def reserved_domain():
    """A ROS domain that no other bridge of this machine uses, and the socket that reserves it while it is open."""
    for number in DOMAINS:
        reservation = socket.socket(socket.AF_UNIX)
        with suppress(OSError):
            reservation.bind(f"\0harness-ros2-domain-{number}")  # a name that the kernel frees with the process
            return number, reservation
        reservation.close()
    raise Problem(f"all {len(DOMAINS)} ROS domains are in use: play fewer games at the same time")


def on_this_machine():
    """The variables that keep ROS 2 on this machine, and its files in the temporary folder, which is removed at the
    end. Fast DDS would leave shared memory behind when it is killed: it gets the loopback interface alone."""
    fast = get_rmw_implementation_identifier().startswith("rmw_fastrtps")
    return {
        "ROS_LOG_DIR": tempfile.gettempdir(),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "SYSTEM_DEFAULT" if fast else "LOCALHOST",
        **({"FASTDDS_DEFAULT_PROFILES_FILE": str(HERE / "loopback.xml")} if fast else {}),
    }


class Seat:
    """A node, and the topics over which it drives the car of one game at a time."""

    def __init__(self, command, hello):
        self.command, self.limits, self.step_s = command, hello["limits"], hello["step_s"]
        domain, reservation = reserved_domain()
        self.context = Context()
        rclpy.init(context=self.context, domain_id=domain, signal_handler_options=rclpy.SignalHandlerOptions.NO)
        self.node = rclpy.create_node("harness", context=self.context, enable_rosout=False)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        kept = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        kinds = {"road": MarkerArray, "footprint": PolygonStamped, "route": Route}
        self.topics = {name: self.node.create_publisher(kind, name, kept) for name, kind in kinds.items()}
        kinds = {"/clock": Clock, "objects": MarkerArray, "odom": Odometry}
        self.topics |= {name: self.node.create_publisher(kind, name, 10) for name, kind in kinds.items()}
        self.subscription = self.node.create_subscription(TwistStamped, "cmd_vel", self.receive, 10)
        self.received, self.met = None, False  # the last command; whether one came in time
        self.start_ns = self.now_ns = 0  # ROS time of the start of the game, and of its last decision
        self.told_road, self.is_new, self.shown = False, True, {}
        # The node ends with the bridge, and the domain is reserved until both have ended.
        prefix = ["setpriv", "--pdeathsig", "KILL"] if shutil.which("setpriv") else []
        variables = os.environ | {"ROS_DOMAIN_ID": str(domain)}
        options = {"stdin": subprocess.DEVNULL, "env": variables, "pass_fds": [reservation.fileno()]}
        self.process = subprocess.Popen([*prefix, *command], **options)
        reservation.close()

    def receive(self, command):
        self.received = command

    def spin(self, until):
        """Receive for a moment. False once it is `until`. Raises Problem if the node has ended."""
        self.executor.spin_once(timeout_sec=min(max(until - time.monotonic(), 0.0), 0.1))
        if (code := self.process.poll()) is not None:
            how = f"was killed by {signal.Signals(-code).name}" if code < 0 else f"ended with exit code {code}"
            raise Problem(f"the node {how}: {shlex.join(self.command)}")
        return time.monotonic() < until

    def wait_for_node(self, within_s):
        """Wait until a node subscribes to the odometry and publishes commands."""
        until, started = time.monotonic() + within_s, shlex.join(self.command)
        while not (self.subscription.get_publisher_count() and self.topics["odom"].get_subscription_count()):
            for end in self.node.get_publishers_info_by_topic("/cmd_vel"):
                if end.topic_type != COMMAND:
                    raise Problem(f"a node publishes /cmd_vel as {end.topic_type}, not {COMMAND}: {started}")
            if not self.spin(until):
                what = f"that subscribes to /odom (nav_msgs/msg/Odometry) and publishes /cmd_vel ({COMMAND})"
                raise Problem(f"within {within_s:g} s no node came {what}: {started}")

    def reset(self):
        self.is_new = True

    def show(self, view, road, times):
        """Publish the state, and at the start of a game the route."""
        if self.is_new:
            self.start_ns = (self.now_ns // GAME_NS + 1) * GAME_NS
        self.now_ns = self.start_ns + round(view["time_s"] * 1e6) * 1000
        self.shown = {"/clock": Clock(clock=messages.header(self.now_ns).stamp)}
        if not self.told_road:
            self.shown |= {"road": messages.lines(road), "footprint": messages.footprint(self.limits)}
        if self.is_new:
            self.shown["route"] = messages.route(road["route_line"], times, view["speed_limit_share"], self.start_ns)
        self.shown["objects"] = messages.objects(view, road, self.limits, self.now_ns)
        self.shown["odom"] = messages.odometry(view, self.limits, self.now_ns)
        self.told_road, self.is_new = True, False
        self.publish()

    def publish(self):
        for name, message in self.shown.items():
            self.topics[name].publish(message)

    def decide(self, view, within_s):
        """The decision of the node for the state that was published."""
        until, stamp = time.monotonic() + within_s, messages.header(self.now_ns).stamp
        again = time.monotonic() + AGAIN_S
        while self.received is None or self.received.header.stamp != stamp:
            if not self.spin(until):
                raise Problem(f"no command within {within_s:g} s {self.missed(stamp)}")
            if not self.met and time.monotonic() > again:
                self.publish()
                again = time.monotonic() + AGAIN_S
        self.met = True
        if (others := self.subscription.get_publisher_count()) > 1:
            raise Problem(f"{others} publishers of /cmd_vel: there must be one")
        return messages.decision(self.received.twist, view, self.limits, self.step_s)

    def missed(self, stamp):
        last = self.received and self.received.header.stamp
        was = f"the last one has the stamp {last.sec}.{last.nanosec:09d}" if last else "there was none before"
        return f"on /cmd_vel with the stamp {stamp.sec}.{stamp.nanosec:09d}, that of /odom; {was}"

    def close(self):
        self.process.terminate()
        try:
            self.process.wait(5.0)
        except subprocess.TimeoutExpired:
            self.process.kill()


class Bridge:
    """The answers to the harness's messages."""

    def __init__(self, command):
        self.command, self.seats = command, {}
        self.hello = self.road = self.times = None

    def answer(self, message):
        match message["type"]:
            case "hello":
                self.hello = message
                return {"protocol": 2}
            case "reset":
                self.reset(message["games"])
            case "road":
                self.road, self.times = message["road"], messages.travel_times(message["road"])
            case "decide":
                return {"actions": self.decide(message["games"], message["views"])}
        return {}

    def reset(self, games):
        new = [game for game in games if game not in self.seats]
        self.seats |= {game: Seat(self.command, self.hello) for game in new}
        for game in new:
            self.seats[game].wait_for_node(self.hello["parameters"]["node_within_s"])
        for game in games:
            self.seats[game].reset()

    def decide(self, games, views):
        for game, view in zip(games, views, strict=True):
            self.seats[game].show(view, self.road, self.times)
        within_s = self.hello["parameters"]["command_within_s"]
        return [self.seats[game].decide(view, within_s) for game, view in zip(games, views, strict=True)]

    def close(self):
        for seat in self.seats.values():
            seat.close()


def main():
    answers = os.fdopen(os.dup(1), "w")  # standard output is the protocol's: what ROS and the nodes print is not
    os.dup2(2, 1)
    os.environ |= on_this_machine()
    bridge = Bridge(sys.argv[1:])
    for text in sys.stdin:
        try:
            answer = bridge.answer(json.loads(text))
        except Problem as problem:
            answer = {"error": str(problem)}
        except Exception as error:
            traceback.print_exc()
            answer = {"error": f"{type(error).__name__}: {error}"}
        print(json.dumps(answer), file=answers, flush=True)
    bridge.close()


main()
