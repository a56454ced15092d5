"""Pictures of a running game, options of `reset`, and what a live environment refuses."""

from __future__ import annotations

import copy
import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import gymnasium
import matplotlib.pyplot as plt
import numpy as np
import pytest
from gymnasium.wrappers import RenderCollection

from harness import DrivingEnv, ParallelDrivingEnv, UsageError, VectorDrivingEnv
from harness.environments.scene_picture import SIZE_PX, WIDTH_M
from harness.game.initial_state import draw_initial_state
from harness.replay.sumo_gui import find_xvfb, virtual_screen
from harness.replay.vehicles import PLAYER_COLOURS
from harness.road.scene.open_scene import open_scene
from tests.support.repository import REPOSITORY

BLUE, ORANGE = (tuple(map(int, PLAYER_COLOURS[name].split(","))) for name in ("ego", "non_ego"))
Open = Callable[..., Any]


def pixels_of(picture: Any, colour: tuple[int, ...]) -> Any:
    """[n, 2] column and row of the pixels of a colour."""
    return np.argwhere((picture == colour).all(axis=2))[:, ::-1]


@pytest.mark.parametrize(("name", "own", "other"), [("Ego", BLUE, ORANGE), ("NonEgo", ORANGE, BLUE)])
def test_rgb_array__has_the_player_in_its_middle_to_scale(opened: Open, name: str, own: Any, other: Any) -> None:
    environment = opened(gymnasium.make, f"harness/{name}-v0", other="sumo", render_mode="rgb_array")
    environment.reset(seed=1)
    picture = environment.render()
    assert (picture.shape, picture.dtype) == ((SIZE_PX[1], SIZE_PX[0], 3), np.uint8)
    car = pixels_of(picture, own)
    np.testing.assert_allclose(car.mean(axis=0), np.array(SIZE_PX) / 2, atol=2.0)
    length_m = np.ptp(car[:, 0]) * WIDTH_M / SIZE_PX[0]
    world = environment.unwrapped._game.arena.world
    assert length_m == pytest.approx(float(world.length_m[0]), abs=0.5)
    assert len(pixels_of(picture, other))


def test_rgb_array__is_collected_by_gymnasiums_wrapper(opened: Open) -> None:
    made = gymnasium.make(
        "harness/Ego-v0", scene="paper_merge", render_mode="rgb_array"
    )  # the end of a lane is in sight
    environment = opened(RenderCollection, made)
    environment.reset(seed=1)
    for _ in range(3):
        environment.step(np.array([1.0, 0.0]))
    pictures = environment.render()
    assert len(pictures) == 4
    assert not np.array_equal(pictures[0], pictures[-1])
    assert environment.metadata["render_fps"] == 10


HUMAN = """
import numpy as np, harness
environment = harness.DrivingEnv(render_mode="human")
environment.reset(seed=1)
for _ in range(3):
    environment.step(np.zeros(2))
import matplotlib.pyplot as plt
print(plt.get_backend().lower(), len(plt.get_fignums()), environment.render(), environment.metadata["render_modes"])
environment.close()
print(len(plt.get_fignums()))
"""


def test_human__shows_the_game_in_a_window_until_it_is_closed() -> None:
    pytest.importorskip("tkinter")
    xvfb = find_xvfb()
    if xvfb is None and os.environ.get("HARNESS_REQUIRE_GUI") != "1":
        pytest.skip("Xvfb is not installed")
    assert xvfb is not None
    with virtual_screen(xvfb, (800, 600)) as display:
        variables = {**os.environ, "DISPLAY": display, "MPLBACKEND": "tkagg", "PYTHONPATH": str(REPOSITORY)}
        done = subprocess.run([sys.executable, "-c", HUMAN], env=variables, capture_output=True, text=True, timeout=300)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines() == ["tkagg 1 None ['rgb_array', 'human']", "0"]


@pytest.mark.parametrize("make", [DrivingEnv, ParallelDrivingEnv])
@pytest.mark.parametrize("display", ["", ":0"])
def test_human__is_neither_declared_nor_accepted_without_a_window(
    opened: Open, make: Open, display: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DISPLAY", display)
    monkeypatch.setenv("WAYLAND_DISPLAY", "")
    monkeypatch.setattr(plt, "get_backend", lambda: "agg")  # it opens no windows on any display
    assert opened(make).metadata["render_modes"] == ["rgb_array"]
    with pytest.raises(UsageError, match=r"can't open a window.*rgb_array"):
        make(render_mode="human")


def test_render__needs_a_mode_and_a_game(opened: Open) -> None:
    with pytest.raises(gymnasium.error.ResetNeeded):
        opened(DrivingEnv, render_mode="rgb_array").render()
    with pytest.raises(UsageError, match="rgb_array, human"):
        DrivingEnv(render_mode="ansi")


# --- options of reset -------------------------------------------------------------------------------------------------


def test_options__name_the_game_of_a_campaigns_arm(opened: Open) -> None:
    environment = opened(DrivingEnv, other="sumo")
    environment.reset(seed=1, options={"episode": 3, "campaign_seed": 2})
    state = environment._game.arena.state
    scene = open_scene(REPOSITORY / "networks" / "merge")
    start = draw_initial_state(scene.usual_starts, "assessment", 2, "episode", 3)
    for name in ("x_m", "y_m", "speed_mps"):
        np.testing.assert_array_equal(getattr(state, name)[0], getattr(start, name))


def test_options__others_are_refused(opened: Open) -> None:
    environments = [opened(DrivingEnv), opened(VectorDrivingEnv, 1), opened(ParallelDrivingEnv)]
    for wrong in ({"epsiode": 1}, {"episode": -1}, {"episode": 1.5}, {"campaign_seed": 1}, {"episode": True}):
        for environment in environments[: 2 if "epsiode" in wrong else 3]:  # PettingZoo's checker passes unknown ones
            with pytest.raises(UsageError, match="options"):
                environment.reset(options=wrong)


# --- what is refused --------------------------------------------------------------------------------------------------


def test_action__another_shape_and_nan_are_refused(opened: Open) -> None:
    environment = opened(DrivingEnv)
    environment.reset(seed=1)
    for action in (np.zeros(3), 0.5, np.zeros((1, 2)), [0.0], [np.nan, 0.0]):
        with pytest.raises(ValueError, match=r"not \(2,\): pedals and wheel|an action is not finite"):
            environment.step(action)


@pytest.mark.parametrize("make", [DrivingEnv, ParallelDrivingEnv, VectorDrivingEnv])
def test_live__environments_are_not_copied(opened: Open, make: Open) -> None:
    environment = opened(make)
    for take in (pickle.dumps, copy.copy, copy.deepcopy):
        with pytest.raises(TypeError, match=r"running SUMO simulation.*a function that makes it"):
            take(environment)


def test_info__is_numbers_and_has_the_same_entries_in_every_step(opened: Open) -> None:
    environment = opened(DrivingEnv)
    _, first = environment.reset(seed=1)
    *_, then = environment.step(np.zeros(2))
    assert (list(first), list(first["terms"])) == (list(then), list(then["terms"]))
    for info in (first, then):
        numbers = [*info["terms"].values(), *(value for name, value in info.items() if name != "terms")]
        assert all(isinstance(number, int | float) for number in numbers)
