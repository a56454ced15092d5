"""`harness check-driver`: each violation of the driver protocol is found and named."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.assessment import conformance
from harness.assessment.conformance import Findings, check_conformance, difference_of
from harness.config.campaign import LEARNED, SUMO
from harness.drivers.car import car_of
from harness.drivers.sumo import SumoDriver
from harness.environments.arena import Arena
from harness.game.arrays import FloatArray, IntArray
from harness.game.initial_state import draw_initial_state
from harness.game.roles import EGO
from harness.road.scene.open_scene import OpenScene
from tests.support.tiny import harness


class Good:
    """Holds its speed, and brakes softly from its tenth decision on; its state is kept per game, as required."""

    takes_over = True

    def __init__(self) -> None:
        self.steps: dict[int, int] = {}

    def reset(self, games: IntArray) -> None:
        self.steps |= dict.fromkeys(games.tolist(), 0)

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        actions = np.zeros((len(games), 2))
        for row, game in enumerate(games.tolist()):
            actions[row, 0] = -0.01 if self.steps[game] >= 10 else 0.0
            self.steps[game] += 1
        return actions


class Stale(Good):
    """Ignores resets: its second game continues the state of the first."""

    def reset(self, games: IntArray) -> None:
        for game in games.tolist():
            self.steps.setdefault(game, 0)


class Sharing(Good):
    """One state for all games."""

    def reset(self, games: IntArray) -> None:
        self.steps = {-1: 0}

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        actions = super().decide(np.array([-1]), observation, noise)
        return np.repeat(actions, len(games), axis=0)


CHANCE = np.random.default_rng(1)


class Deciding(Good):
    """Decides by a function of the observation."""

    def __init__(self, decided: Callable[[FloatArray], Any]) -> None:
        super().__init__()
        self.decided = decided

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        return self.decided(observation)  # type: ignore[no-any-return]


def at_random(observation: FloatArray) -> FloatArray:
    return 0.01 * CHANCE.standard_normal((len(observation), 2)).clip(-1.0, 1.0)


def of_all_games(observation: FloatArray) -> FloatArray:
    return np.repeat(0.01 * observation.mean(axis=0, keepdims=True)[:, :2], len(observation), axis=0).astype(float)


def raising(observation: FloatArray) -> FloatArray:
    raise KeyError("no such lane")


def writing(observation: FloatArray) -> FloatArray:
    observation *= 2.0
    return np.zeros((len(observation), 2))


def test_check__a_conforming_driver_passes(merge: OpenScene) -> None:
    found = check_conformance(Good(), merge, 2)
    assert found.violations == []
    assert len(found.passed) == 3
    assert len(found.outcomes) == 2
    assert min(found.seconds) >= 0.0


def test_time__the_longest_decision_is_judged_and_not_the_average() -> None:
    (line,) = Findings(seconds=[0.01, 0.01, 0.25, 0.01], step_s=0.1).lines()[1:]
    assert line.startswith(
        "  time   250.00 ms per decision at most: slower than the scene's step of 0.1 s; 70.00 ms on"
    )
    assert line.endswith("on average, 14 decisions a second")
    assert "faster" in Findings(seconds=[0.09, 0.01]).lines()[1]


def test_check__times_each_game_and_the_decisions_of_all_games_at_once(merge: OpenScene) -> None:
    found = check_conformance(Good(), merge, 2)
    assert len(found.game_seconds) == 2
    assert min(found.game_seconds) > 0.0
    assert found.seconds_at_once is not None
    assert 0.0 < found.seconds_at_once < 0.1


@pytest.mark.parametrize(
    ("driver", "message"),
    [
        (Deciding(lambda seen: np.zeros(2)), "it decided an array [2], not [1, 2]"),
        (Deciding(lambda seen: [[0.0, 0.0]]), "it decided list, not a NumPy array"),
        (Deciding(lambda seen: np.full((1, 2), np.nan)), "not finite"),
        (Deciding(lambda seen: np.full((1, 2), 1.5)), "pedals and wheel are in -1 to 1"),
        (Deciding(writing), "it modified the observation"),
        (Deciding(raising), "playing, game 0, decision 0: it raised KeyError: 'no such lane'"),
        (Deciding(at_random), "it is not deterministic"),
        (Deciding(of_all_games), "its games are not independent"),
        (Stale(), "it is not deterministic: in decision 0 of game 0"),
        (Sharing(), "its games are not independent"),
    ],
)
def test_check__a_violation_is_named(driver: Good, message: str, merge: OpenScene) -> None:
    (violation,) = check_conformance(driver, merge, 3).violations  # of which some differ in length
    assert message in violation


def test_check__an_implausible_request_is_named_with_its_unit(merge: OpenScene) -> None:
    car = car_of(merge.world, EGO)
    driver = Deciding(lambda seen: car.actions(np.full(len(seen), 1e9), np.zeros(len(seen)), seen))
    (violation,) = check_conformance(driver, merge, 3).violations  # of which some differ in length
    assert "it decided an acceleration of 1e+09 m/s², which is beyond ±100: is the unit right?" in violation


def test_repeats__a_driver_that_varies_is_told_and_others_are_not(merge: OpenScene) -> None:
    assert difference_of(Good(), merge) == ""
    assert "it is not deterministic: in decision 0 of game 0" in difference_of(Deciding(at_random), merge)
    assert difference_of(Deciding(raising), merge) == "", "games that can't be played are told by the arms"


def write(folder: Path, change: str = "") -> Path:
    (folder / "drive.py").write_text(f"""
import json, sys
step = 0
for line in sys.stdin:
    message = json.loads(line)
    step += 1
    decided = {{"actions": [[0, 0]] * len(message.get("games", []))}}
    answer = {{"hello": {{"protocol": 2}}, "reset": {{}}, "decide": decided}}[message["type"]]
    {change}
    print(json.dumps(answer), flush=True)
""")
    (folder / "mine.toml").write_text('kind = "process"\ncommand = ["python3", "drive.py"]\ndeadline_s = 20.0\n')
    return folder / "mine.toml"


def test_command__reports_passed_checks_and_violations(tmp_path: Path) -> None:
    good = harness("check-driver", write(tmp_path), "--allow-code", "--games", 2)
    assert good.returncode == 0, good.stdout + good.stderr
    assert "the same games again: the same actions, bit for bit" in good.stdout
    assert "ms per decision" in good.stdout
    change = 'if "actions" in answer: answer["actions"] = [[0.001 * step, 0]] * len(message["games"])'
    bad = harness("check-driver", write(tmp_path, change), "--allow-code", "--games", 2)
    assert bad.returncode == 1
    assert "it is not deterministic" in bad.stdout


def test_command__runs_no_program_without_permission(tmp_path: Path) -> None:
    refused = harness("check-driver", write(tmp_path, 'open("ran", "w").close()'))
    assert refused.returncode == 2
    assert len(refused.stderr.splitlines()) == 1
    assert "--allow-code" in refused.stderr
    assert not (tmp_path / "ran").exists()


def test_check__sumos_driver_passes_without_decisions(merge: OpenScene) -> None:
    found = check_conformance(SumoDriver(), merge, 2)
    assert found.violations == []
    assert [line for line in found.passed if "SUMO's own models move the ego" in line]
    assert found.passed[-1] == "the same games again: the same motion, bit for bit"
    assert len(found.outcomes) == 2
    assert found.seconds == []


def test_check__another_motion_of_sumos_driver_is_a_violation(
    merge: OpenScene, monkeypatch: pytest.MonkeyPatch
) -> None:
    seeds = itertools.count()
    reload = Arena.reload
    monkeypatch.setattr(Arena, "reload", lambda arena, seed: reload(arena, next(seeds)))
    monkeypatch.setattr(
        conformance, "draw_initial_state", lambda of, *parts: draw_initial_state(of, *parts, next(seeds))
    )
    (violation,) = check_conformance(SumoDriver(), merge, 2).violations
    assert "it is not deterministic: game 0" in violation


def test_command__checks_a_driver_of_sumo(tmp_path: Path) -> None:
    (tmp_path / "car.toml").write_text('kind = "sumo"\nvehicle_type = "ego_car"\n')
    for driver in (SUMO, tmp_path / "car.toml"):
        done = harness("check-driver", driver, "--games", 2)
        assert done.returncode == 0, done.stdout + done.stderr
        assert f"SUMO's own models of vehicle type ego_car ({driver}), on merge" in done.stdout
        assert "the same games again: the same motion, bit for bit" in done.stdout
        assert "games  goal, goal" in done.stdout


def test_command__has_nothing_to_check_before_the_training() -> None:
    refused = harness("check-driver", LEARNED)
    assert refused.returncode == 2
    assert len(refused.stderr.splitlines()) == 1
    assert "'learned' is trained by a campaign: before the training there is no driver to check" in refused.stderr
    assert "name the folder of a trained policy" in refused.stderr
