"""A whole campaign on a scene with obstacles and a building, by the real command."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest

from harness.evaluation.tables import read_csv
from harness.evaluation.trace_file import TraceReader
from tests.support.scenes import build_scene
from tests.support.shared import built_once
from tests.support.shipped import stage
from tests.support.tiny import UNTRAINED, finished

pytestmark = pytest.mark.slow

OBSTACLES = """
[[obstacle]]
kind = "van"
lane = "road_0"
position_m = [150.0, 200.0]
offset_m = -1.0

[[obstacle]]
kind = "cone"
lane = "road_0"
position_m = 100.0
offset_m = -1.3

[[obstacle]]
kind = "building"
outline = [[100.0, 3.0], [120.0, 3.0], [120.0, 9.0], [100.0, 9.0]]
"""


def with_obstacles(folder: Path) -> None:
    build_scene(folder)
    file = folder / "scene.toml"
    file.write_text(file.read_text(encoding="utf-8") + OBSTACLES, encoding="utf-8")


@pytest.fixture(scope="module")
def run() -> Path:
    scene = built_once("with_obstacles", with_obstacles)
    changes = {"name": "obstacles", "scene": str(scene), "assessment": {"episodes": 4}}
    return finished(**{**UNTRAINED, **changes})


def obstacles_of(run: Path, arm: str, episode: int) -> pd.DataFrame:
    trace = TraceReader().read(run / "traces" / f"{stage(arm)}.parquet", episode)
    return trace[trace["player"].str.startswith("obstacle_")]


def test_trace__has_the_obstacles_in_every_step(run: Path) -> None:
    trace = TraceReader().read(run / "traces" / f"{stage('naive_alone')}.parquet", 0)
    steps = trace["step"].nunique()
    found = obstacles_of(run, "naive_alone", 0)
    assert found.groupby("player").size().to_dict() == {"obstacle_1": steps, "obstacle_2": steps}
    assert set(found["vehicle_type"]) == {"obstacle_1_van", "obstacle_2_cone"}
    cone = found[found["player"] == "obstacle_2"]
    assert np.unique(cone[["x_m", "y_m", "heading_rad", "speed_mps"]].to_numpy(), axis=0).tolist() == [
        [100.0, pytest.approx(-4.8 - 1.3), 0.0, 0.0]
    ]


def test_episodes__have_the_same_obstacles_in_every_arm(run: Path) -> None:
    arms = sorted(set(read_csv(run / "episodes.csv")["arm"]))
    places = {arm: [obstacles_of(run, arm, episode)["x_m"].iloc[0] for episode in range(4)] for arm in arms}
    assert len(arms) == 4
    assert len(set(map(tuple, places.values()))) == 1
    assert len(set(places["naive_alone"])) == 4  # and others in every episode


def test_replay__shows_vans_as_vehicles_and_the_rest_as_polygons_and_the_page_all(run: Path) -> None:
    folder = next((run / "replays").iterdir())
    scenery = ElementTree.parse(folder / "scene.add.xml").getroot()
    types = {element.get("id"): element.get("guiShape") for element in scenery.iter("vType")}
    assert types["obstacle_1_van"] == "delivery"
    assert "obstacle_2_cone" not in types
    polygons = {element.get("id"): element for element in scenery.iter("poly")}
    assert {"obstacle_2", "building_0"} <= set(polygons)
    assert polygons["obstacle_2"].get("shape", "").split()[0] in {"100.200,-5.900", "100.200,-6.300", "99.800,-6.300"}
    assert len(polygons["building_0"].get("shape", "").split()) == 5
    text = (folder / "episode.fcd.xml").read_text(encoding="utf-8")
    assert 'id="obstacle_1"' in text
    assert 'id="obstacle_2"' not in text
    page = (run / "report.html").read_text(encoding="utf-8")
    assert '"obstacle_1"' in page
    assert '"buildings":[[[100.0,3.0],[120.0,3.0],[120.0,9.0],[100.0,9.0]]]' in page
