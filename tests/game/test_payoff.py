"""Equation 1 and each of its terms by hand, on moments of the merge road (cars 4.6 m by 1.8 m, steps of 0.1 s)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.errors import UsageError
from harness.game.outcome import Outcome
from harness.game.payoff import FuzzyFunction, FuzzySet
from harness.game.payoff_terms import TERMS
from harness.game.quantities import Quantities
from harness.game.world import World
from tests.support.moments import FAR, Moment, car, value_of

# --- the terms -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("term", "outcome", "unit_value"),
    [
        ("collision", Outcome.COLLISION, -1.0),
        ("rail", Outcome.RAIL, -1.0),
        ("goal", Outcome.GOAL, 1.0),
        ("timeout", Outcome.TIMEOUT, -1.0),
    ],
)
def test_event__has_its_weight_in_its_own_outcome_only(
    moment: Moment, world: World, term: str, outcome: Outcome, unit_value: float
) -> None:
    for each in Outcome:
        q = moment(world, [car(50.0, outcome=each), FAR])
        assert value_of(q, term, weight=7.0) == (7.0 * unit_value if each is outcome else 0.0)


PER_SECOND = [
    # flanks 0.7 m from the rail at y = 0: 1 - 0.7 / 1.4 = 0.5
    ("clearance", 1.4, car(50.0), FAR, -0.5),
    # 1.4 m between the flanks of neighbouring lanes: 1 - 1.4 / 2 = 0.3; the rail, nearer, does not count
    ("vehicle_clearance", 2.0, car(50.0), car(50.0, -4.8), -0.3),
    ("vehicle_clearance", 2.0, car(50.0), FAR, 0.0),
    # 30 m less 4.6 m at 12.7 m/s are 2 s: 1 - 2 / 2.5 = 0.2
    ("time_gap", 2.5, car(20.0, speed_mps=12.7), car(50.0), -0.2),
    ("time_gap", 2.0, car(20.0, speed_mps=12.7), car(50.0), 0.0),
    ("time_gap", 2.5, car(20.0), car(20.0, -4.8), 0.0),  # no leader
    # 25.4 m at 5 m/s nearer are 5.08 s: 1 - 5.08 / 10 = 0.492
    ("time_to_collision", 10.0, car(20.0, speed_mps=14.0), car(50.0, speed_mps=9.0), -0.492),
    ("time_to_collision", 10.0, car(20.0, speed_mps=9.0), car(50.0, speed_mps=14.0), 0.0),
    ("time_to_collision", 10.0, car(50.0), car(52.0), -1.0),  # in contact
    # 15 % over 13.89 m/s
    ("speed_over_limit", None, car(50.0, speed_mps=1.15 * 13.89), FAR, -0.15),
    ("speed_over_limit", None, car(50.0, speed_mps=5.0), FAR, 0.0),
    # 15 % under it
    ("speed_under_limit", None, car(50.0, speed_mps=0.85 * 13.89), FAR, -0.15),
    ("speed_under_limit", None, car(50.0, speed_mps=15.0), FAR, 0.0),
    ("lane_offset", None, car(50.0, -2.3), FAR, -0.7),
    # (4 / 10)^2, braking or speeding up
    ("acceleration", None, car(50.0, acceleration_mps2=-4.0), FAR, -0.16),
    ("acceleration", None, car(50.0, acceleration_mps2=4.0), FAR, -0.16),
    # 0.03711437 1/m * 100 = 3.711437 m/s2 (see test_bicycle): 0.3711437^2
    ("lateral_acceleration", None, car(50.0, steering_rad=-0.1), FAR, -0.13774765),
    # the right lane of the merge road ends at 100 m: 50 m before it, 1 - 50 / 100 = 0.5; the left one goes on
    ("lane_end", 100.0, car(50.0, -4.8), FAR, -0.5),
    ("lane_end", 100.0, car(50.0), FAR, 0.0),
    ("time_pressure", None, car(50.0), FAR, -1.0),
    ("waiting", None, car(50.0, speed_mps=0.0), FAR, -1.0),
    ("waiting", None, car(50.0, speed_mps=0.2), FAR, 0.0),
    ("on_carriageway", None, car(50.0), FAR, 0.0),  # not on foot; walkers: see tests/environments/test_on_foot.py
    ("wrong_way", None, car(50.0), FAR, 0.0),  # a one-way road; roads with oncoming lanes: see test_traffic_rules
]


@pytest.mark.parametrize(("term", "limit", "ego", "other", "rate"), PER_SECOND)
def test_rate__is_paid_per_second(
    moment: Moment, world: World, term: str, limit: float | None, ego: Any, other: Any, rate: float
) -> None:
    q = moment(world, [ego, other])
    assert value_of(q, term, limit) == pytest.approx(rate * 0.1, abs=2e-4)
    assert value_of(q, term, limit, weight=3.0) == pytest.approx(3.0 * value_of(q, term, limit))
    halved = moment(replace(world, step_s=0.05), [ego, other])
    assert value_of(halved, term, limit) == pytest.approx(value_of(q, term, limit) / 2.0)


def test_progress__is_paid_per_100_m_whatever_the_step(moment: Moment, world: World) -> None:
    for step_s in (0.1, 0.5):
        q = moment(replace(world, step_s=step_s), [car(50.0), FAR])
        q.advanced_m = np.array([[1.3, 0.0]])
        assert value_of(q, "progress", weight=4.0) == pytest.approx(0.052)
        q.advanced_m = np.array([[-1.3, 0.0]])
        assert value_of(q, "progress", weight=4.0) == pytest.approx(-0.052)


def with_quantity(q: Quantities, name: str, value: Any) -> Quantities:
    """The quantities, with a value of one of them given."""
    q.__dict__[name] = value
    return q


@pytest.mark.parametrize(
    ("term", "limit", "quantity", "values"),
    [
        ("red_light", 2.0, "passed_red_s", {-1.0: 0.0, 0.0: 0.0, 1.9: 0.0, 2.0: -1.0, 30.0: -1.0}),
        ("stop_sign", 3.0, "passed_stop_sign_mps", {-1.0: 0.0, 0.0: 0.0, 2.9: 0.0, 3.0: -1.0, 12.0: -1.0}),
        ("yield", 4.0, "entered_before_s", {np.inf: 0.0, 4.0: 0.0, 1.0: -0.75, 0.0: -1.0}),
        ("gap", 3.0, "gap_s", {np.inf: 0.0, 3.0: 0.0, 0.75: -0.075, 0.0: -0.1}),  # per second
    ],
)
def test_event__counts_from_its_limit_on(
    moment: Moment, world: World, term: str, limit: float, quantity: str, values: dict[float, float]
) -> None:
    for number, value in values.items():
        q, given = moment(world, [car(50.0), FAR]), np.array([[number, -1.0]])
        if quantity.startswith("passed"):
            with_quantity(q, "rules", q.rules._replace(**{quantity: given}))
        else:
            with_quantity(q, quantity, given)
        assert value_of(q, term, limit, weight=5.0) == pytest.approx(5.0 * value), number


def test_terms__jerk_is_squared_in_units_of_10(moment: Moment, world: World) -> None:
    # braking 0.4 m/s2 harder than one step before: 4 m/s3 in 0.1 s, (4 / 10)^2
    q = replace(moment(world, [car(50.0), FAR]), gained_mps2=np.array([[-0.4, 0.0]]))
    assert value_of(q, "jerk") / world.step_s == pytest.approx(-0.16)


def test_terms__are_all_tested_here() -> None:
    events = {"collision", "rail", "goal", "timeout", "red_light", "stop_sign", "yield"}
    by_hand = {*events, "progress", "gap", "jerk", *(each[0] for each in PER_SECOND)}
    assert by_hand == set(TERMS)


def test_terms__only_goal_and_progress_are_positive(moment: Moment, world: World) -> None:
    limits = {"within_m": 5.0, "within_s": 5.0, "after_s": 0.0, "from_mps": 1.0, "": None}
    for ego in (car(50.0, outcome=Outcome.COLLISION), car(20.0, speed_mps=25.0), car(108.0, -4.8)):
        for other in (car(52.0), car(30.0), car(54.0, -4.8)):
            q = moment(world, [ego, other])
            for name, term in TERMS.items():
                if name not in ("goal", "progress"):
                    assert value_of(q, name, limits[term.parameter]) <= 0.0


# --- fuzzy functions, compared with zero-order Sugeno inference by hand -----------------------------------------------

# speed over the limit as a share of it: legal up to 0, thrilling between 0.05 and 0.3, frightening beyond 0.5
LEGAL = FuzzySet(name="legal", inputs=(0.0, 0.1), memberships=(1.0, 0.0), value=0.0)
THRILLING = FuzzySet(name="thrilling", inputs=(0.0, 0.1, 0.3, 0.5), memberships=(0.0, 1.0, 1.0, 0.0), value=2.0)
FRIGHTENING = FuzzySet(name="frightening", inputs=(0.3, 0.5), memberships=(0.0, 1.0), value=-4.0)
SPEEDY = FuzzyFunction("speed_over_limit", (LEGAL, THRILLING, FRIGHTENING))


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (-0.3, 0.0),  # fully legal
        (0.025, 0.5),  # 0.75 legal, 0.25 thrilling: (0.75 * 0 + 0.25 * 2) / 1
        (0.2, 2.0),  # fully thrilling
        (0.35, 0.5),  # 0.75 thrilling, 0.25 frightening: 0.75 * 2 - 0.25 * 4
        (0.7, -4.0),  # fully frightening
    ],
)
def test_fuzzy__is_the_average_of_the_sets_weighted_by_membership(value: float, expected: float) -> None:
    assert SPEEDY(np.array([value])) == pytest.approx([expected])


def test_fuzzy__memberships_need_not_sum_to_1() -> None:
    # 0.8 of the one set (value 1) and 0.8 of the other (value 3): (0.8 + 2.4) / 1.6 = 2, not 3.2
    both = FuzzyFunction(
        "q",
        (
            FuzzySet(name="a", inputs=(0.0,), memberships=(0.8,), value=1.0),
            FuzzySet(name="b", inputs=(0.0,), memberships=(0.8,), value=3.0),
        ),
    )
    assert both(np.array([5.0])) == pytest.approx([2.0])


def test_fuzzy__is_0_where_the_input_belongs_to_no_set() -> None:
    hill = FuzzyFunction("q", (FuzzySet(name="hill", inputs=(1.0, 2.0, 3.0), memberships=(0.0, 1.0, 0.0), value=5.0),))
    assert hill(np.array([0.0, 0.5, 2.0, 3.0, 8.0])).tolist() == [0.0, 0.0, 5.0, 0.0, 0.0]


@given(st.floats(-2.0, 2.0))
def test_fuzzy__stays_between_the_least_and_the_greatest_value(value: float) -> None:
    assert -4.0 - 1e-9 <= SPEEDY(np.array([value]))[0] <= 2.0 + 1e-9


# --- from a document -------------------------------------------------------------------------------------------------


@pytest.fixture
def read(tmp_path: Path) -> Callable[[str], Persona]:
    def from_text(text: str) -> Persona:
        path = tmp_path / "p.toml"
        about = 'name = "p"\ndescription = "a test persona"\n'
        source = '[[sources]]\nstatistic = "so many in a hundred"\ncitation = "Somebody, 2020"\n'
        path.write_text(about + source + text, encoding="utf-8")
        return read_document(path, Persona)

    return from_text


def test_document__is_evaluated_by_equation_1(read: Callable[[str], Persona], moment: Moment, world: World) -> None:
    persona = read(
        "[safety]\nweight = 0.5\n[safety.terms]\ncollision = 10\nclearance = { weight = 2.0, within_m = 1.4 }\n"
        "[operational.terms]\ngoal = 5.0\nprogress = 4.0\n[human]\nweight = 3.0\n[human.terms]\ntime_pressure = 0.25\n"
        "[[human.fuzzy]]\nname = 'thrill'\nweight = 0.5\nquantity = 'speed_over_limit'\n"
        "sets = [{ name = 'fast', points = [[0.0, 0.0], [0.2, 1.0]], value = 6.0 }]\n"
    )
    q = moment(world, [car(50.0, speed_mps=1.1 * 13.89), FAR])
    q.advanced_m = np.array([[1.5, 0.0]])
    shares = {name: float(value[0]) for name, value in persona.payoff.evaluate(q, 0).items()}
    assert shares == pytest.approx(
        {
            "collision": 0.0,
            "clearance": 0.5 * 2.0 * -0.5 * 0.1,  # a0 * weight * rate * step
            "goal": 0.0,
            "progress": 1.0 * 4.0 * 0.015,  # a1, 1 unless given, * weight * way / 100 m
            "time_pressure": 3.0 * 0.25 * -1.0 * 0.1,  # a2 * weight * rate * step
            "thrill": 3.0 * 0.5 * 6.0 * 0.1,  # a2 * weight * (the average of one set is its value) * step
        },
        abs=2e-4,
    )
    assert persona.payoff.total(q, 0)[0] == pytest.approx(sum(shares.values()))


def test_document__without_terms_is_refused(read: Callable[[str], Persona]) -> None:
    with pytest.raises(UsageError, match="nothing could be learned from it"):
        read("[safety]\nweight = 1.0\n")


# --- no document can reward harm -------------------------------------------------------------------------------------


@pytest.mark.parametrize("quantity", ["clearance_m", "time_gap_s", "gap_s"])
@pytest.mark.parametrize(
    "sets",
    [
        "{ name = 'near', points = [[0.0, 1.0], [1.0, 0.0]], value = 5.0 }",  # rewards contact
        "{ name = 'far', points = [[0.0, 0.0], [1.0, 1.0]], value = -5.0 }",  # the same, by a penalty for distance
        "{ name = 'a', points = [[0.0, 1.0], [0.2, 0.0]], value = -1.0 },"
        "{ name = 'b', points = [[0.0, 0.0], [0.2, 1.0]], value = -3.0 }",
    ],
)
def test_harm__a_fuzzy_term_may_not_reward_contact(read: Callable[[str], Persona], quantity: str, sets: str) -> None:
    with pytest.raises(UsageError, match="a crash must not be rewarded"):
        read(f"[[human.fuzzy]]\nname = 'x'\nquantity = '{quantity}'\nsets = [{sets}]\n")
