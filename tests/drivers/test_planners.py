"""Drivers that get views in Cartesian coordinates: programs and packages whose documents ask for them."""

from __future__ import annotations

import json
import re
import sys
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from harness.assessment.seated_arm import SeatedArm
from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.drivers.car import Car, car_of
from harness.drivers.external import find_driver
from harness.drivers.mixture import mixture_of
from harness.drivers.process import PlanningProcess
from harness.drivers.protocol import planner_of
from harness.drivers.sumo import SumoDriver
from harness.errors import DriverError, UsageError
from harness.game.cartesian_view import CartesianRoad, CartesianView, MapLane, MapSignal, SeenObject, SeenSignal
from harness.game.observation_layout import SIZE
from harness.game.roles import EGO
from harness.road.scene.open_scene import OpenScene, open_scene
from tests.support.external_drivers import install
from tests.support.other_pythons import require_commonroad, require_ros2
from tests.support.repository import REPOSITORY
from tests.support.rollouts import assess
from tests.support.tiny import CAREFUL, harness

GAMES, SEEN, NOISE = np.array([0, 1]), np.zeros((2, SIZE), dtype=np.float32), np.zeros((2, 2))
EXAMPLES = REPOSITORY / "egos" / "examples"
IDM, MPC, COMMONROAD = (EXAMPLES / "cartesian" / f"{name}.toml" for name in ("idm", "mpc", "commonroad"))
ROS2 = EXAMPLES / "ros2" / "ros2.toml"
SCENES = ("roundabout", "merge", "left_across")
PROGRAM = """
import json, sys
for line in sys.stdin:
    message = json.loads(line)
    open("received.jsonl", "a").write(line)
    actions = [[view["x_m"] / 1e3, 0.0] for view in message.get("views", [])]
    answers = {"hello": {"protocol": 2}, "decide": {"actions": actions}}
    print(json.dumps(answers.get(message["type"], {})), flush=True)
"""


def planner(folder: Path, car: Car, history_s: float = 0.0) -> PlanningProcess:
    (folder / "program.py").write_text(PROGRAM)
    command, options = [sys.executable, "program.py"], {"deadline_s": 20.0, "start_deadline_s": 20.0}
    return PlanningProcess(command, folder, car, units="si", **options, history_s=history_s)


def test_program__gets_the_road_once_and_views_with_each_decision(
    tmp_path: Path, car: Car, start: CartesianView
) -> None:
    mine = planner(tmp_path, car)
    mine.reset(GAMES)
    for _ in range(2):
        mine.see(GAMES, [start, start])
        actions = mine.decide(GAMES, SEEN, NOISE)
    np.testing.assert_array_equal(actions, car.actions(np.full(2, start.x_m / 1e3), np.zeros(2), SEEN))
    messages = [json.loads(line) for line in (tmp_path / "received.jsonl").read_text().splitlines()]
    assert [each["type"] for each in messages] == ["hello", "reset", "road", "decide", "decide"]
    road = messages[2]["road"]
    assert set(road) == {each.name for each in fields(CartesianRoad)}
    np.testing.assert_array_equal(road["route_line"], start.road.route_line)
    lane = road["lanes"][road["route_lanes"][0]]
    assert set(lane) == {each.name for each in fields(MapLane)}
    assert set(messages[3]["views"][1]) == {each.name for each in fields(CartesianView)} - {"road", "history"}


def test_program__gets_the_history_that_it_asks_for(tmp_path: Path, car: Car, start: CartesianView) -> None:
    mine = planner(tmp_path, car, history_s=1.0)
    mine.reset(GAMES[:1])
    mine.see(GAMES[:1], [CartesianView(**{**vars(start), "history": (start,)})])
    mine.decide(GAMES[:1], SEEN[:1], NOISE[:1])
    (view,) = json.loads((tmp_path / "received.jsonl").read_text().splitlines()[-1])["views"]
    assert [each["x_m"] for each in view["history"]] == [start.x_m]
    assert "history" not in view["history"][0]


PACKAGE = """
import numpy as np
class Planner:
    takes_over = True
    def __init__(self, car): self.car = car
    def reset(self, games): pass
    def decide(self, games, observation, noise, views):
        return self.car.actions(np.array([view.road.goal_m / 1e3 for view in views]), np.zeros(len(games)), observation)
"""


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of documents, with a package in which a planner and a driver are."""
    install(tmp_path / "site", points="planner = planning_package:Planner\nsteady = steady:Steady")
    (tmp_path / "site" / "planning_package.py").write_text(PACKAGE)
    monkeypatch.syspath_prepend(tmp_path / "site")
    for name in ("steady", "planning_package"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    for name in ("planner", "steady"):
        (tmp_path / f"{name}.toml").write_text(f'kind = "python"\nentry_point = "{name}"\n[cartesian]\nhistory_s = 1\n')
    (tmp_path / "without.toml").write_text('kind = "python"\nentry_point = "planner"\n')
    return tmp_path


def test_package__gets_views_as_the_fourth_argument(
    installed: Path, car: Car, start: CartesianView, merge: OpenScene
) -> None:
    found = find_driver("planner.toml", installed / "campaign.toml", "ego.driver", allow_code=False)
    mine = found.make(car, sampled=False)
    views = planner_of(mine)
    assert views is not None
    assert views.history_s == 1.0
    views.see(GAMES, [start, start])
    expected = car.actions(np.full(2, start.road.goal_m / 1e3), np.zeros(2), SEEN)
    np.testing.assert_array_equal(mine.decide(GAMES, SEEN, NOISE), expected)
    found.try_out(car, sampled=False, games=2, road=lambda: merge.cartesian_roads[EGO])


@pytest.mark.parametrize(
    ("document", "message"),
    [("without.toml", "missing a required argument: 'views'"), ("steady.toml", "too many positional arguments")],
)
def test_package__whose_decide_does_not_fit_its_document_is_an_error(
    document: str, message: str, installed: Path, car: Car
) -> None:
    found = find_driver(document, installed / "campaign.toml", "ego.driver", allow_code=False)
    with pytest.raises(DriverError, match=rf"has another decide: {message}; .*\[cartesian\]"):
        found.make(car, sampled=False)


def test_document__of_another_kind_has_no_such_table(tmp_path: Path) -> None:
    (tmp_path / "net.toml").write_text('kind = "onnx"\nfile = "net.onnx"\n[cartesian]\n')
    with pytest.raises(UsageError, match="cartesian"):
        find_driver("net.toml", tmp_path / "campaign.toml", "ego.driver", allow_code=False)


@pytest.fixture(autouse=True)
def its_python_first(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let python3 be that of CommonRoad's planner, or of ROS 2, in tests that have its mark."""
    for mark, require in (("commonroad", require_commonroad), ("ros2", require_ros2)):
        if request.node.get_closest_marker(mark):
            monkeypatch.setenv("PATH", require())


@pytest.mark.parametrize(
    ("example", "name"),
    [
        *((IDM, name) for name in SCENES),
        (MPC, "roundabout"),
        *(pytest.param(COMMONROAD, name, marks=pytest.mark.commonroad) for name in SCENES),
        *(pytest.param(ROS2, name, marks=pytest.mark.ros2) for name in SCENES),
    ],
)
def test_example__reaches_the_goal_alone_in_every_game(example: Path, name: str) -> None:
    assert outcomes(example, name, None, games=5) == ["goal"] * 5


@pytest.mark.commonroad
def test_commonroad__reaches_the_goal_beside_sumos_driver() -> None:
    """Some of its starts see the other car farther from the route than the path's coordinates go."""
    assert outcomes(COMMONROAD, "left_across", SumoDriver(), games=3) == ["goal"] * 3


@pytest.mark.ros2
def test_ros2__reaches_the_goal_beside_sumos_driver() -> None:
    assert outcomes(ROS2, "merge", SumoDriver(), games=5) == ["goal"] * 5


def outcomes(example: Path, name: str, other: SumoDriver | None, games: int) -> list[str]:
    """How games of an example end for it, beside a driver or alone."""
    scene, careful = open_scene(name), read_document(CAREFUL, Persona)
    driver = find_driver(str(example), example, "", allow_code=True).make(car_of(scene.world, EGO), sampled=False)
    person = other and mixture_of(other, careful)
    players = (mixture_of(driver, careful), *[person] * (len(scene.world.roles) - 1))
    arm = SeatedArm(name="naive_vs_sumo" if other else "naive_alone", scene=scene, drivers=players, seed=1)
    return [game.played["ego_outcome"] for game in assess(arm, range(games))]


@pytest.mark.parametrize(
    ("example", "name"),
    [
        (IDM, "merge"),
        (MPC, "merge"),
        pytest.param(COMMONROAD, "paper_merge", marks=pytest.mark.commonroad),  # its games are short
        pytest.param(ROS2, "paper_merge", marks=pytest.mark.ros2),
    ],
)
def test_example__conforms_to_the_protocol(example: Path, name: str) -> None:
    scene = REPOSITORY / "networks" / name
    done = harness("check-driver", example, "--scene", scene, "--games", 2, "--allow-code")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "2 games at once, one of them reset in between: the same actions as alone" in done.stdout


def test_page__names_every_field() -> None:
    page = (REPOSITORY / "docs" / "egos-in-cartesian.md").read_text()
    named = set(re.findall(r"`(\w+)`", page))
    records = (CartesianRoad, MapLane, MapSignal, CartesianView, SeenObject, SeenSignal)
    assert {each.name for record in records for each in fields(record)} - named == set()
