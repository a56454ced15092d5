"""The bridge to ROS 2: what a node gets, what its commands mean, and what happens if it does not answer."""

from __future__ import annotations

import math
import os
import re
import signal
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.drivers.car import Car
from harness.drivers.external import find_driver
from harness.errors import DriverError
from harness.game.cartesian_view import CartesianRoad, CartesianView, MapSignal, SeenObject, SeenSignal
from tests.support.other_pythons import require_ros2
from tests.support.processes import children_of, is_running
from tests.support.repository import REPOSITORY
from tests.support.ros2_nodes import EXAMPLE, GAMES, SEEN, Driven, bridge
from tests.support.tiny import wait_for


def test_document__is_valid_and_without_ros_the_error_names_it(
    tmp_path: Path, car: Car, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "python3").symlink_to(sys.executable)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("PYTHONPATH", raising=False)
    mine = find_driver(str(EXAMPLE / "ros2.toml"), tmp_path / "campaign.toml", "", allow_code=True)
    with pytest.raises(DriverError, match="No module named 'rclpy'"):
        mine.make(car, sampled=False).reset(GAMES)


@pytest.fixture
def driven(tmp_path: Path, car: Car, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., Driven]]:
    """Makes bridges with nodes; they end with the test."""
    monkeypatch.setenv("PATH", require_ros2())
    made = list[Driven]()

    def make(change: str = "pass", *, kind: str = "TwistStamped", within_s: float = 60.0) -> Driven:
        made.append(Driven(tmp_path / str(len(made)), car, change, kind, within_s))
        return made[-1]

    yield make
    for each in made:
        each.close()


def stamp_s(header: dict[str, Any]) -> float:
    return header["stamp"]["sec"] + header["stamp"]["nanosec"] / 1e9


@pytest.mark.ros2
def test_node__gets_the_state_and_its_command_is_the_decision(
    driven: Callable[..., Driven], start: CartesianView, car: Car
) -> None:
    road: CartesianRoad = replace(start.road, signals=(MapSignal(station_m=50.0, lanes=("in_0",)),))
    bus = {"id": 3, "kind": "bus", "x_m": 10.0, "y_m": 5.0, "heading_rad": -0.5, "length_m": 12.0, "width_m": 2.5}
    motion = {"velocity_x_mps": 2.0, "velocity_y_mps": -1.0, "acceleration_x_mps2": 0.0, "acceleration_y_mps2": 0.0}
    view = replace(
        start,
        **{"time_s": 0.3, "speed_mps": 8.0, "steering_rad": 0.1, "speed_limit_share": 0.5, "road": road},
        objects=(SeenObject(**bus, **motion, turn_signal="off"),),
        signals=(SeenSignal(state="red", since_s=1.0),),
    )
    mine = driven()
    mine.reset()
    actions = mine.decide(view)

    wheelbase = car.limits["wheelbase_m"]
    (odom,) = mine.received("odom")
    assert stamp_s(odom["header"]) == pytest.approx(1000.3)
    assert (odom["header"]["frame_id"], odom["child_frame_id"]) == ("map", "base_link")
    at = odom["pose"]["pose"]["position"]
    axle = (
        view.x_m - 0.5 * wheelbase * math.cos(view.heading_rad),
        view.y_m - 0.5 * wheelbase * math.sin(view.heading_rad),
    )
    assert (at["x"], at["y"]) == pytest.approx(axle)
    turn = odom["pose"]["pose"]["orientation"]
    assert 2.0 * math.atan2(turn["z"], turn["w"]) == pytest.approx(view.heading_rad)
    # the rear axle of the bicycle of harness/game/bicycle.py, whose speed is that of its centre
    axle_mps = 8.0 * math.cos(math.atan(0.5 * math.tan(0.1)))
    assert odom["twist"]["twist"]["linear"]["x"] == pytest.approx(axle_mps)
    assert odom["twist"]["twist"]["angular"]["z"] == pytest.approx(axle_mps * math.tan(0.1) / wheelbase)

    (route,) = mine.received("route")
    line = [(each["pose"]["position"]["x"], each["pose"]["position"]["y"]) for each in route["poses"]]
    np.testing.assert_array_equal(line, road.route_line)
    first, second = (stamp_s(each["header"]) for each in route["poses"][:2])
    limit_mps = road.lanes[road.route_lanes[0]].speed_limit_mps
    assert first == stamp_s(route["header"]) == 1000.0
    assert math.dist(*line[:2]) / (second - first) == pytest.approx(0.5 * limit_mps, rel=1e-5)

    (found,) = mine.received("objects")
    deletion, cube, arrow, stop = found["markers"]
    assert deletion["action"] == 3
    assert {stamp_s(each["header"]) for each in found["markers"]} == {stamp_s(odom["header"])}
    assert (cube["ns"], cube["id"], cube["scale"]["x"], cube["scale"]["y"]) == ("bus", 3, 12.0, 2.5)
    assert [(each["x"], each["y"]) for each in arrow["points"]] == [(10.0, 5.0), (12.0, 4.0)]
    assert (arrow["ns"], arrow["id"]) == ("velocity", 3)
    assert stop["ns"] == "stop_line"
    place = stop["pose"]["position"]
    assert (place["x"], place["y"]) == pytest.approx(tuple(road.route_line[100]))

    (clock,) = mine.received("/clock")
    assert clock["clock"] == odom["header"]["stamp"]
    (corners,) = mine.received("footprint")
    assert corners["header"]["frame_id"] == "base_link"
    xs = [each["x"] for each in corners["polygon"]["points"]]
    assert (min(xs), max(xs)) == pytest.approx(tuple(0.5 * (wheelbase + side * car.length_m) for side in (-1, 1)))
    (net,) = mine.received("road")
    assert {each["ns"] for each in net["markers"]} == {"lane", "rail"}
    assert len(net["markers"]) == len(road.lanes) + len(road.rails)

    # the command: 0.1 m/s more than now after 0.1 s, and a yaw rate of 0.2 rad/s
    steering = math.atan(0.2 * wheelbase / (axle_mps + 0.1))
    centre_mps = (axle_mps + 0.1) / math.cos(math.atan(0.5 * math.tan(steering)))
    expected = car.actions(np.array([(centre_mps - 8.0) / 0.1]), np.array([steering]), SEEN)
    assert np.abs(expected).max() < 1.0
    np.testing.assert_allclose(actions, expected)


@pytest.mark.ros2
def test_node__gets_the_route_anew_in_each_game_and_time_never_goes_back(
    driven: Callable[..., Driven], start: CartesianView
) -> None:
    mine = driven()
    for _ in range(2):
        mine.reset()
        for time_s in (0.0, 0.1):
            mine.decide(replace(start, time_s=time_s))
    wait_for(lambda: len(mine.received("route")) == 2, "the second route")
    assert [stamp_s(each["header"]) for each in mine.received("route")] == [1000.0, 2000.0]
    assert [stamp_s(each["header"]) for each in mine.received("odom")] == [1000.0, 1000.1, 2000.0, 2000.1]
    pid, _ = mine.process_and_domain()
    assert is_running(pid)


@pytest.mark.ros2
def test_node__that_misses_its_first_message_gets_it_again(driven: Callable[..., Driven], start: CartesianView) -> None:
    mine = driven("if count == 1: return")
    mine.reset()
    mine.decide(start)
    assert [stamp_s(each["header"]) for each in mine.received("odom")] == [1000.0, 1000.0]


@pytest.mark.ros2
def test_nodes__that_both_command_are_an_error(driven: Callable[..., Driven], start: CartesianView) -> None:
    mine = driven("other = count == 1 and node.create_publisher(TwistStamped, 'cmd_vel', 10) or other")
    mine.reset()

    def drive() -> None:
        for step in range(5000):  # the other publisher is discovered within a moment
            mine.decide(replace(start, time_s=0.1 * step))

    with pytest.raises(DriverError, match="2 publishers of /cmd_vel: there must be one"):
        drive()


SILENT = [
    ("sys.exit('no petrol') if count == 2 else None", r"the node ended with exit code 1: .*node\.py'.*no petrol"),
    ("os.kill(os.getpid(), 9) if count == 2 else None", r"the node was killed by SIGKILL: python3 node\.py"),
    ("time.sleep(600) if count == 2 else None", "no command within 10 s on /cmd_vel with the stamp 1000.1"),
    ("command.header = first", r"stamp 1000\.100000000, that of /odom; the last one has the stamp 1000\.000000000"),
    ("if count == 2: return", r"stamp 1000\.100000000, that of /odom; the last one has the stamp 1000\.000000000"),
]


@pytest.mark.ros2
@pytest.mark.parametrize(("change", "message"), SILENT)
def test_node__that_does_not_answer_a_decision_is_an_error(
    change: str, message: str, driven: Callable[..., Driven], start: CartesianView
) -> None:
    mine = driven(change, within_s=10.0)  # on a busy machine the first decision takes a second
    mine.reset()
    mine.decide(start)
    with pytest.raises(DriverError, match=message):
        mine.decide(replace(start, time_s=0.1))


@pytest.mark.ros2
def test_node__of_another_type_of_command_is_an_error(driven: Callable[..., Driven]) -> None:
    with pytest.raises(DriverError, match="publishes /cmd_vel as geometry_msgs/msg/Twist, not"):
        driven(kind="Twist").reset()


@pytest.mark.ros2
@pytest.mark.parametrize(
    ("command", "message"),
    [
        ("sleep 600", "within 2 s no node came that subscribes to /odom .*: sleep 600"),
        ("./nowhere", r"the node ended with exit code 127: \./nowhere"),
    ],
)
def test_node__that_never_comes_is_an_error(
    command: str, message: str, tmp_path: Path, car: Car, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", require_ros2())
    mine = bridge(tmp_path, car, *command.split(), node_within_s=2.0, command_within_s=2.0)
    with pytest.raises(DriverError, match=message):
        mine.reset(GAMES)


@pytest.mark.ros2
def test_nodes__of_bridges_at_the_same_time_have_domains_of_their_own_and_end_with_them(
    driven: Callable[..., Driven], start: CartesianView
) -> None:
    both = [driven(), driven()]
    for each in both:
        each.reset()
    for each in both:
        each.decide(start)
        assert len(each.received("odom")) == 1
    (one, its_domain), (other, other_domain) = (each.process_and_domain() for each in both)
    assert its_domain != other_domain
    (bridge,) = (pid for pid in children_of(os.getpid()) if one in children_of(pid))
    os.kill(bridge, signal.SIGKILL)  # alone, not its group
    wait_for(lambda: not is_running(one), "the end of the node whose bridge was killed")
    both[1].close()
    wait_for(lambda: not is_running(other), "the end of the other node")
    assert not list(Path("/dev/shm").glob("fastdds_*"))


def test_page__names_every_topic() -> None:
    page = (REPOSITORY / "docs" / "egos-by-ros2.md").read_text()
    program = (EXAMPLE / "bridge.py").read_text()
    topics = set(re.findall(r'"/?(\w+)": (?:MarkerArray|PolygonStamped|Route|Clock|Odometry)', program))
    assert topics == {"clock", "odom", "objects", "route", "road", "footprint"}
    assert sorted(topic for topic in topics | {"cmd_vel"} if f"`/{topic}`" not in page) == []
