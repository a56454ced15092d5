"""`harness check-driver` finds what is wrong with a driver, and says it in words."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from harness.environments.conformance import check_conformance
from harness.game.arrays import FloatArray, IntArray
from harness.game.observation import LAYOUT
from harness.traffic.scene import OpenScene
from tests.support.repository import REPOSITORY
from tests.support.tiny import harness


class Good:
    """Holds its speed, with a memory kept as it has to be: it brakes softly from its tenth decision on."""

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


class Flat(Good):
    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        return np.zeros(2)


class Listing(Good):
    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        return [[0.0, 0.0]]  # type: ignore[return-value]


class Endless(Good):
    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        return np.full((len(games), 2), np.nan)


class Strong(Good):
    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        return np.full((len(games), 2), 1.5)


class Writing(Good):
    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        observation *= 2.0
        return np.zeros((len(games), 2))


class Raising(Good):
    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        if observation[0, LAYOUT.index("speed_mps")] >= 0.0:
            raise KeyError("no such lane")
        return super().decide(games, observation, noise)


class Forgetful(Good):
    """Never forgets: its second game is driven on."""

    def reset(self, games: IntArray) -> None:
        for game in games.tolist():
            self.steps.setdefault(game, 0)


class Dicing(Good):
    def __init__(self) -> None:
        super().__init__()
        self.chance = np.random.default_rng(1)

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        return 0.01 * self.chance.standard_normal((len(games), 2)).clip(-1.0, 1.0)


class Sharing(Good):
    """One memory for all its games."""

    def reset(self, games: IntArray) -> None:
        self.steps = {-1: 0}

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        actions = super().decide(np.array([-1]), observation, noise)
        return np.repeat(actions, len(games), axis=0)


class Averaging(Good):
    """Acts on what all its games see."""

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        return np.repeat(0.01 * observation.mean(axis=0, keepdims=True)[:, :2], len(games), axis=0).astype(float)


def test_check__a_good_driver_is_told_so(merge: OpenScene) -> None:
    found = check_conformance(Good(), merge, 2)
    assert found.wrong == []
    assert len(found.right) == 3
    assert len(found.outcomes) == 2
    assert min(found.seconds) >= 0.0


@pytest.mark.parametrize(
    ("driver", "said"),
    [
        (Flat, "it decided an array [2], not [1, 2]"),
        (Listing, "it decided list, not a NumPy array"),
        (Endless, "not finite"),
        (Strong, "pedals and wheel go from -1 to 1"),
        (Writing, "it wrote into the observation"),
        (Raising, "playing, game 0, decision 0: it raised KeyError: 'no such lane'"),
        (Forgetful, "it is not deterministic: in decision 0 of game 0"),
        (Dicing, "it is not deterministic"),
        (Sharing, "its games are not independent"),
        (Averaging, "its games are not independent"),
    ],
)
def test_check__what_is_wrong_is_said(driver: type[Good], said: str, merge: OpenScene) -> None:
    (wrong,) = check_conformance(driver(), merge, 2).wrong
    assert said in wrong


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


def test_command__says_what_is_right_and_what_is_wrong(tmp_path: Path) -> None:
    good = harness("check-driver", write(tmp_path), "--allow-code", "--games", 2)
    assert good.returncode == 0, good.stdout + good.stderr
    assert "the same games again: the same actions, bit for bit" in good.stdout
    assert "ms per decision" in good.stdout
    change = 'if "actions" in answer: answer["actions"] = [[0.001 * step, 0]] * len(message["games"])'
    bad = harness("check-driver", write(tmp_path, change), "--allow-code", "--games", 2)
    assert bad.returncode == 1
    assert "it is not deterministic" in bad.stdout


def test_command__runs_no_program_without_leave(tmp_path: Path) -> None:
    refused = harness("check-driver", write(tmp_path, 'open("ran", "w").close()'))
    assert refused.returncode == 2
    assert len(refused.stderr.splitlines()) == 1
    assert "--allow-code" in refused.stderr
    assert not (tmp_path / "ran").exists()


def test_command__checks_a_driver_by_rules() -> None:
    done = harness("check-driver", REPOSITORY / "egos" / "adas.toml", "--games", 2)
    assert done.returncode == 0, done.stdout + done.stderr
