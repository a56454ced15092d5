"""The scenes of the repository open, and their players meet."""

from __future__ import annotations

import numpy as np
import pytest

from harness.game.human_factors import HumanFactors
from harness.game.initial_state import draw_initial_state
from harness.game.junctions import Control
from harness.game.roles import EGO, NON_EGO
from harness.road.scene.open_scene import open_scene
from tests.support.repository import REPOSITORY

JUNCTIONS = ("left_across", "priority_crossing", "roundabout", "red_light")
SCENES = [REPOSITORY / "networks" / name for name in (*JUNCTIONS, "merge")]
SCENES += [REPOSITORY / "tests" / "data" / "scenes" / name for name in ("left_turn", "t_junction", "slow_lead")]


@pytest.mark.parametrize("folder", SCENES, ids=lambda folder: folder.name)
def test_scene__opens_and_starts_its_players_on_their_routes(folder):
    scene = open_scene(folder)
    starts = scene.start_distribution((HumanFactors(), HumanFactors()), (1.0, 1.0))
    for episode in range(20):
        start = draw_initial_state(starts, "shipped", episode)
        assert (start.station_m >= 0.0).all()
        assert (start.station_m < scene.world.road.routes.goal_m).all()
        assert np.isfinite([start.x_m, start.y_m, start.heading_rad, start.speed_mps]).all()


@pytest.mark.parametrize("name", JUNCTIONS)
def test_junction__the_ego_has_priority_over_the_person_or_a_signal_decides(name):
    right_of_way = open_scene(REPOSITORY / "networks" / name).world.right_of_way
    conflicts, lines = right_of_way.conflicts, right_of_way.stop_lines
    assert {EGO, NON_EGO} <= set(conflicts.player.tolist())
    signals = {"left_across", "red_light"}
    assert (Control.SIGNAL in set(lines.control.tolist())) == (name in signals)
    assert bool(right_of_way.signal_links) == (name in signals)
    if name == "priority_crossing":
        assert not conflicts.yields[conflicts.player == EGO].any()
        assert conflicts.yields[conflicts.player == NON_EGO].any()
