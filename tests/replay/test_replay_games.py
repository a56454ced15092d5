"""Games played by the harness and replayed in the real SUMO: every frame is the trace."""

from __future__ import annotations

from pathlib import Path

import pytest

from harness.drivers.sumo import SumoDriver
from harness.replay import write_replay
from tests.support.replays import assert_plays
from tests.support.rollouts import Steady, arm, play, trace
from tests.support.scenes import CARS, build_scene

TRAFFIC = """
    <flow id="vans" type="van" begin="0" end="20" period="3" departLane="0" departSpeed="9"><route edges="road"/></flow>
    <vehicle id="ahead" type="person_car" depart="0" departLane="1" departPos="80" departSpeed="10">
        <route edges="road"/></vehicle>
"""


@pytest.mark.parametrize(("wheel", "outcome"), [(0.0, "timeout"), (-0.8, "rail")])
def test_replay__every_frame_is_the_game_that_was_played(wheel: float, outcome: str, tmp_path: Path) -> None:
    """Two lanes with a flow of vans and a car ahead, which the ego follows, or it leaves the road."""
    scene = build_scene(tmp_path / "busy", others=TRAFFIC, cars=CARS, time_limit_s=12.0)
    (game,) = play(arm(scene, Steady(-0.02, wheel), SumoDriver()), episodes=1)
    assert game.record["ego_outcome"] == outcome
    recorded = trace(game)
    assert recorded["player"].nunique() >= 4
    write_replay(recorded, scene, tmp_path / "replay", title="a game")
    assert_plays(tmp_path / "replay", recorded, {name: kind.length_m for name, kind in scene.routes.types.items()})
