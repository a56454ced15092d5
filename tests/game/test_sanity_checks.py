"""Invalid numbers: each is injected at its source and reported in the step in which it occurs."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import libsumo
import numpy as np
import pytest

import harness.environments.arena
from harness.campaign.execution.cache_keys import stage_keys
from harness.campaign.execution.run_stage import carry_out
from harness.campaign.execution.stage_run import StageRun, run_context_of
from harness.campaign.plan.plan import plan
from harness.campaign.preflight import open_campaign
from harness.campaign.storage.run_folder import RunFolder
from harness.drivers.sumo import SumoDriver
from harness.errors import StageFailed, UsageError
from harness.evaluation.measured_game import METRICS_OF_PLAYERS
from harness.evaluation.metrics import Metric
from harness.game.arrays import FloatArray, IntArray
from harness.game.observation import observe
from harness.game.observation_layout import LAYOUT
from harness.game.outcome import Outcome
from harness.game.payoff import FuzzyFunction, FuzzySet, Payoff, Weighted
from harness.game.payoff_terms import FUZZY_QUANTITIES, GROUPS, TERMS
from harness.game.quantities import Quantities
from harness.game.roles import EGO, NON_EGO, ROLES
from harness.game.sanity_checks import ImpossibleNumber, check_observation, checked_decisions
from harness.game.state import Bodies, State
from harness.road.scene.open_scene import OpenScene, open_scene
from harness.sumo.libsumo_simulation import LibsumoSimulation
from harness.sumo.simulation import Reading
from tests.support.rollouts import Steady, arm, play, records
from tests.support.scenes import build_scene
from tests.support.tiny import PAPER_MERGE, write_campaign

STEP = 5  # the step with a fault


def error_in(scene: OpenScene) -> str:
    """The error of a game in which SUMO drives the non-ego."""
    (game,) = play(arm(scene, Steady(), SumoDriver()), 1)
    return str(game.record["error"])


# --- drivers ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("decided", "expected"),
    [
        ([[np.nan, np.nan]], r"\[nan, nan\], not from -1 to 1, in step 5"),
        ([[0.0, np.inf]], r"\[0.0, inf\], not from -1 to 1"),
        ([[-1.5, 0.0]], r"\[-1.5, 0.0\], not from -1 to 1"),
        ([[0.0, 1.0 + 1e-9]], r"\[0.0, 1.0+1\], not from -1 to 1"),
        ([0.0, 0.0], r"an array of shape \[2\], not \[1, 2\]"),
        (0.0, r"an array of shape \[\], not \[1, 2\]"),
        (np.zeros((2, 2)), r"an array of shape \[2, 2\], not \[1, 2\]"),
        (np.zeros((1, 3)), r"an array of shape \[1, 3\], not \[1, 2\]"),
        (None, r"an array of shape \[\]"),
        ([["full", "left"]], r"\[\['full', 'left'\]\], which are not numbers, in step 5"),
        ([[0.0, 0.0], [0.0]], r"\[\[0.0, 0.0\], \[0.0\]\], which are not numbers,"),
    ],
)
def test_decision__that_is_impossible_is_named_with_driver_and_step(decided: Any, expected: str) -> None:
    with pytest.raises(ImpossibleNumber, match=f"^the driver of non_ego, Rash, decided {expected}"):
        checked_decisions(decided, "non_ego, Rash,", np.array([0]), np.array([STEP - 1]))


class Misbehaving(Steady):
    """Decides no number in the fifth step of every second game."""

    def __init__(self) -> None:
        super().__init__()
        self._games, self._steps = 0, 0

    def reset(self, games: IntArray) -> None:
        self._games, self._steps = self._games + 1, 0

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> Any:
        self._steps += 1
        return np.full((len(games), 2), np.nan if self._games % 2 == 0 and self._steps == STEP else 0.0)


def test_driver__that_misbehaves_is_an_error_row_with_driver_and_step(merge: OpenScene) -> None:
    games = play(arm(merge, SumoDriver(), Misbehaving()), 4)
    unharmed = play(arm(merge, SumoDriver(), Steady()), 4)
    assert [game.record["episode"] for game in games] == [0, 1, 2, 3]
    assert records(games[::2]) == records(unharmed[::2])
    for game in games[1::2]:
        assert game.record["ego_outcome"] == "error"
        pattern = rf"ImpossibleNumber: the driver of non_ego, Misbehaving, decided .* in step {STEP}\b"
        assert re.match(pattern, game.record["error"]), game.record["error"]
        assert game.trace is None


def test_driver__may_decide_the_bounds(merge: OpenScene) -> None:
    class Flat(Steady):
        def decide(self, games: IntArray, *_: Any) -> Any:
            return [[1, -1]] * len(games)  # lists of integers are valid actions

    (game,) = play(arm(merge, Flat(), None), 1)
    assert not game.record["error"]


# --- payoffs ----------------------------------------------------------------------------------------------------------


def faulty(quantity: Any, value: float) -> property:
    """A quantity with an invalid value from the fifth step on."""
    return property(lambda q: np.where(q.state.step[:, None] >= STEP, value, quantity.__get__(q, Quantities)))


@pytest.mark.parametrize("value", [np.nan, -np.inf])
def test_payoff__that_is_not_finite_is_an_error_row_with_step(
    value: float, merge: OpenScene, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Quantities, "lane_offset_m", faulty(Quantities.lane_offset_m, value))
    assessed = arm(merge, Steady(), SumoDriver())
    assert "lane_offset" in {term.name for term in assessed.drivers[EGO].members[0].persona.payoff.terms}
    (game,) = play(assessed, 1)
    assert re.match(rf"ImpossibleNumber: the payoff of ego is (nan|inf) in step {STEP}$", game.record["error"])


def test_payoff__that_is_not_finite_fails_a_training_stage_by_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    campaign = open_campaign(write_campaign(tmp_path))
    folder = RunFolder(tmp_path / "run")
    folder.claim("tiny")
    folder.keep_scene(PAPER_MERGE, ("scene.toml", "paper_merge.net.xml", "paper_merge.rou.xml"))
    stages = plan(campaign.document, ["speedy"])
    keys = stage_keys(campaign, stages)
    monkeypatch.setattr(Quantities, "lane_offset_m", faulty(Quantities.lane_offset_m, np.nan))
    expected = rf"^naive-seed1: the payoff of ego is nan in step {STEP} of game 0, in a demonstration$"
    with pytest.raises(StageFailed, match=expected):
        carry_out(stages[0], StageRun(context=run_context_of(campaign, folder, keys)))
    assert folder.finished(stages[0].id, keys[stages[0].id]) is None
    assert not folder.policy(stages[0].id).exists()


# --- motion -----------------------------------------------------------------------------------------------------------


def displace_in_sumo(monkeypatch: pytest.MonkeyPatch, far_m: float) -> None:
    """In the fifth step of every second game SUMO moves its non-ego by an extra distance along its lane."""
    steps = {"now": 0, "games": 0}
    reset, step = LibsumoSimulation.reset, LibsumoSimulation.step

    def counted_reset(simulation: LibsumoSimulation, *arguments: Any) -> Any:
        steps.update(now=0, games=steps["games"] + 1)
        return reset(simulation, *arguments)

    def displaced_step(simulation: LibsumoSimulation, *poses: FloatArray) -> Any:
        steps["now"] += 1
        if steps["now"] == STEP and steps["games"] % 2 == 0:
            vehicle = libsumo.vehicle
            vehicle.moveTo("non_ego", vehicle.getLaneID("non_ego"), vehicle.getLanePosition("non_ego") + far_m)
        return step(simulation, *poses)

    monkeypatch.setattr(LibsumoSimulation, "reset", counted_reset)
    monkeypatch.setattr(LibsumoSimulation, "step", displaced_step)


def test_motion__a_player_that_sumo_displaces_is_an_error_row_with_step_and_distance(
    straight: OpenScene, monkeypatch: pytest.MonkeyPatch
) -> None:
    unharmed = play(arm(straight, Steady(), SumoDriver()), 4)
    displace_in_sumo(monkeypatch, 50.0)
    games = play(arm(straight, Steady(), SumoDriver()), 4)
    assert records(games[::2]) == records(unharmed[::2])
    for game in games[1::2]:
        found = re.match(
            rf"ImpossibleNumber: non_ego moved ([\d.]+) m in step {STEP}, in 0.1 s at ([\d.]+) m/s$",
            game.record["error"],
        )
        assert found, game.record["error"]
        moved_m, speed_mps = map(float, found.groups())
        assert moved_m == pytest.approx(50.0 + 0.1 * speed_mps, abs=0.02)


@pytest.mark.parametrize(("farther_m", "faulty"), [(50.0, True), (0.01, True), (1e-4, False)])
def test_motion__a_car_that_the_harness_moves_follows_its_speed_to_a_millimetre(
    farther_m: float, faulty: bool, merge: OpenScene, monkeypatch: pytest.MonkeyPatch
) -> None:
    drive = harness.environments.arena.move

    def drive_too_far(state: State, *rest: Any) -> None:
        drive(state, *rest)
        if state.step[0] + 1 == STEP:
            state.x_m[0, EGO] += farther_m

    monkeypatch.setattr(harness.environments.arena, "move", drive_too_far)
    pattern = rf"ImpossibleNumber: ego moved [\d.]+ m in step {STEP}, " if faulty else "$"
    assert re.match(pattern, error_in(merge))


@pytest.mark.parametrize("name", ["x_m", "y_m", "heading_rad", "speed_mps", "acceleration_mps2", "steering_rad"])
def test_motion__that_is_not_finite_is_named(name: str, merge: OpenScene, monkeypatch: pytest.MonkeyPatch) -> None:
    write_to = Reading.write_to

    def lose(reading: Reading, state: State, *arguments: Any) -> None:
        write_to(reading, state, *arguments)
        if state.step[0] + 1 == STEP:
            getattr(state, name)[0, NON_EGO] = np.nan

    monkeypatch.setattr(Reading, "write_to", lose)
    assert f"the motion of non_ego is not finite in step {STEP}: " in error_in(merge)


def test_motion__of_a_background_vehicle_that_is_not_finite_is_an_error_row(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    van = '<vehicle id="v" type="van" depart="0" departPos="60" departSpeed="9"><route edges="road"/></vehicle>'
    scene = build_scene(tmp_path, others=van)
    step = LibsumoSimulation.step

    def lose(simulation: LibsumoSimulation, *poses: FloatArray) -> Any:
        reading = step(simulation, *poses)
        if libsumo.simulation.getTime() > (STEP - 0.5) * 0.1:
            reading.speed_mps[:] = np.nan
        return reading

    assert not error_in(scene)
    monkeypatch.setattr(LibsumoSimulation, "step", lose)
    assert error_in(scene).endswith(f"a background vehicle has no finite position, heading or speed in step {STEP}")


# --- observations -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("value", [1.0001, -2.0, np.nan, np.inf])
def test_observation__out_of_its_bounds_is_an_error_row_with_entry_and_step(
    value: float, merge: OpenScene, monkeypatch: pytest.MonkeyPatch
) -> None:
    entry = LAYOUT.index("goal_m")

    def faulty_observe(q: Quantities, perceived: object = None) -> FloatArray:
        view = observe(q)
        view[q.state.step == STEP, NON_EGO, entry] = value
        return view

    monkeypatch.setattr(harness.environments.knowledge, "observe", faulty_observe)
    expected = rf"ImpossibleNumber: non_ego sees goal_m as {np.float32(value)} in step {STEP}, not from -1 to 1$"
    assert re.match(expected, error_in(merge))


def test_observation__of_a_reset_is_checked_too(merge: OpenScene, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(harness.environments.knowledge, "observe", lambda q, *perceived: observe(q) + np.float32(2.0))
    assert "in step 0, not from -1 to 1" in error_in(merge)


# --- every term can be computed in every scene ------------------------------------------------------------------------


@pytest.fixture(scope="module", params=["straight", "merge"])
def everywhere(request: pytest.FixtureRequest) -> Quantities:
    """Games with both players at each station of their routes: at rest and at top speed, on the route's line, beside
    the road and turned round. In the last games the non-ego is not present."""
    scene: OpenScene = request.getfixturevalue(request.param)
    routes = scene.world.road.routes
    rows = np.arange(min(routes.last_row - routes.first_row) + 1)
    kinds = [(speed, left, turned) for speed in (0.0, 1.0) for left in (0.0, 20.0) for turned in (0.0, np.pi)]
    state = State.empty(len(rows) * len(kinds), len(ROLES))
    for player in (EGO, NON_EGO):
        at = routes.first_row[player] + rows
        heading = routes.heading_rad[at]
        for k, (speed, left, turned) in enumerate(kinds):
            games = slice(k * len(rows), (k + 1) * len(rows))
            state.x_m[games, player] = routes.x_m[at] - left * np.sin(heading)
            state.y_m[games, player] = routes.y_m[at] + left * np.cos(heading)
            state.heading_rad[games, player] = heading + turned
            state.speed_mps[games, player] = speed * scene.world.actuators.max_speed_mps[player]
            state.station_m[games, player] = 0.5 * rows - 100.0
    state.present[:] = True
    state.present[-len(rows) :, NON_EGO] = False
    size = (np.tile(each, (len(state.step), 1)) for each in (scene.world.length_m, scene.world.width_m))
    poses = (state.x_m, state.y_m, state.heading_rad, state.speed_mps)
    state.station_m, offset = routes.locate(state.x_m, state.y_m, state.station_m)
    return Quantities(
        scene.world, state, Bodies(*poses, *size, state.present), np.zeros_like(offset), offset, np.zeros_like(offset)
    )


LOW = FuzzySet(name="low", inputs=(0.0, 1.0), memberships=(1.0, 0.0), value=-1.0)
HIGH = FuzzySet(name="high", inputs=(0.0, 1.0), memberships=(0.0, 1.0), value=2.0)
PAYOFFS: dict[str, dict[str, Any]] = {
    **{
        name: {"terms": (Weighted(name=name, weight=1.0, parameter=2.0 if term.parameter else None),), "fuzzy": {}}
        for name, term in TERMS.items()
    },
    **{
        f"fuzzy {name}": {"terms": (), "fuzzy": {"fuzzy": (1.0, FuzzyFunction(name, (LOW, HIGH)))}}
        for name in FUZZY_QUANTITIES
    },
}


@pytest.mark.parametrize("name", PAYOFFS)
def test_payoff__can_be_computed_at_every_place_of_every_route(name: str, everywhere: Quantities) -> None:
    payoff = Payoff(alpha=dict.fromkeys(GROUPS, 1.0), **PAYOFFS[name])
    for player in (EGO, NON_EGO):
        total = payoff.total(everywhere, player)
        assert total.shape == everywhere.state.step.shape
        assert np.isfinite(total).all()


def test_quantities__of_fuzzy_terms_are_numbers_at_every_place_of_every_route(everywhere: Quantities) -> None:
    for name in FUZZY_QUANTITIES:
        assert not np.isnan(getattr(everywhere, name)).any(), name  # without a leader the gap is infinite


def test_observation__can_be_made_at_every_place_of_every_route(everywhere: Quantities) -> None:
    games = np.arange(len(everywhere.state.step))
    check_observation(observe(everywhere), games, everywhere.state.step)


@pytest.mark.parametrize("metric", METRICS_OF_PLAYERS, ids=lambda each: each.column.name)
def test_metric__is_a_number_or_unmeasured_at_every_place_of_every_route(
    metric: Metric, everywhere: Quantities
) -> None:
    for outcome in (Outcome.GOAL, Outcome.RAIL):
        for place in (0, len(everywhere.state.step) - 1):
            drive: Any = SimpleNamespace(
                outcome=outcome,
                step_s=0.1,
                player=0,
                game=SimpleNamespace(steers=(True,)),
                encounters=(),
                flags=lambda column: None,
                share=lambda column: None,
                payoff=np.zeros(1),
                acceleration_mps2=everywhere.state.acceleration_mps2[place, :1],
                of=lambda name, place=place: getattr(everywhere, name)[place, :1],
            )
            value = metric.of(drive)
            assert value is None or np.isfinite(value)


@pytest.mark.parametrize("limit", ["0.00", "-5", "nan", "inf"])
def test_scene__without_a_speed_limit_on_a_players_route_is_refused(limit: str, tmp_path: Path) -> None:
    """Shares of the speed limit are the only quantities that a scene can leave undefined."""
    net = Path(shutil.copytree(PAPER_MERGE, tmp_path / "merge")) / "paper_merge.net.xml"
    text = re.sub(r'(<lane id="exit_[^>]*?) speed="[^"]*"', rf'\1 speed="{limit}"', net.read_text())
    assert text != net.read_text()
    net.write_text(text)
    with pytest.raises(UsageError) as raised:
        open_scene(net.parent)
    assert {(Path(each.file), each.key.rsplit(".")[-1]) for each in raised.value.problems} == {(net, "speed")}
