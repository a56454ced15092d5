"""The rule-based driver: its documents, its perception and control, and whole games on the merge."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from harness.config.driver import read_driver
from harness.config.rule_driver import Cruise, LaneKeeping, Rules
from harness.drivers.adaptive_cruise import cruise_mps2, in_path, target_speed_mps, time_gap_law_mps2
from harness.drivers.car import Car, car_of
from harness.drivers.perception import Encounters, OwnMotion, perceive
from harness.drivers.protocol import Driver
from harness.drivers.rules_driver import RulesDriver, steering_rad
from harness.drivers.sumo import SumoDriver
from harness.game.bicycle import Requested, lateral_acceleration_mps2, move, requests
from harness.game.observation_layout import LAYOUT
from harness.game.road import AHEAD_M
from harness.game.roles import EGO
from harness.game.state import State
from harness.road.scene.open_scene import OpenScene, open_scene
from tests.support import rollouts
from tests.support.observations import observation_of
from tests.support.scenes import build_scene
from tests.support.tiny import PAPER_MERGE

EGOS = ("adas", "careful_and_competent", "fuzzy", "rss")
NOTHING = {"kind": "rules", "name": "somebody", "description": "Somebody who drives by rules."}


@pytest.fixture(scope="module")
def scene() -> OpenScene:
    return open_scene(PAPER_MERGE)


@pytest.fixture(scope="module")
def car(scene: OpenScene) -> Car:
    return car_of(scene.world, EGO)


def rules(**tables: dict[str, float]) -> Rules:
    return Rules.model_validate(NOTHING | tables)


def seeing(speed_mps: float = 13.89, limit_mps: float | None = None, turned: float = 0.0, **other: float) -> np.ndarray:
    """The observation of one game with one other car, from physical units; `turned` is the heading of the path.

    The limit is the own speed unless it is given. The other car is 4.6 m long and 1.8 m wide.
    """
    own = {name: other.pop(name) for name in list(other) if name in LAYOUT}
    values = {"speed_mps": speed_mps, "speed_limit_mps": speed_mps if limit_mps is None else limit_mps, **own}
    values |= {f"path_turned_rad@{d:g}m": turned for d in AHEAD_M}
    if other:
        sin = other.get("turned_sin", 0.0)
        usual = {"seen": 1.0, "turned_cos": np.sqrt(1.0 - sin**2), "length_m": 4.6, "width_m": 1.8}
        values |= {f"other0_{name}": value for name, value in {**usual, **other}.items()}
    return observation_of(values)


# --- documents -----------------------------------------------------------------------------------------------------


def test_rules__have_at_most_one_reaction_to_danger() -> None:
    with pytest.raises(ValidationError, match="one reaction to danger"):
        rules(rss={}, fuzzy={})


def test_fuzzy__hardest_braking_must_exceed_comfortable() -> None:
    with pytest.raises(ValidationError, match="hardest_mps2 must exceed"):
        rules(fuzzy={"comfortable_mps2": 6.0, "hardest_mps2": 6.0})


def test_tunable__each_is_a_parameter_and_accepts_both_bounds() -> None:
    document = rules(emergency_braking={})
    assert len(document.searched) >= 5
    for key, low, high in document.searched:
        table, name = key.split(".")
        default = getattr(getattr(document, table), name)
        assert low <= default <= high
        for value in (low, high):
            assert getattr(getattr(document.tuned({key: value}), table), name) == value


def test_tunable__has_no_parameters_of_missing_tables_or_reference_drivers() -> None:
    assert {each.key.split(".")[0] for each in rules().searched} == {"cruise"}
    assert rules(fuzzy={}).searched == ()
    with pytest.raises(KeyError):
        rules().tuned({"emergency_braking.brakes_ttc_s": 1.0})
    with pytest.raises(ValidationError):
        rules().tuned({"cruise.time_gap_s": 0.1})


# --- what is seen --------------------------------------------------------------------------------------------------


def test_perceive__a_car_ahead_in_the_path(car: Car) -> None:
    view, encounters = perceive(car, seeing(12.0, 15.0, ahead_m=20.0, left_m=0.5, ahead_mps=-4.0))
    assert (view.speed_mps[0], view.speed_limit_mps[0]) == pytest.approx((12.0, 15.0))
    first = {name: values[0, 0] for name, values in encounters._asdict().items()}
    expected = {"gap_m": 15.4, "offset_m": 0.5, "clearance_m": -1.3, "speed_mps": 8.0, "approach_mps": 0.0}
    assert {name: first[name] for name in expected} == pytest.approx(expected)
    assert encounters.seen.tolist() == [[True, False, False, False]]


def test_perceive__a_car_moving_over_approaches_from_either_side(car: Car) -> None:
    for side in (1.0, -1.0):
        other = {"ahead_m": 5.0, "left_m": 3.2 * side, "left_mps": -side, "turned_sin": -side / 10.0}
        _, encounters = perceive(car, seeing(10.0, **other))
        assert encounters.approach_mps[0, 0] == pytest.approx(1.0)
        # turned by asin(0.1), 4.6 m long and 1.8 m wide: 0.5 (0.46 + 1.791) to the side
        assert encounters.clearance_m[0, 0] == pytest.approx(3.2 - 1.12550 - 0.9, abs=1e-4)


def test_perceive__the_path_turns_with_the_road(car: Car) -> None:
    """The path is turned 0.1 rad to the left: 20 m ahead it is 2 m to the left, and a car there is on it."""
    other = {"ahead_m": 20.0, "left_m": 20.0 * np.sin(0.1), "turned_sin": np.sin(0.1), "left_mps": 10.0 * np.sin(0.1)}
    _, encounters = perceive(car, seeing(10.0, turned=0.1, ahead_mps=10.0 * np.cos(0.1) - 10.0, **other))
    assert encounters.offset_m[0, 0] == pytest.approx(0.0, abs=1e-6)
    assert encounters.approach_mps[0, 0] == pytest.approx(0.0, abs=1e-6)
    assert encounters.speed_mps[0, 0] == pytest.approx(10.0)


def test_perceive__a_crossing_car_with_priority(car: Car) -> None:
    """It is 30 m before the place where it crosses the own path, at 12 m/s: 2.5 s. The own car is 18 m before it."""
    crossing = {"left_mps": 12.0, "ahead_mps": -10.0, "turned_sin": 1.0, "has_priority": 1.0}
    places = {"own_to_conflict_m": 18.0, "other_to_conflict_m": 30.0}
    _, encounters = perceive(car, seeing(10.0, ahead_m=20.0, left_m=-30.0, **crossing, **places))
    assert encounters.own_to_conflict_m[0] == pytest.approx([18.0, np.inf, np.inf, np.inf])
    assert encounters.other_to_conflict_s[0] == pytest.approx([2.5, np.inf, np.inf, np.inf])
    assert encounters.has_priority.tolist() == [[True, False, False, False]]
    assert encounters.yielding_mps[0] == pytest.approx([np.inf] * 4), "it need not yield"


@pytest.mark.parametrize(
    ("other", "yielding_mps"),
    [
        ({}, 12.0),
        ({"left_mps": 0.0}, 0.0),
        ({"other_to_conflict_m": 0.0}, np.inf),  # it is there
        ({"has_priority": 0.0}, np.inf),  # their ways do not meet
    ],
)
def test_perceive__the_speed_of_a_car_that_has_to_yield(car: Car, other: dict[str, float], yielding_mps: float) -> None:
    crossing = {"left_mps": 12.0, "ahead_mps": -10.0, "turned_sin": 1.0, "has_priority": -1.0}
    crossing |= {"ahead_m": 20.0, "left_m": -30.0, "own_to_conflict_m": 18.0, "other_to_conflict_m": 30.0}
    _, encounters = perceive(car, seeing(10.0, **(crossing | other)))
    assert encounters.yielding_mps[0] == pytest.approx([yielding_mps, np.inf, np.inf, np.inf])


# --- cruising ------------------------------------------------------------------------------------------------------


def test_time_gap_law__by_hand() -> None:
    # (8 - 10 + 0.4 (20 - 3 - 1.5 10)) / 1.5 = (-2 + 0.8) / 1.5
    law = Cruise()
    assert time_gap_law_mps2(np.array(20.0), np.array(10.0), np.array(8.0), law) == pytest.approx(-0.8)
    assert time_gap_law_mps2(np.array(18.0), np.array(10.0), np.array(10.0), law) == pytest.approx(0.0)


def test_target_speed__slows_for_a_curve_in_time() -> None:
    """A bend of 0.01 / m from 20 m ahead: entered at sqrt(2 / 0.01) = 14.1 m/s, and now sqrt(200 + 2 1.75 20)."""
    for sign in (1.0, -1.0):
        bend = np.where(AHEAD_M == 20.0, sign * 0.01, 0.0)[None]
        assert target_speed_mps(np.array([30.0]), bend, Cruise())[0] == pytest.approx(np.sqrt(270.0))
        assert target_speed_mps(np.array([13.89]), bend, Cruise())[0] == 13.89


def test_in_path__anticipates_a_car_that_moves_over(car: Car) -> None:
    """1.4 m beside and approaching at 1 m/s: in the path within 1.5 s, not within 1 s."""
    _, encounters = perceive(car, seeing(ahead_m=6.0, left_m=3.2, left_mps=-1.0))
    assert in_path(encounters, 1.5)[0, 0]
    assert not in_path(encounters, 1.0)[0, 0]
    assert not in_path(perceive(car, seeing(ahead_m=-6.0, left_m=3.2, left_mps=-1.0))[1], 1.5)[0, 0], "behind"


@settings(deadline=None)
@given(st.floats(0.0, 100.0), st.floats(0.0, 100.0), st.floats(0.0, 30.0), st.floats(0.0, 30.0))
def test_cruise__more_gap_never_brakes_harder(one: float, two: float, own: float, other: float) -> None:
    near, far = (_cruise(gap, own, other) for gap in sorted((one, two)))
    assert near <= far + 1e-9


@settings(deadline=None)
@given(st.floats(0.0, 100.0), st.floats(0.0, 30.0), st.floats(0.0, 30.0), st.floats(-3.5, 2.0))
def test_cruise__is_comfortable(gap: float, own: float, other: float, before: float) -> None:
    requested = _cruise(gap, own, other, before)
    assert -3.5 <= requested <= 2.0
    assert abs(requested - before) <= 0.5 + 1e-9


def motion(
    speed_mps: float, limit_mps: float, *, turned: float = 0.0, left: float = 0.0, steering: float = 0.0
) -> OwnMotion:
    """The motion of a car in one game, on a straight road without a stop line ahead."""
    numbers = (speed_mps, limit_mps, 0.0, steering, np.inf, 0.0, left)
    path = (np.full((1, len(AHEAD_M)), turned), np.zeros((1, len(AHEAD_M))))
    line = (np.array([np.inf]), *[np.array([False])] * 3)
    return OwnMotion(*(np.array([number]) for number in numbers), *path, *line)


def _cruise(gap_m: float, own_mps: float, other_mps: float, before_mps2: float | None = None) -> float:
    """The request of the cruise control behind a car; without `before_mps2` the jerk has no limit."""
    columns = (gap_m + 4.6, gap_m, 0.0, -1.8, other_mps, 0.0, 4.6, np.inf, np.inf)
    encounters = Encounters(*(np.array([[value]]) for value in (True, *columns, False, np.inf)))
    step_s, before = (1000.0, 0.0) if before_mps2 is None else (0.1, before_mps2)
    view = motion(own_mps, 13.89)
    return float(cruise_mps2(view, encounters, before_mps2=np.array([before]), law=Cruise(), step_s=step_s)[0])


# --- keeping the lane ----------------------------------------------------------------------------------------------


def test_steering__by_hand() -> None:
    """1 m right of the path at 9 m/s: atan(0.3 / (9 + 1)) = 0.029991; turned away by 0.1 rad as well: 0.5 0.1 more,
    and the front axle is 1.35 sin(0.1) farther from the path."""
    law = LaneKeeping(max_lateral_mps2=6.0, max_lateral_jerk_mps3=20.0)
    for turned, expected in ((0.0, 0.0299910), (0.1, 0.05 + np.arctan(0.03 * (1.0 + 1.35 * np.sin(0.1))))):
        view = motion(9.0, 13.9, turned=turned, left=1.0, steering=expected)
        assert steering_rad(view, law=law, wheelbase_m=2.7, step_s=0.1)[0] == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("speed_mps", [3.0, 8.0, 14.0, 25.0])
def test_steering__brings_the_car_onto_its_path_within_limits(car: Car, speed_mps: float) -> None:
    """From 1.5 m beside and 0.05 rad turned away, within UN R79's limits."""
    state, actuators, law = State.empty(1, 1), car.actuators, LaneKeeping()
    state.y_m[:], state.heading_rad[:], state.speed_mps[:], state.present[:] = 1.5, 0.05, speed_mps, True
    state.friction[:] = actuators.friction
    offsets, lateral = [], []
    for _ in range(250):
        view = seeing(speed_mps, turned=-float(state.heading_rad[0, 0]), path_left_m=-float(state.y_m[0, 0]))
        view[0, LAYOUT.index("steering_rad")] = state.steering_rad[0, 0] / actuators.max_steering_rad[0]
        seen, _ = perceive(car, view)
        lag_s = car.limits["steering_lag_s"]
        requested = steering_rad(seen, law=law, wheelbase_m=2.7, step_s=car.step_s, lag_s=lag_s)
        action = car.actions(np.zeros(1), requested, view)
        acceleration, steering = requests(action[:, None], state.speed_mps, np.zeros((1, 1)), actuators)
        move(state, Requested(acceleration, steering, np.ones((1, 1), dtype=bool)), actuators, car.step_s)
        offsets.append(float(state.y_m[0, 0]))
        lateral.append(float(lateral_acceleration_mps2(state, actuators)[0, 0]))
    assert max(abs(each) for each in offsets[-50:]) < 0.05
    assert min(offsets) > -0.15, "no overshoot to the other side"
    assert np.abs(lateral).max() <= 3.0
    assert np.abs(np.diff(lateral)).max() <= 5.0 * car.step_s + 0.01


# --- deciding ------------------------------------------------------------------------------------------------------


def decided(driver: RulesDriver, car: Car, *views: np.ndarray, game: int = 0) -> list[float]:
    """Accelerations that it requests, decision by decision, in one game."""
    games, requested = np.array([game]), []
    for view in views:
        pedals = float(driver.decide(games, view, np.zeros((1, 2)))[0, 0])
        limits = car.limits
        requested.append(pedals * limits["max_acceleration_mps2" if pedals >= 0.0 else "max_braking_mps2"])
    return requested


def new_driver(document: Rules, car: Car, games: int = 1) -> RulesDriver:
    driver = RulesDriver(document, car)
    assert isinstance(driver, Driver)
    driver.reset(np.arange(games))
    return driver


def test_driver__brakes_for_a_standing_car_as_its_document_says(car: Car) -> None:
    """A standing car 10 m ahead at 10 m/s: time to collision 1 s."""
    views = [seeing(10.0, ahead_m=14.6, ahead_mps=-10.0)] * 16
    requested = {
        name: decided(new_driver(rules(**{name: {}} if name else {}), car), car, *views)
        for name in ("", "emergency_braking", "careful_and_competent", "rss", "fuzzy")
    }
    assert requested[""][-1] == pytest.approx(-3.5), "cruise control has no emergency braking"
    assert requested["emergency_braking"][:4] == pytest.approx([-3.0, -6.0, -8.0, -8.0]), "the limit of the car"
    assert requested["careful_and_competent"][:8] == pytest.approx([-0.4] * 8), "0.75 s of coasting"
    assert requested["careful_and_competent"][-1] == pytest.approx(-8.0), "0.85 g exceeds the limit of the car"
    assert requested["rss"][:8] == pytest.approx([0.0] * 8)
    assert requested["rss"][-1] == pytest.approx(-0.774 * 9.81)
    assert requested["fuzzy"][-1] == pytest.approx(-6.0)


def test_driver__continues_its_request_during_the_reaction_time(car: Car) -> None:
    driver = new_driver(rules(careful_and_competent={}), car)
    slower = [seeing(10.0, ahead_m=14.6, ahead_mps=-4.0)] * 4
    requested = decided(driver, car, *slower, *[seeing(10.0, ahead_m=14.6, ahead_mps=-9.9)] * 3)
    assert requested[:4] == pytest.approx([-0.5, -1.0, -1.5, -2.0])
    assert requested[4:] == pytest.approx([-2.0, -2.0, -2.0])


def test_driver__keeps_a_state_per_game(car: Car) -> None:
    driver, danger = new_driver(rules(rss={}), car, games=3), seeing(10.0, ahead_m=14.6, ahead_mps=-10.0)
    decided(driver, car, *[danger] * 15, game=2)
    assert decided(driver, car, danger, game=2)[0] < -7.0
    assert decided(driver, car, danger, game=0)[0] == 0.0
    driver.reset(np.array([2]))
    assert decided(driver, car, danger, game=2)[0] == 0.0


# --- whole games ---------------------------------------------------------------------------------------------------


def play(repository: Path, scene: OpenScene, *, ego: str, other: Driver | None, games: int) -> list[dict[str, Any]]:
    document = read_driver(repository / "egos" / f"{ego}.toml")
    assert isinstance(document, Rules)
    driver = RulesDriver(document, car_of(scene.world, EGO))
    return [game.record for game in rollouts.play(rollouts.arm(scene, driver, other), games)]


@pytest.mark.parametrize("other", [None, SumoDriver()], ids=["alone", "beside SUMO's driver"])
@pytest.mark.parametrize("ego", EGOS)
def test_games__every_ego_reaches_its_goal_in_comfort(
    repository: Path, scene: OpenScene, ego: str, other: Driver | None
) -> None:
    for record in play(repository, scene, ego=ego, other=other, games=10):
        assert (record["ego_outcome"], record["error"]) == ("goal", "")
        assert record["ego_max_lateral_acceleration_mps2"] < 0.1
        assert record["ego_max_deceleration_mps2"] < 1.0
        assert 12.5 < record["ego_mean_speed_mps"] < 14.0


BENDS = "".join(f'<node id="{n}" x="{x}" y="{y}"/>' for n, x, y in (("a", 0, 0), ("b", 120, 0), ("c", 250, 90)))
CURVE = ' shape="120,0 135,1 150,4 165,9 180,17 193,28 205,40 220,56 250,90"'
BENT = "".join(
    f'<edge id="{name}" from="{name[0]}" to="{name[1]}" numLanes="2" speed="16.67" spreadType="right"{shape}/>'
    for name, shape in (("ab", ""), ("bc", CURVE))
)


def test_games__a_bend_is_driven_slower_and_in_the_lane(repository: Path, tmp_path: Path) -> None:
    """A radius of about 110 m means 2.5 m/s^2 of lateral acceleration at the limit of 16.67 m/s: the car slows down."""
    places: dict[str, object] = {"ego": ("ab bc", "ab_0"), "non_ego": ("ab bc", "ab_1"), "goal": "bc"}
    bent = build_scene(tmp_path / "bent", BENDS, BENT, places, goal_m=140.0, time_limit_s=40.0)
    for record in play(repository, bent, ego="adas", other=None, games=3):
        assert (record["ego_outcome"], record["error"]) == ("goal", "")
        assert 1.0 < record["ego_max_lateral_acceleration_mps2"] <= 3.1
        assert record["ego_max_deceleration_mps2"] <= 3.5
