"""The people of a scene document: `[[non_ego]]` for each."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from harness.config.scene import Scene
from harness.config.toml_reading import read_document
from harness.errors import UsageError
from harness.game.roles import roles_of


def document(non_ego: Any) -> dict[str, Any]:
    ego = {"vehicle": "ego", "lane": "road_0", "position_m": [30.0, 40.0], "speed_mps": [8.0, 12.0]}
    goal = {"edge": "road", "position_m": 250.0}
    files = {"net": "n.net.xml", "routes": "n.rou.xml"}
    return {"name": "small", **files, "time_limit_s": 20.0, "goal": goal, "ego": ego, "non_ego": non_ego}


def scene_of(non_ego: Any) -> Scene:
    return Scene.model_validate(document(non_ego), strict=False)


def person(lane: str = "road_1") -> dict[str, Any]:
    return {"vehicle": "person", "lane": lane, "position_m": [30.0, 40.0], "speed_mps": [8.0, 12.0]}


def test_scene__several_people_are_numbered() -> None:
    scene = scene_of([person("road_0"), person("road_1"), person("road_2")])
    assert scene.roles == ("ego", "non_ego", "non_ego_2", "non_ego_3")
    assert scene.player("non_ego_2").lane == "road_1"
    assert [player.lane for player in scene.players] == ["road_0", "road_0", "road_1", "road_2"]


def test_scene__a_goal_of_a_person_is_named_after_it() -> None:
    own = {"edge": "side", "position_m": 10.0}
    scene = scene_of([person(), person() | {"goal": own}])
    assert [scene.goal_of(player)[0] for player in scene.players] == ["goal", "goal", "non_ego_2.goal"]


PEOPLE = """
[[non_ego]]
vehicle = "a"
lane = "road_1"
position_m = [30.0, 40.0]
speed_mps = [8.0, 12.0]
"""
REST = """
name = "small"
net = "n.net.xml"
routes = "n.rou.xml"
time_limit_s = 20.0
goal = { edge = "road", position_m = 250.0 }
ego = { vehicle = "ego", lane = "road_0", position_m = [30.0, 40.0], speed_mps = [8.0, 12.0] }
"""


@pytest.mark.parametrize(
    ("people", "message"),
    [
        (PEOPLE * 5, "non_ego: 5 people; a scene has one to 4"),
        (PEOPLE.replace("[[non_ego]]", "[non_ego]"), "non_ego: is one table (write [[non_ego]]"),
        ("non_ego = []", "non_ego: 0 people; a scene has one to 4"),
        (PEOPLE + PEOPLE.replace("30.0", '"far"'), "non_ego_2.position_m"),
        (PEOPLE + PEOPLE + 'colour = "red"', "non_ego_2.colour: unknown key"),
        (PEOPLE + PEOPLE.replace("position_m", "route_m"), "non_ego_2: route_m is along the route: leave out lane"),
    ],
)
def test_scene__a_mistake_names_the_person(people: str, message: str, tmp_path: Path) -> None:
    file = tmp_path / "scene.toml"
    file.write_text(REST + people, encoding="utf-8")
    with pytest.raises(UsageError) as refused:
        read_document(file, Scene)
    assert message in str(refused.value)
    assert len(str(refused.value).splitlines()) == 1


def test_roles__of_more_people_begin_with_those_of_fewer() -> None:
    assert roles_of(2) == ("ego", "non_ego")
    assert roles_of(4) == ("ego", "non_ego", "non_ego_2", "non_ego_3")
