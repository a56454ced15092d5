"""OpenSCENARIO: valid by ASAM's schemas, and every body on its recorded course."""

from __future__ import annotations

import io
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import xmlschema

from harness.export.exported_game import ExportedGame
from harness.export.opendrive import RoadFile
from harness.export.openscenario import scenario_file
from harness.road.scene.open_scene import OpenScene
from tests.support.exports import bicycle_game, exported, merge_with_vans, signals_game, walker_game
from tests.support.replays import GAMES, STEP_S, busy_game, collision_game, drive, game, straight

ROAD = RoadFile(xml=b"", signals={"crossing": {link: link + 1 for link in range(12)}})
OTHERS = {"walker": walker_game, "bicycle": bicycle_game, "signals": signals_game}
Valid = Callable[[bytes], list[str]]


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> OpenScene:
    return merge_with_vans(tmp_path_factory.mktemp("scene") / "merge")


@pytest.fixture(scope="module")
def mistakes() -> Valid:
    """`mistakes(document)`: what ASAM's schema of the written version says against it."""
    spec = find_spec("qc_openscenario")
    assert spec is not None, "asam-qc-openscenarioxml is not installed"
    schema = xmlschema.XMLSchema(str(Path(str(spec.origin)).parent / "schema" / "1.2.0" / "OpenSCENARIO.xsd"))
    return lambda document: [str(error.reason) for error in schema.iter_errors(io.BytesIO(document))]


def root_of(document: bytes) -> ElementTree.Element:
    return ElementTree.fromstring(document)


def course_of(root: ElementTree.Element, name: str) -> np.ndarray:
    """[n, 4] time, x, y and heading of each vertex of a body's course."""
    group = next(
        each for each in root.iter("ManeuverGroup") if each.find(f"Actors/EntityRef[@entityRef='{name}']") is not None
    )
    rows = []
    for vertex in group.iter("Vertex"):
        position = vertex.find("Position/WorldPosition")
        assert position is not None
        rows.append([float(vertex.get("time", "nan")), *(float(position.get(each, "nan")) for each in "xyh")])
    return np.array(rows)


@pytest.mark.parametrize("name", [*GAMES, *OTHERS])
def test_scenario__is_valid(name: str, scene: OpenScene, mistakes: Valid) -> None:
    trace, of_game = OTHERS[name]() if name in OTHERS else (GAMES[name](), scene)
    assert mistakes(scenario_file(exported(trace, of_game), ROAD)) == []


def test_course__is_that_of_the_middle_of_the_rear_axle(scene: OpenScene) -> None:
    trace = collision_game()
    course = course_of(root_of(scenario_file(exported(trace, scene), None)), "ego")
    ego = trace[trace["player"] == "ego"].sort_values("step")
    wheelbase_m = scene.world.actuators.wheelbase_m[0]
    heading = ego["heading_rad"].to_numpy()
    expected = [
        ego["step"] * STEP_S,
        ego["x_m"] - 0.5 * wheelbase_m * np.cos(heading),
        ego["y_m"] - 0.5 * wheelbase_m * np.sin(heading),
        heading,
    ]
    np.testing.assert_allclose(course, np.stack(expected, axis=-1), atol=1e-5)


def test_heading__does_not_jump_by_a_turn(scene: OpenScene) -> None:
    poses = [(50.0 + k, -1.6, np.pi - 0.1 if k % 2 else -np.pi + 0.1, 5.0) for k in range(6)]
    course = course_of(root_of(scenario_file(exported(game(drive("ego", poses)), scene), None)), "ego")
    assert np.abs(np.diff(course[:, 3])).max() == pytest.approx(0.2, abs=1e-5)


def actions(root: ElementTree.Element, kind: str) -> list[tuple[float, ElementTree.Element]]:
    """The actions of a kind with their times."""
    return [
        (float(event.find(".//SimulationTimeCondition").get("value", "nan")), action)  # type: ignore[union-attr]
        for event in root.iter("Event")
        for action in event.iter(kind)
    ]


def test_others__appear_and_leave_when_they_did(scene: OpenScene) -> None:
    root = root_of(scenario_file(exported(busy_game(), scene), None))
    times = {(action.get("entityRef"), action[0].tag): time_s for time_s, action in actions(root, "EntityAction")}
    assert times["flow.0", "AddEntityAction"] == pytest.approx(1.5)
    assert times["flow.0", "DeleteEntityAction"] == pytest.approx(7.45)
    assert ("brief", "AddEntityAction") in times
    assert "ego" not in {name for name, _ in times}
    assert {private.get("entityRef") for private in root.iter("Private")} == {"ego"}


def test_entities__are_of_their_kinds(scene: OpenScene) -> None:
    def kinds(of_game: ExportedGame) -> dict[str | None, str | None]:
        root = root_of(scenario_file(of_game, None))
        return {
            each.get("name"): each[0].get("vehicleCategory") or each[0].get("pedestrianCategory")
            for each in root.iter("ScenarioObject")
        }

    assert kinds(exported(busy_game(), scene)) == {
        "ego": "car",
        "flow.0": "van",
        "flow.1": "bus",
        "leaves.inside": "car",
        "bus_2:_late": "car",
        "brief": "car",
    }
    assert kinds(exported(*walker_game()))["non_ego"] == "pedestrian"
    assert kinds(exported(*bicycle_game()))["non_ego"] == "bicycle"


def test_names__are_no_parameters_and_occur_once(scene: OpenScene, mistakes: Valid) -> None:
    trace = game(
        drive("ego", straight(30, -1.6, 9, 30)),
        *(drive(name, straight(50 + 9 * k, -4.8, 0, 30)) for k, name in enumerate(("$a", "_a", "${b}", "\x01"))),
    )
    document = scenario_file(exported(trace, scene), None)
    assert mistakes(document) == []
    names = [each.get("name") for each in root_of(document).iter("ScenarioObject")]
    assert set(names) == {"_", "_a", "_a#2", "__b_", "ego"}


def test_absence__splits_a_road_user(scene: OpenScene) -> None:
    away = game(
        drive("ego", straight(30, -1.6, 9, 40)),
        drive("flow.0", straight(10, -4.8, 9, 10)),
        drive("flow.0", straight(60, -4.8, 9, 10), first_step=25),
    )
    bodies = {body.name: body for body in exported(away, scene).bodies}
    assert sorted(bodies) == ["ego", "flow.0", "flow.0#2"]
    assert bodies["flow.0#2"].original == "flow.0"
    assert (bodies["flow.0"].leaves, bodies["flow.0#2"].first_step, len(bodies["flow.0#2"].time_s)) == (True, 25, 10)


def test_signals__change_when_they_did() -> None:
    root = root_of(scenario_file(exported(*signals_game()), ROAD))
    changes: dict[str | None, list[tuple[float, str | None]]] = {}
    for time_s, action in actions(root, "TrafficSignalStateAction"):
        changes.setdefault(action.get("name"), []).append((time_s, action.get("state")))
    red, yellow, green = "on;off;off", "off;on;off", "off;off;on"
    assert changes["4"] == [(0.0, green), (pytest.approx(2.0), yellow), (pytest.approx(5.0), red)]
    assert [state for _, state in changes["1"]] == [red, red, green]
    phases = [(float(phase.get("duration", "nan")), phase[3].get("state")) for phase in root.iter("Phase")]
    assert phases == [(pytest.approx(2.0), green), (pytest.approx(3.0), yellow), (3600.0, red)]
