"""Starts along the route, timed starts and goals of each player by hand, and every impossible one in words.

The ego drives east on y = 98.4, the other north on x = 101.6. Each road is 200 m long, from 0 to 200 m.
So the ways meet 101.6 m along the ego's route and 98.4 m along the other's.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from harness.errors import UsageError
from harness.game.initial_state import InitialState
from harness.game.start_range import ArrivesAfterEgo, OnLine, StartRange
from harness.road.net import network
from harness.road.net.route_table import meeting
from harness.road.scene.open_scene import OpenScene, open_scene
from tests.support.roads import arc, straight
from tests.support.scenes import CARS, CROSSING_EDGES, CROSSING_NODES, build_scene, drawn

EGO = 'position_m = [30.0, 50.0]\nlane = "wc_0"'
TIMED = "arrival_after_ego_s = [-1.0, 1.0]"
Write = Callable[..., Path]


def goal(edge: str, position_m: float) -> str:
    return f'{{ edge = "{edge}", position_m = {position_m} }}'


GOALS = (goal("ce", 50), goal("cn", 40))


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    places = {"ego": ("wc ce", "wc_0"), "non_ego": ("wc ce", "wc_0"), "goal": "ce"}
    return build_scene(tmp_path_factory.mktemp("net") / "x", CROSSING_NODES, CROSSING_EDGES, places, goal_m=50.0).folder


@pytest.fixture
def write(built: Path, tmp_path: Path) -> Write:
    """Writes a scene of the crossing with the given starts, goals and routes."""

    def write(
        ego: str = EGO,
        non_ego: str = TIMED,
        goals: tuple[str, str] = GOALS,
        routes: tuple[str, str] = ("wc ce", "sc cn"),
        speeds: tuple[str, str] = ("[9.0, 10.0]", "[9.0, 10.0]"),
    ) -> Path:
        folder = tmp_path / "scene"
        folder.mkdir(exist_ok=True)
        shutil.copy(built / "n.net.xml", folder)
        cars = "".join(
            f'<vehicle id="{name}" type="{kind}" depart="0"><route edges="{edges}"/></vehicle>'
            for name, kind, edges in zip(("ego", "non_ego"), ("ego_car", "person_car"), routes, strict=True)
        )
        (folder / "n.rou.xml").write_text(f"<routes>{CARS}{cars}</routes>")
        players = "".join(
            f'{header}\nvehicle = "{role}"\n{start}\nspeed_mps = {speed}\ngoal = {goal}\n'
            for header, role, start, speed, goal in zip(
                ("[ego]", "[[non_ego]]"), ("ego", "non_ego"), (ego, non_ego), speeds, goals, strict=True
            )
        )
        text = f'name = "small"\nnet = "n.net.xml"\nroutes = "n.rou.xml"\ntime_limit_s = 30.0\n{players}'
        (folder / "scene.toml").write_text(text)
        return folder

    return write


def games(scene: OpenScene, count: int = 60) -> list[InitialState]:
    return [drawn(scene, "game", game) for game in range(count)]


def test_meeting__of_a_crossing_is_where_the_ways_cross() -> None:
    found = meeting(straight(0.0), straight(np.pi / 2.0, x0=30.0, y0=-20.0))
    assert found is not None
    assert (found.ego_m, found.other_m) == pytest.approx((30.0, 20.0), abs=0.5)


def test_meeting__of_a_merge_is_where_the_ways_have_come_together() -> None:
    """The other drives a quarter circle of 20 m radius onto the ego's road at (20, 20), up to its goal 5 m before it.

    There it is 20 (1 - cos 0.25) = 0.62 m from the ego's line; 26.0 m along its way it is 0.73 m from it.
    """
    found = meeting(straight(np.pi / 2.0, length=150.0, x0=20.0, y0=-40.0), arc(20.0, length=10.0 * np.pi))
    assert found is not None
    assert found.other_m == pytest.approx(26.2, abs=0.5)
    assert found.ego_m == pytest.approx(40.0 + 20.0 * (1.0 - np.cos(26.2 / 20.0)), abs=0.8)


@pytest.mark.parametrize("other", [straight(0.0, y0=5.0), straight(np.pi / 2.0, x0=79.0, y0=-20.0)])
def test_meeting__of_ways_that_do_not_meet_before_their_goals_is_none(other: object) -> None:
    assert meeting(straight(0.0), other) is None  # type: ignore[arg-type]


def test_arrival__by_hand() -> None:
    """The ego has 60 m to the meeting point at 10 m/s: 6 s. The other arrives 1 s later, after 7 s at 8 m/s: 56 m."""
    place = ArrivesAfterEgo(after_s=(0.0, 2.0), meeting_m=100.0, ego_meeting_m=90.0)
    start = StartRange(line=np.array([(0.0, 0.0), (200.0, 0.0)]), place=place, speed_mps=(8.0, 8.0))
    assert start.position_m(0.5, 8.0, ego_m=30.0, ego_mps=10.0) == pytest.approx(44.0)
    assert start.position_m(0.0, 8.0, ego_m=30.0, ego_mps=10.0) == pytest.approx(52.0)
    assert start.position_m(0.0, 8.0, ego_m=60.0, ego_mps=10.0) == pytest.approx(76.0), "the ego starts nearer"


@pytest.mark.parametrize("ego", [EGO, "route_m = [30.0, 50.0]"])
def test_arrival__of_every_game_is_within_its_range(write: Write, ego: str) -> None:
    scene = open_scene(write(ego=ego))
    late_s = []
    for start in games(scene):
        front_x, front_y = start.x_m[0] + 2.3, start.y_m[1] + 2.3
        assert start.y_m[0] == pytest.approx(98.4)
        assert start.x_m[1] == pytest.approx(101.6)
        ego_s, other_s = (101.6 - front_x) / start.speed_mps[0], (98.4 - front_y) / start.speed_mps[1]
        late_s.append(other_s - ego_s)
        assert 30.0 <= start.position_m[0] <= 50.0
    # to the nearest half metre of the meeting point, 0.05 s
    assert min(late_s) >= -1.0 - 0.1
    assert max(late_s) <= 1.0 + 0.1
    assert max(late_s) - min(late_s) > 1.5


def test_route_m__reaches_over_the_edges_of_the_route(write: Write) -> None:
    scene = open_scene(write(ego="route_m = [20.0, 120.0]", non_ego="route_m = [10.0, 30.0]"))
    assert scene.places[0].place == OnLine((20.0, 120.0))
    starts = games(scene)
    fronts = np.array([start.position_m for start in starts])
    assert np.ptp(fronts[:, 0]) > 80.0
    for start in starts:
        assert start.x_m[0] == pytest.approx(start.position_m[0] - 2.3, abs=0.05)
        assert start.y_m[1] == pytest.approx(start.position_m[1] - 2.3, abs=0.05)
        assert start.heading_rad == pytest.approx([0.0, np.pi / 2.0], abs=0.01)


def test_goals__each_player_has_its_own(write: Write) -> None:
    scene = open_scene(write())
    routes = scene.world.road.routes
    net = network.read_net(scene.net_file)
    room_m = [net.getEdge(name).getLength() - goal_m for name, goal_m in (("ce", 50.0), ("cn", 40.0))]
    rows = routes.rows(routes.goal_m[None])[0]
    # the edges end at x = 200 and y = 200
    assert routes.x_m[rows] == pytest.approx([200.0 - room_m[0], 101.6], abs=0.3)
    assert routes.y_m[rows] == pytest.approx([98.4, 200.0 - room_m[1]], abs=0.3)


def test_goals__one_for_both_may_stand_beside_none(write: Write) -> None:
    """A player without a goal of its own has the goal of the scene."""
    folder = write(routes=("wc ce", "wc ce"), non_ego="route_m = [0.0, 20.0]")
    file = folder / "scene.toml"
    own = f"goal = {GOALS[1]}"
    shared = f"goal = {GOALS[0]}\n"
    text = file.read_text(encoding="utf-8").replace(own, "")
    file.write_text(shared + text, encoding="utf-8")
    goals_m = open_scene(folder).world.road.routes.goal_m
    assert goals_m[0] == goals_m[1]


NEAR = "route_m = [0.0, 5.0]"
OFF_LANE = 'position_m = [30.0, 150.0]\nlane = "wc_0"'
ON_EXIT = 'position_m = [10.0, 20.0]\nlane = "ce_0"'
BEHIND_GOAL = 'position_m = [10.0, 60.0]\nlane = "ce_0"'
BESIDE = 'beside_ego_m = [-5.0, 5.0]\nlane = "sc_0"'


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        (
            {"ego": "route_m = [20.0, 160.0]", "non_ego": NEAR},
            "ego.route_m: reaches from 20 to 160 m, and the goal",
        ),
        ({"non_ego": "route_m = [-5.0, 20.0]"}, "non_ego.route_m: reaches from -5 to 20 m, and the goal is at"),
        ({"ego": OFF_LANE, "non_ego": NEAR}, "ego.position_m: reaches from 30 to 150 m, off lane 'wc_0' of 9"),
        ({"ego": BEHIND_GOAL, "non_ego": NEAR}, "ego.position_m: reaches from 10 to 60 m, and the goal is at 50 m"),
        ({"non_ego": BESIDE}, "non_ego.beside_ego_m: needs both to start on the same edge"),
        ({"ego": ON_EXIT}, "non_ego.arrival_after_ego_s: its route never meets the ego's"),
        ({"ego": "route_m = [60.0, 110.0]"}, "101.5 m, and the ego starts at up to 110 m"),
        # the nearest ego arrives after (101.5 - 50) / 10 = 5.15 s, the other 6 s before that
        (
            {"non_ego": "arrival_after_ego_s = [-6.0, 0.0]"},
            "it may start after the place where the routes meet",
        ),
        # the farthest ego arrives after (101.5 - 30) / 9 = 7.94 s; 5 s later, at 10 m/s, 129.4 m: 30.9 m too many
        ({"non_ego": "arrival_after_ego_s = [0.0, 5.0]"}, "it would have to start up to 31 m before its route"),
        ({"goals": (goal("cn", 40), GOALS[1])}, "ego.goal.edge: edge 'cn' is not on the route of vehicle 'ego'"),
        ({"goals": (GOALS[0], goal("cn", 400))}, "non_ego.goal.position_m: lies beyond the edge's end at 9"),
    ],
)
def test_impossible__starts_and_goals_are_named_with_key_and_remedy(
    write: Write, changes: dict[str, str], expected: str
) -> None:
    with pytest.raises(UsageError) as raised:
        open_scene(write(**changes))
    (found,) = raised.value.problems
    assert expected in str(found)
    assert found.remedy


def test_impossible__neighbouring_starts_are_possible(write: Write) -> None:
    """The bounds of the messages: 5 s before the nearest ego, and 0.5 s later than the farthest one."""
    assert open_scene(write(non_ego="arrival_after_ego_s = [-5.0, 0.5]"))
