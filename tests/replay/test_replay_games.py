"""Games played by the harness and replayed in the real SUMO: every frame is the trace."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from harness.assessment.rollout import SeatedArm, assess
from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.drivers.protocol import Driver
from harness.drivers.sumo import SumoDriver
from harness.game.arrays import FloatArray, IntArray
from harness.replay import write_replay
from harness.road.scene.open_scene import OpenScene, open_scene
from tests.support.replays import assert_plays
from tests.support.rollouts import seated
from tests.support.scenes import CARS, build_scene

TRAFFIC = """
    <flow id="vans" type="van" begin="0" end="20" period="3" departLane="0" departSpeed="9"><route edges="road"/></flow>
    <vehicle id="ahead" type="person_car" depart="0" departLane="1" departPos="80" departSpeed="10">
        <route edges="road"/></vehicle>
"""


class Steady:
    """Keeps pedals and wheel constant."""

    takes_over = True

    def __init__(self, pedals: float, wheel: float) -> None:
        self._action = (pedals, wheel)

    def reset(self, games: IntArray) -> None:
        """It has no state."""

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        return np.tile(self._action, (len(games), 1))


@pytest.fixture(scope="module")
def careful(repository: Path) -> Persona:
    return read_document(repository / "personas" / "careful.toml", Persona)


@pytest.fixture(scope="module")
def paper(repository: Path) -> OpenScene:
    """The scene networks/merge."""
    return open_scene(repository / "networks" / "merge")


@pytest.fixture(scope="module")
def busy(tmp_path_factory: pytest.TempPathFactory) -> OpenScene:
    """Two lanes with a flow of vans, and a car ahead."""
    return build_scene(tmp_path_factory.mktemp("scenes") / "busy", others=TRAFFIC, cars=CARS, time_limit_s=12.0)


def played(
    scene: OpenScene, persona: Persona, drivers: tuple[Driver, Driver], outcome: str, episodes: int = 8
) -> pd.DataFrame:
    """The trace of the first game with such an outcome of the ego."""
    for game in assess(
        SeatedArm(name="arm", scene=scene, drivers=seated(drivers, (persona, persona)), seed=1), episodes
    ):
        if game.record["ego_outcome"] == outcome:
            assert game.trace is not None
            return pd.DataFrame(dict(game.trace))
    pytest.fail(f"no game of {episodes} ended with {outcome}")


Make = Callable[[OpenScene, OpenScene, Persona], tuple[OpenScene, pd.DataFrame]]


def collision(paper: OpenScene, busy: OpenScene, persona: Persona) -> tuple[OpenScene, pd.DataFrame]:
    return paper, played(paper, persona, (Steady(0.0, 0.0), Steady(0.1, -0.25)), "collision")


def rail(paper: OpenScene, busy: OpenScene, persona: Persona) -> tuple[OpenScene, pd.DataFrame]:
    return paper, played(paper, persona, (Steady(0.3, -0.8), SumoDriver()), "rail")


def others(paper: OpenScene, busy: OpenScene, persona: Persona) -> tuple[OpenScene, pd.DataFrame]:
    trace = played(busy, persona, (Steady(-0.02, 0.0), SumoDriver()), "timeout")
    assert trace["player"].nunique() >= 5
    return busy, trace


def clean(paper: OpenScene, busy: OpenScene, persona: Persona) -> tuple[OpenScene, pd.DataFrame]:
    trace = played(paper, persona, (SumoDriver(), SumoDriver()), "goal")
    assert set(trace[trace["outcome"] != ""]["outcome"]) == {"goal"}
    return paper, trace


@pytest.mark.parametrize("make", [collision, rail, others, clean], ids=lambda make: make.__name__)
def test_replay__every_frame_is_the_game_that_was_played(
    make: Make, paper: OpenScene, busy: OpenScene, careful: Persona, tmp_path: Path
) -> None:
    scene, trace = make(paper, busy, careful)
    write_replay(
        trace,
        scene.net_file,
        scene.route_files,
        tmp_path / "replay",
        title="a game",
        step_length_s=scene.world.step_s,
        rails=scene.rail_lines,
    )
    assert_plays(tmp_path / "replay", trace, {name: kind.length_m for name, kind in scene.routes.types.items()})
