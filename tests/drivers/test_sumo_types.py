"""SUMO's own models as the ego: each car-following and lane-changing model, by a vehicle type of the route file."""

from __future__ import annotations

import shutil
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from harness.assessment.rollout import Game
from harness.drivers.policy_file import LearnedDriver
from harness.drivers.sumo import SumoDriver
from harness.errors import UsageError
from harness.road.scene.open_scene import open_scene
from tests.support.policies import some_policy
from tests.support.rollouts import arm, play, trace
from tests.support.tiny import CAREFUL, PAPER_MERGE

FOLLOWING = ("Krauss", "IDM", "EIDM", "ACC", "CACC")
CHANGING = ("LC2013", "SL2015")
LIMITS = 'length="4.4" width="1.8" accel="2.6" decel="4.5" maxSpeed="38" speedFactor="1" speedDev="0"'


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The merge with the ego in the lane that ends, and a vehicle type for each pair of models."""
    folder = tmp_path_factory.mktemp("models") / "merge"
    shutil.copytree(PAPER_MERGE, folder)
    types = "".join(
        f'<vType id="{following}_{changing}" carFollowModel="{following}" laneChangeModel="{changing}" {LIMITS}/>\n'
        for following, changing in product(FOLLOWING, CHANGING)
    )
    routes, scene = folder / "paper_merge.rou.xml", folder / "scene.toml"
    routes.write_text(routes.read_text().replace("<route id", types + "<route id", 1))
    lanes = scene.read_text().replace('"approach_1"', '"x"').replace('"approach_2"', '"approach_1"')
    scene.write_text(lanes.replace('"x"', '"approach_2"'))
    return folder


def across_m(game: Game) -> float:
    """Lateral distance that the ego moved."""
    frame = trace(game)
    return float(np.ptp(frame.loc[frame["player"] == "ego", "y_m"]))


@pytest.mark.parametrize("changing", CHANGING)
@pytest.mark.parametrize("following", FOLLOWING)
def test_sumo_types__each_model_leaves_the_lane_that_ends_and_reaches_the_goal(
    following: str, changing: str, folder: Path
) -> None:
    scene = open_scene(folder, f"{following}_{changing}")
    for game in play(arm(scene, SumoDriver(), SumoDriver()), 2):
        assert (game.record["error"], game.record["ego_outcome"]) == ("", "goal")
        assert across_m(game) == pytest.approx(3.2, abs=0.2)
        assert f"{following}_{changing}" in set(trace(game)["vehicle_type"])


def test_sumo_types__car_following_models_differ(folder: Path) -> None:
    """CACC differs from ACC only behind a car."""
    paths = {}
    for following in FOLLOWING:
        games = play(arm(open_scene(folder, f"{following}_LC2013"), SumoDriver(), SumoDriver()), 4)
        paths[following] = tuple(game.record["ego_mean_speed_mps"] for game in games)
    assert len(set(paths.values())) == len(FOLLOWING)


def test_sumo_types__sublanes_allow_a_player_that_leaves_the_road(folder: Path) -> None:
    wild = LearnedDriver(some_policy(), sampled=True)
    games = play(arm(open_scene(folder, "EIDM_SL2015"), SumoDriver(), wild, persona=CAREFUL), 5)
    assert [game.record["error"] for game in games] == [""] * 5
    assert "rail" in [game.record["non_ego_outcome"] for game in games]


def test_sumo_types__an_unknown_type_is_an_error(folder: Path) -> None:
    with pytest.raises(UsageError) as caught:
        open_scene(folder, "IDM_LC2014")
    assert "has no vehicle type 'IDM_LC2014'" in str(caught.value)
    assert "did you mean 'IDM_LC2013'?" in str(caught.value)
