"""The rule-based driver at junctions: it stops for red and for signs, waits for others with priority, and goes on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from harness.config.driver import read_driver
from harness.config.rule_driver import Cruise, Rules
from harness.drivers.adaptive_cruise import cruise_mps2, waiting_gap_m
from harness.drivers.car import Car, car_of
from harness.drivers.perception import perceive
from harness.drivers.rules_driver import RulesDriver
from harness.environments.arena import Arena, Seat
from harness.game.arrays import FloatArray
from harness.game.outcome import Outcome
from harness.game.roles import EGO
from harness.road.scene.open_scene import OpenScene, open_scene
from tests.support.observations import observation_of
from tests.support.repository import REPOSITORY
from tests.support.scenes import drawn

LAW = Cruise()


@pytest.fixture(scope="module")
def lights() -> OpenScene:
    return open_scene(REPOSITORY / "networks" / "left_across")


@pytest.fixture(scope="module")
def car(lights: OpenScene) -> Car:
    return car_of(lights.world, EGO)


def waiting(car: Car, **entries: float) -> float:
    """The distance to the place before which a car at 10 m/s has to stop."""
    view = observation_of({"speed_mps": 10.0, "speed_limit_mps": 13.9, **entries})
    return float(waiting_gap_m(*perceive(car, view), LAW)[0])


# --- where it has to stop, by hand -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("line_m", "signal", "gap_m"),
    [
        (30.0, "signal_red", 30.0),
        (15.0, "signal_red", 15.0),  # 100 / 30 = 3.3 m/s2: its strongest braking is 3.5 m/s2
        (13.0, "signal_red", np.inf),  # 3.8 m/s2
        (30.0, "signal_yellow", 30.0),
        (17.0, "signal_yellow", 17.0),  # 100 / 34 = 2.9 m/s2
        (16.0, "signal_yellow", np.inf),  # 3.1 m/s2: more than 3 m/s2
        (30.0, "signal_green", np.inf),
        (30.0, "stop_sign", np.inf),  # it rolls up to a sign
    ],
)
def test_waiting__at_a_signal(car: Car, line_m: float, signal: str, gap_m: float) -> None:
    assert waiting(car, stop_line_m=line_m, **{signal: 1.0}) == pytest.approx(gap_m)


@pytest.mark.parametrize(
    ("arrives_s", "priority", "waits"),
    [
        (3.0, 1.0, True),
        # 30 m to the place and through it: 10 t + t^2 = 30, 2.42 s; 1 s to spare: 3.42 s
        (3.3, 1.0, True),
        (3.6, 1.0, False),
        (3.0, -1.0, False),  # the other must yield
        (3.0, 0.0, False),  # its way does not cross
    ],
)
def test_waiting__for_a_car_with_priority(car: Car, arrives_s: float, priority: float, waits: bool) -> None:
    crossing = {
        "other0_seen": 1.0,
        "other0_ahead_m": 20.0,
        "other0_left_m": -12.0 * arrives_s,
        "other0_ahead_mps": -10.0,
        "other0_left_mps": 12.0,
        "other0_turned_sin": 1.0,
        "other0_length_m": 4.6,
        "other0_width_m": 1.8,
        "other0_own_to_conflict_m": 20.0,
        "other0_other_to_conflict_m": 12.0 * arrives_s,
        "other0_has_priority": priority,
    }
    assert waiting(car, **crossing) == pytest.approx(20.0 if waits else np.inf)


def test_cruise__rolls_up_to_a_stop_sign(car: Car) -> None:
    """At the line half a metre per second, before it the speed of half of its strongest braking."""

    def requested(line_m: float, speed_mps: float) -> float:
        seen = {"speed_mps": speed_mps, "speed_limit_mps": 13.9, "stop_line_m": line_m, "stop_sign": 1.0}
        perceived = perceive(car, observation_of(seen))
        return float(cruise_mps2(*perceived, before_mps2=np.zeros(1), law=LAW, step_s=1000.0)[0])

    for line_m in (0.0, 4.0, 20.0):
        rolling = np.sqrt(0.25 + 3.5 * line_m)
        assert requested(line_m, rolling) == pytest.approx(0.0, abs=1e-6)
        assert requested(line_m, rolling + 1.0) < 0.0
        assert requested(line_m, rolling - 0.4) > 0.0


# --- whole games -----------------------------------------------------------------------------------------------------

PLACES = np.linspace(0.0, 1.0, 12, endpoint=False)  # in the signals' cycle at which the games start


@pytest.fixture(scope="module")
def played(lights: OpenScene) -> Iterator[dict[str, FloatArray]]:
    """Twelve games of `adas` alone, from places all over the cycle: quantities [T, G] of the ego."""
    document = read_driver(REPOSITORY / "egos" / "adas.toml")
    assert isinstance(document, Rules)
    driver = RulesDriver(document, car_of(lights.world, EGO))
    arena = Arena(lights, len(PLACES), [Seat(driver), Seat(None)], seed=1)
    starts = {
        game: replace(drawn(lights, "alone", game, present=(1.0, 0.0)), signal_place=place)
        for game, place in enumerate(PLACES.tolist())
    }
    names = ("passed_red_s", "speed_mps", "permitted_mps", "front_m")
    series: dict[str, list[FloatArray]] = {name: [] for name in names}
    try:
        arena.reset(starts)
        while arena.state.running.any():
            step = arena.step()
            for name in names:
                owner = step.quantities.rules if name == "permitted_mps" else step.quantities
                values = getattr(owner, name)[:, EGO]
                series[name].append(np.where(step.drove[:, EGO], values, np.nan))
        series["outcome"] = [arena.state.outcome[:, EGO].copy()]
        yield {name: np.array(values) for name, values in series.items()}
    finally:
        arena.close()


def test_games__a_driver_by_rules_stops_at_red_and_goes_at_green(
    played: dict[str, FloatArray], lights: OpenScene
) -> None:
    assert (played["outcome"] == Outcome.GOAL).all()
    assert np.nanmax(played["passed_red_s"]) == -1.0, "no game has a passage on red"
    slowest = np.nanmin(played["speed_mps"], axis=0)
    stopped = slowest < 0.5
    assert 3 <= stopped.sum() <= 10, "in some games it is red when it arrives, in some it is not"
    assert (slowest > 9.0).sum() >= 3, "it does not slow down for a green light"
