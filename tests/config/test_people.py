"""The people of a scene document: `[[non_ego]]` for each."""

from __future__ import annotations

from pathlib import Path

import pytest

from harness.config.scene import Scene
from harness.config.toml_reading import read_document
from harness.errors import UsageError
from harness.game.roles import roles_of

REST = """
name = "small"
net = "n.net.xml"
routes = "n.rou.xml"
time_limit_s = 20.0
goal = { edge = "road", position_m = 250.0 }
ego = { vehicle = "ego", lane = "road_0", position_m = [30.0, 40.0], speed_mps = [8.0, 12.0] }
"""


def person(lane: str = "road_1") -> str:
    start = "position_m = [30.0, 40.0]\nspeed_mps = [8.0, 12.0]\n"
    return f'[[non_ego]]\nvehicle = "a"\nlane = "{lane}"\n{start}'


PERSON = person()


def scene_of(people: str, folder: Path) -> Scene:
    file = folder / "scene.toml"
    file.write_text(REST + people, encoding="utf-8")
    return read_document(file, Scene)


def test_scene__several_people_are_numbered(tmp_path: Path) -> None:
    scene = scene_of(person("road_0") + person("road_1") + person("road_2"), tmp_path)
    assert scene.roles == ("ego", "non_ego", "non_ego_2", "non_ego_3")
    assert scene.player("non_ego_2").lane == "road_1"
    assert [player.lane for player in scene.players] == ["road_0", "road_0", "road_1", "road_2"]


def test_scene__a_goal_of_a_person_is_named_after_it(tmp_path: Path) -> None:
    scene = scene_of(PERSON * 2 + 'goal = { edge = "side", position_m = 10.0 }', tmp_path)
    assert [scene.goal_of(player)[0] for player in scene.players] == ["goal", "goal", "non_ego_2.goal"]


@pytest.mark.parametrize(
    ("people", "message"),
    [
        (PERSON * 5, "non_ego: 5 people; a scene has one to 4"),
        (PERSON.replace("[[non_ego]]", "[non_ego]"), "non_ego: is one table (write [[non_ego]]"),
        ("non_ego = []", "non_ego: 0 people; a scene has one to 4"),
        (PERSON + PERSON.replace("30.0", '"far"'), "non_ego_2.position_m"),
        (PERSON * 2 + 'colour = "red"', "non_ego_2.colour: unknown key"),
        (PERSON + PERSON.replace("position_m", "route_m"), "non_ego_2: route_m is along the route: leave out lane"),
    ],
)
def test_scene__a_mistake_names_the_person(people: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(UsageError) as refused:
        scene_of(people, tmp_path)
    assert message in str(refused.value)
    assert len(str(refused.value).splitlines()) == 1


def test_roles__of_more_people_begin_with_those_of_fewer() -> None:
    assert roles_of(2) == ("ego", "non_ego")
    assert roles_of(4) == ("ego", "non_ego", "non_ego_2", "non_ego_3")


WALKER = '[[non_ego]]\nkind = "pedestrian"\nway = [[0, 0], [9, 9]]\nroute_m = [0, 1]\nspeed_mps = [1, 2]\n'


@pytest.mark.parametrize(("line", "share"), [("", 0.5), ("followed_share = 0.2\n", 0.2), ("followed_share = 0\n", 0.0)])
def test_scene__the_ego_is_followed_in_half_of_the_games_or_as_written(line: str, share: float, tmp_path: Path) -> None:
    assert scene_of(line + PERSON, tmp_path).share_followed == share


def test_scene__nobody_follows_an_ego_that_does_not_drive_or_meets_a_pedestrian(tmp_path: Path) -> None:
    assert scene_of(PERSON + WALKER, tmp_path).share_followed == 0.0
    assert scene_of("followed_share = 0\n" + WALKER, tmp_path).share_followed == 0.0
    cycling = REST.replace("ego = {", 'ego = { kind = "bicycle",')
    (tmp_path / "scene.toml").write_text(cycling + PERSON, encoding="utf-8")
    assert read_document(tmp_path / "scene.toml", Scene).share_followed == 0.0


def test_scene__a_follower_with_a_pedestrian_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError) as refused:
        scene_of("followed_share = 0.5\n" + PERSON + WALKER, tmp_path)
    (problem,) = refused.value.problems
    assert (Path(problem.file).name, problem.key) == ("scene.toml", "followed_share")
    assert "non_ego_2 is a pedestrian" in problem.message
    assert problem.remedy == "give 0, or leave it out"
