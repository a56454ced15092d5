"""A game whose equilibria are known, played and measured by the harness itself.

Two cars drive side by side for 3 s, in lanes of their own and without a steering wheel to speak of. Each wants to be
far from the other, and nothing else. A strategy is all that a player may do with its pedals.

    payoff    = -weight * sum over the steps of (1 - clearance / 10 m) * step length
    clearance = hypot(1.4 m, max(|ahead| - 2.5 m, 0)), ahead: how far the centre of one car is ahead of the other's

*The pure equilibria.* Against full throttle, full throttle keeps a car beside the other: from no start is it 2.5 m
ahead or behind within the time. Full brakes take it back farther than anything else does, and the clearance grows with
every metre. So full brakes are best, in every step of every game; and so is full throttle against full brakes. Hence
(fast, slow) and (slow, fast) are equilibria. (fast, fast) and (slow, slow) are none: in them a player could gain what
the formula says.

*The mixed one.* 1 - clearance / 10 m is a concave function of `ahead`, as far as that can come. Somebody who can't see
whether the other is fast or slow, half of the games each, therefore does best at one of the ends, and as well at the
one as at the other. Half and half is the equilibrium of drivers who do not look. Who looks does the other's opposite.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from harness.assessment.seated_arm import SeatedArm
from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.drivers.car import car_of
from harness.drivers.mixture import Member, Mixture, mixture_of
from harness.drivers.policy_file import LearnedDriver, Policy, write_policy
from harness.drivers.protocol import Driver
from harness.evaluation.game_theory.best_response_gap import NOTHING_TO_GAIN, Response, gaps, nothing_to_gain
from harness.evaluation.gap_verdict import GapVerdict
from harness.evaluation.tables import table_of
from harness.game.arrays import FloatArray, IntArray
from harness.game.human_factors import HumanFactors
from harness.game.initial_state import draw_initial_state
from harness.game.observation_layout import LAYOUT, SIZE
from harness.game.roles import EGO, ROLES
from harness.game.seeding import parts_of
from harness.road.scene.open_scene import OpenScene, open_scene
from tests.support.rollouts import assess
from tests.support.scenes import build_scene
from tests.support.shared import built_once
from tests.support.tiny import finished

STEPS, STEP_S, PEDALS_MPS2 = 15, 0.2, 1.1
LENGTH_M, BESIDE_M, FAR_M = 2.5, 1.4, 10.0
MOST_AHEAD_M, MOST_FASTER_MPS = 0.5, 0.25  # how the non-ego starts, compared with the ego
WEIGHTS = {"ego": 2.0, "non_ego": 5.0}
FAST, SLOW = 1.0, -1.0
FOUND = 0.5  # the share of what there is to gain that a training has to find, on whatever processor

CARS = "".join(
    f'<vType id="{each}_car" length="{LENGTH_M}" width="1.8" maxSpeed="40" speedFactor="1.0" speedDev="0.0"/>'
    for each in ("ego", "person")
)
CAR = (
    f"{{ max_acceleration_mps2 = {PEDALS_MPS2}, max_braking_mps2 = {PEDALS_MPS2}, max_steering_rad = 1e-20, "
    "wheelbase_m = 1.8, throttle_lag_s = 0.0, brake_lag_s = 0.0, max_jerk_mps3 = 100.0 }"
)
SCENE = f"""name = "side_by_side"
net = "n.net.xml"
routes = "n.rou.xml"
step_length_s = {STEP_S}
time_limit_s = {STEPS * STEP_S}
followed_share = 0.0
goal = {{ edge = "road", position_m = 250.0 }}
[ego]
vehicle = "ego"
lane = "road_0"
position_m = [50.0, 50.0]
speed_mps = [15.0, 15.0]
actuators = {CAR}
[[non_ego]]
vehicle = "non_ego"
lane = "road_1"
beside_ego_m = [{-MOST_AHEAD_M}, {MOST_AHEAD_M}]
speed_mps = [{15.0 - MOST_FASTER_MPS}, {15.0 + MOST_FASTER_MPS}]
actuators = {CAR}
"""
PERSONA = """name = "{name}"
description = "Somebody who wants to be left alone."
[[sources]]
statistic = "Nobody has counted them."
citation = "nobody, nowhere"
[safety.terms]
vehicle_clearance = {{ weight = {weight}, within_m = 10.0 }}
[reaction]
delay_s = [0.0, 0.0]
[perception]
distance_error = 0.0
closing_error_per_s = 0.0
"""
BLIND = "range_m = 0.1\n"
TRAINING: dict[str, Any] = {
    "steps": 16_384,
    "segment_steps": 16_384,
    "games": 64,
    "buffer": 64 * STEPS,
    "minibatch": 240,
    "epochs": 10,
    "network": [8],
    "learning_rate": 0.02,
    "clip": 0.3,
    "discount": 1.0,
    "entropy_coefficient": 0.0,
    "demonstration_steps": 0,
    "initial_deviation": 1.0,
    "max_deviation": 1.0,
    "payoff_scale": 1.0,
}


# --- by hand ---------------------------------------------------------------


def by_hand(ahead_m: Any, faster_mps: Any, ego: Any, non_ego: Any) -> FloatArray:
    """[...] the payoff of a player of weight 1, which is the same for both: how far ahead and how much faster the ego
    starts, [...], and both players' pedals, a number or one for each step [..., T]."""
    own, other = (np.broadcast_to(each, (*np.shape(each)[:-1], STEPS)) for each in (ego, non_ego))
    faster = np.expand_dims(faster_mps, -1) + PEDALS_MPS2 * STEP_S * np.cumsum(own - other, -1)
    ahead = np.expand_dims(ahead_m, -1) + STEP_S * np.cumsum(faster, -1)
    clearance = np.hypot(BESIDE_M, np.maximum(np.abs(ahead) - LENGTH_M, 0.0))
    assert clearance.max() < FAR_M  # or it would not be concave
    return np.asarray(-STEP_S * (1.0 - clearance / FAR_M).sum(-1))


def all_starts() -> tuple[FloatArray, FloatArray]:
    """The starts there may be: how far ahead and how much faster the ego is, evenly spread [S]."""
    middles = (np.arange(20) + 0.5) / 10.0 - 1.0
    ahead, faster = np.meshgrid(MOST_AHEAD_M * middles, MOST_FASTER_MPS * middles)
    return ahead.ravel(), faster.ravel()


def starts_of(scene: OpenScene, episodes: Iterable[int]) -> tuple[FloatArray, FloatArray]:
    """How far ahead and how much faster the ego starts in episodes of seed 1, [N] each."""
    start_distribution = scene.start_distribution([HumanFactors(), HumanFactors()], [1.0, 1.0])
    starts = [draw_initial_state(start_distribution, *parts_of(1, episode)) for episode in episodes]
    ahead, faster = (np.array([-np.diff(getattr(each, name))[0] for each in starts]) for name in ("x_m", "speed_mps"))
    return ahead, faster


def some_pedals() -> FloatArray:
    """[K, T] what a driver might do instead: at random, and changing from one end to the other."""
    chance = np.random.default_rng(1)
    wild = chance.uniform(-1.0, 1.0, (200, STEPS))
    steady = chance.uniform(-1.0, 1.0, (100, 1)).repeat(STEPS, 1)
    changing = np.where(np.arange(STEPS) < np.arange(STEPS + 1)[:, None], FAST, SLOW)
    return np.concatenate([wild, steady, np.sign(wild), changing, -changing])


@pytest.mark.parametrize("other", [FAST, SLOW])
def test_by_hand__nothing_does_better_against_an_end_than_the_other_end(other: float) -> None:
    ahead, faster = all_starts()
    opposite = by_hand(ahead, faster, -other, other)
    assert (opposite > by_hand(ahead, faster, other, other) + 0.05).all()
    for pedals in some_pedals():
        assert (by_hand(ahead, faster, pedals, other) <= opposite + 1e-12).all()
        assert (by_hand(ahead, faster, other, pedals) <= by_hand(ahead, faster, other, -other) + 1e-12).all()


def test_by_hand__nothing_does_better_blindly_against_half_and_half_than_either_end() -> None:
    ahead, faster = all_starts()

    def earned(pedals: Any) -> float:
        return float(np.mean([by_hand(ahead, faster, pedals, other) for other in (FAST, SLOW)]))

    assert earned(FAST) == pytest.approx(earned(SLOW))
    assert max(map(earned, some_pedals())) <= earned(FAST) + 1e-12
    assert earned(0.0) < earned(FAST) - 0.01


# --- played ---------------------------------------------------------------


def always(pedals: float, stage: str = "") -> Policy:
    """A policy that does one thing, with a network that may learn to do another."""
    chance = np.random.default_rng(1)
    tensors: dict[str, FloatArray] = {"log_deviation": np.zeros(2)}
    for part, output in (("actor", [3.0 * pedals, 0.0]), ("critic", [0.0])):
        tensors |= {f"{part}.0.weight": chance.normal(0.0, 0.3, (8, SIZE)), f"{part}.0.bias": np.zeros(8)}
        tensors |= {f"{part}.1.weight": np.zeros((len(output), 8)), f"{part}.1.bias": np.array(output)}
    return Policy({name: tensor.astype(np.float32) for name, tensor in tensors.items()}, {"stage": stage})


@pytest.fixture(scope="module")
def folder() -> Path:
    """Scene, personas and strategies: the naive ego and `other` are fast, those who answer are slow."""
    return built_once("known_equilibrium", write_known)


def write_known(folder: Path) -> None:
    build_scene(folder / "scene", cars=CARS)
    (folder / "scene" / "scene.toml").write_text(SCENE)
    (folder / "ego.toml").write_text(PERSONA.format(name="alone", weight=WEIGHTS["ego"]))
    (folder / "other.toml").write_text(PERSONA.format(name="other", weight=WEIGHTS["non_ego"]))
    (folder / "blind.toml").write_text(PERSONA.format(name="blind", weight=1.0) + BLIND)
    (folder / "seeing.toml").write_text(PERSONA.format(name="seeing", weight=1.0))
    for name, pedals in (("naive", FAST), ("retrained_other", SLOW), ("other", FAST), ("other_round3", SLOW)):
        write_policy(always(pedals, f"{name}-seed1"), folder / "policies" / f"{name}-seed1")


@pytest.fixture(scope="module")
def scene(folder: Path) -> OpenScene:
    return open_scene(folder / "scene")


@dataclass(frozen=True)
class Matrix:
    """What the campaign of both players' two strategies came to, and the starts of its episodes."""

    run: Path
    ahead_m: FloatArray
    faster_mps: FloatArray

    def table(self, name: str) -> pd.DataFrame:
        return pd.read_csv(self.run / f"{name}.csv")

    def payoffs(self, arm: str, role: str) -> FloatArray:
        episodes = self.table("episodes")
        return episodes[episodes["arm"] == arm].sort_values("episode")[f"{role}_payoff"].to_numpy()

    def by_hand(self, ego: float, non_ego: float) -> FloatArray:
        return by_hand(self.ahead_m, self.faster_mps, ego, non_ego)


CELLS = {
    "naive_vs_other": (FAST, FAST),
    "naive_vs_other_round3": (FAST, SLOW),
    "retrained_vs_other": (SLOW, FAST),
    "retrained_other_vs_other_round3": (SLOW, SLOW),
}
EQUILIBRIUM, NO_EQUILIBRIA = "retrained_vs_other", ("naive_vs_other", "retrained_other_vs_other_round3")
MEASURED = (EQUILIBRIUM, *NO_EQUILIBRIA)


@pytest.fixture(scope="module")
def matrix(folder: Path, scene: OpenScene) -> Matrix:
    """Every cell played, and both players' best responses searched in three of them."""
    run = finished(
        name="matrix",
        scene=str(folder / "scene"),
        personas=[str(folder / "other.toml")],
        ego={"persona": str(folder / "ego.toml")},
        policies=str(folder / "policies"),
        training=TRAINING,
        rounds={"count": 3, "stop_early": False},
        best_response={"steps": TRAINING["steps"], "starts": 2, "arms": list(MEASURED)},
        crossplay={},
        assessment={"episodes": 20},
    )
    return Matrix(run, *starts_of(scene, range(20)))


@pytest.mark.slow
def test_matrix__each_game_pays_what_the_formula_says(matrix: Matrix) -> None:
    for arm, pedals in CELLS.items():
        for role in ROLES:
            expected = WEIGHTS[role] * matrix.by_hand(*pedals)
            np.testing.assert_allclose(matrix.payoffs(arm, role), expected, rtol=1e-9, err_msg=f"{arm}, {role}")


@pytest.mark.slow
def test_matrix__its_equilibria_are_the_known_ones(matrix: Matrix) -> None:
    table = matrix.table("equilibria")
    nash = table[(table["game"] == "other") & (table["solution"] == "nash")]
    found = {tuple(rows.set_index("player")["share"].round(6)) for _, rows in nash.groupby("number")}
    near, ahead, behind = (matrix.by_hand(*pedals).mean() for pedals in ((FAST, FAST), (FAST, SLOW), (SLOW, FAST)))
    share = (behind - near) / (ahead + behind - 2.0 * near)  # of fast: the other is then as well off with either
    assert list(nash["player"][:4]) == ["naive", "retrained_other", "other", "other_round3"]
    assert share == pytest.approx(0.5, abs=0.1)
    mixed = next(each for each in found if 0.0 < each[0] < 1.0)
    assert mixed == pytest.approx((share, 1.0 - share, 1.0 - share, share), abs=1e-5)
    assert found - {mixed} == {(1.0, 0.0, 0.0, 1.0), (0.0, 1.0, 1.0, 0.0)}
    assert (nash["regret"] < 1e-9).all()


def gaps_of(matrix: Matrix, arm: str) -> pd.DataFrame:
    """The rows of both players of a pair, by role."""
    table = matrix.table("gaps")
    ego, non_ego = arm.split("_vs_")
    pair = (table["ego"] == {"retrained": "retrained_other"}.get(ego, ego)) & (table["non_ego"] == non_ego)
    return table[pair].set_index("role", drop=False)


@pytest.mark.slow
@pytest.mark.parametrize("role", ROLES)
def test_gap__at_an_equilibrium_there_is_none(role: str, matrix: Matrix) -> None:
    row = gaps_of(matrix, EQUILIBRIUM).loc[role]
    won = matrix.payoffs(f"{EQUILIBRIUM}_{role}_response", role) - matrix.payoffs(EQUILIBRIUM, role)
    assert (row["pairs"], row["known"]) == (20, 2)
    assert won.max() <= 1e-9  # whatever was learned
    assert GapVerdict(row["verdict"]) in NOTHING_TO_GAIN
    assert row["gap"] == 0.0 if np.isnan(row["ci_low"]) else row["ci_low"] <= 0.0 <= row["ci_high"]


@pytest.mark.slow
@pytest.mark.parametrize("role", ROLES)
@pytest.mark.parametrize("arm", NO_EQUILIBRIA)
def test_gap__away_from_one_it_is_what_the_formula_says(arm: str, role: str, matrix: Matrix) -> None:
    row, both = gaps_of(matrix, arm).loc[role], CELLS[arm][0]
    better = (-both, both) if role == "ego" else (both, -both)
    won = matrix.payoffs(f"{arm}_{role}_response", role) - matrix.payoffs(arm, role)
    in_these = WEIGHTS[role] * (matrix.by_hand(*better) - matrix.by_hand(both, both)).mean()
    ahead, faster = all_starts()
    in_all = WEIGHTS[role] * (by_hand(ahead, faster, *better) - by_hand(ahead, faster, both, both)).mean()
    assert GapVerdict(row["verdict"]) == GapVerdict.DISTINGUISHABLE
    assert row["gap"] == pytest.approx(in_these)  # the other strategy of the campaign is the best response
    assert row["ci_low"] < in_all < row["ci_high"]
    assert row["search_gap"] == pytest.approx(won.mean())
    assert (won <= WEIGHTS[role] * (matrix.by_hand(*better) - matrix.by_hand(both, both)) + 1e-9).all()
    assert row["search_gap"] > FOUND * in_these


@pytest.mark.slow
@pytest.mark.parametrize("role", ROLES)
@pytest.mark.parametrize("arm", NO_EQUILIBRIA)
def test_gap__a_search_from_what_a_player_does_would_not_have_found_it(arm: str, role: str, matrix: Matrix) -> None:
    """A little less throttle changes nothing, as both are beside one another still: that is what other starts are
    for."""
    stages = json.loads((matrix.run / "manifest.json").read_text(encoding="utf-8"))["stages"]
    entry, own = stages[f"{arm}_{role}_response-seed1"], matrix.payoffs(arm, role).mean()
    from_own, from_nothing = (f"{arm}_{role}_response{k}-seed1" for k in (1, 2))
    assert entry["earned"][from_own] == pytest.approx(own)
    assert entry["earned"][from_nothing] > own + 0.05 * WEIGHTS[role]
    assert entry["chosen"] == from_nothing


@pytest.mark.slow
def test_gap__an_exchange_would_end_at_the_equilibrium_and_nowhere_else(matrix: Matrix) -> None:
    assert {arm for arm in MEASURED if nothing_to_gain(gaps_of(matrix, arm))} == {EQUILIBRIUM}


# --- by the toss of a coin ---------------------------------------------------------------


@dataclass(frozen=True)
class Coin:
    """Both players fast in half of the games, and slow in the others: each as the start of the game says."""

    scene: OpenScene
    personas: tuple[Persona, Persona]

    @property
    def player(self) -> Mixture:
        drivers = (LearnedDriver(always(each), sampled=False) for each in (FAST, SLOW))
        return Mixture(tuple(Member(driver=each, persona=self.personas[1]) for each in drivers))

    def games(self, arm: str, ego: Mixture, episodes: int = 40) -> pd.DataFrame:
        played = assess(SeatedArm(name=arm, scene=self.scene, drivers=(ego, self.player), seed=1), range(episodes))
        rows = pd.DataFrame([{"arm": arm, "persona": "blind", "seed": 1, **game.record} for game in played])
        return table_of("episodes", rows.to_dict("records"))

    def gap(self, response: Driver) -> pd.Series:
        asked = Response(
            seed=1,
            role="ego",
            persona="blind",
            round=2,
            pair_arm="pair",
            response_arm="response",
            ego="coin",
            non_ego="coin",
            search_steps=600_000,
            search_starts=2,
        )
        answer = mixture_of(response, self.personas[EGO])
        episodes = pd.concat([self.games("pair", self.player), self.games("response", answer)], ignore_index=True)
        (row,) = gaps([asked], episodes, 0.01).iloc
        return row

    def fell(self) -> FloatArray:
        """[2, E, 1] the pedals of both players in each episode, as their coins fell."""
        human_factors = [[each.human_factors] * 2 for each in self.personas]
        starts = self.scene.start_distribution(human_factors, [1.0, 1.0], [[1.0, 1.0]] * 2)
        members = [draw_initial_state(starts, *parts_of(1, episode)).member for episode in range(40)]
        return np.array([FAST, SLOW])[np.array(members)].T[:, :, None]

    def by_hand(self, ego: FloatArray) -> FloatArray:
        """[E] what both earn in each episode with these pedals of the ego."""
        return by_hand(*starts_of(self.scene, range(40)), ego, self.fell()[1])


def coin_of(name: str, folder: Path, scene: OpenScene) -> Coin:
    ego, other = (read_document(folder / f"{each}.toml", Persona) for each in (name, "blind"))
    return Coin(scene, (ego, other))


class Opposite:
    """Coasts in the first step, then does the opposite of what the other car did in the step before."""

    takes_over = True

    def __init__(self, scene: OpenScene) -> None:
        self._car, self._before = car_of(scene.world, EGO), dict[int, float]()

    def reset(self, games: IntArray) -> None:
        for game in games.tolist():
            self._before.pop(game, None)

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        seen = self._car.physical(observation)
        speeds = seen[:, LAYOUT.index("speed_mps")] + seen[:, LAYOUT.index("other0_ahead_mps")]
        before = [self._before.get(game, speed) for game, speed in zip(games.tolist(), speeds, strict=True)]
        self._before.update(zip(games.tolist(), speeds, strict=True))
        return np.stack([np.sign(np.array(before) - speeds), np.zeros(len(games))], axis=1)


@pytest.mark.parametrize("pedals", [FAST, SLOW])
def test_coin__who_does_not_look_gains_nothing(pedals: float, folder: Path, scene: OpenScene) -> None:
    """The pair is the mixed equilibrium: either end wins where the coin fell ill, and loses where it fell well."""
    coin = coin_of("blind", folder, scene)
    row, fell = coin.gap(LearnedDriver(always(pedals), False)), coin.fell()[0]
    assert row["payoff"] == pytest.approx(coin.by_hand(fell).mean())
    assert row["gap"] == pytest.approx((coin.by_hand(np.full_like(fell, pedals)) - coin.by_hand(fell)).mean())
    assert row["ci_low"] < 0.0 < row["ci_high"]
    assert GapVerdict(row["verdict"]) in NOTHING_TO_GAIN


def test_coin__who_looks_gains_what_the_formula_says(folder: Path, scene: OpenScene) -> None:
    coin = coin_of("seeing", folder, scene)
    row, (ego, other) = coin.gap(Opposite(scene)), coin.fell()
    gained = coin.by_hand(np.array([0.0] + [-1.0] * (STEPS - 1)) * other) - coin.by_hand(ego)
    assert row["gap"] == pytest.approx(gained.mean())
    assert GapVerdict(row["verdict"]) == GapVerdict.DISTINGUISHABLE
    assert row["ci_low"] < gained.mean() < row["ci_high"]
