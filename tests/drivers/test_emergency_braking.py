"""Emergency braking and the reference drivers of UN R157: formulas by hand, and the cut-ins that they avoid.

The cut-in figures of UN R157 (Annex 4, Appendix 3, section 5) are drawings without numbers. So the smallest gap from
which a collision is avoided is compared with two other sources: distances computed by hand from the formulas, and the
results of the public programme of the EU Joint Research Centre (github.com/ec-jrc/JRC-FSM), whose authors proposed the
fuzzy model to the regulation. The tables of R152 (5.2.1.4) contain numbers and are compared directly.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.config.rule_driver import CarefulAndCompetent, EmergencyBraking, FuzzySafety, Rss
from harness.drivers import emergency_braking
from harness.drivers.perception import Encounters
from harness.drivers.rules_driver import BrakeReaction, ReactionState, react
from harness.game.arrays import BoolArray, FloatArray

KMH = 1.0 / 3.6
LENGTH_M, WIDTH_M, LANE_M = 4.3, 1.9, 3.5  # of the cars and the lanes in the programme
STEP_S = 0.1
NO_CONFLICT = (np.inf, np.inf, False, np.inf)  # the other's way does not cross the own path

React = Callable[[Encounters, FloatArray, FloatArray, FloatArray], tuple[BoolArray, FloatArray]]


def encounter(gap_m: float, offset_m: float = 0.0, other_mps: float = 0.0, approach_mps: float = 0.0) -> Encounters:
    """One other car of the own size, in one game."""
    values = (True, gap_m + LENGTH_M, gap_m, offset_m, abs(offset_m) - WIDTH_M, other_mps, approach_mps, LENGTH_M)
    return Encounters(*(np.array([[value]]) for value in (*values, *NO_CONFLICT)))


# --- formulas, by hand -------------------------------------------------------------------------------------------


def test_time_to_collision__is_gap_over_closing_speed() -> None:
    gaps, closing = np.array([20.0, 20.0, 20.0, -3.0]), np.array([10.0, 0.0, -5.0, 10.0])
    np.testing.assert_array_equal(emergency_braking.time_to_collision_s(gaps, closing), [2.0, np.inf, np.inf, 0.0])


def test_rss__gap_is_the_published_formula() -> None:
    # v = 20, r = 0.75, a = 3: after 22.25 m/s; 0.5 (20 + 22.25) 0.75 = 15.84375; 22.25^2 / 12 = 41.255208;
    # other 10 m/s: 100 / 12 = 8.333333
    assert emergency_braking.rss_gap_m(np.array(20.0), np.array(10.0), Rss()) == pytest.approx(48.765625)
    assert emergency_braking.rss_gap_m(np.array(0.0), np.array(30.0), Rss()) == 0.0
    # one that comes with 10 m/s: after 12.25; 0.5 (10 + 12.25) 0.75 + 12.25^2 / 12 = 20.848958 more than 57.098958
    assert emergency_braking.rss_gap_m(np.array(20.0), np.array(-10.0), Rss()) == pytest.approx(77.947917)
    # one that stands, or crosses with 0.05 m/s against the own way, does not come
    gaps_m = emergency_braking.rss_gap_m(np.full(2, 20.0), np.array([0.0, -0.05]), Rss())
    np.testing.assert_allclose(gaps_m, 57.098958, atol=1e-3)


def test_rss__clearance_is_the_published_formula() -> None:
    # v = 1, r = 0.75, a = 1: after 1.75; 0.3 + 0.5 (1 + 1.75) 0.75 + 1.75^2 / 2 = 0.3 + 1.03125 + 1.53125
    assert emergency_braking.rss_clearance_m(np.array(1.0), Rss()) == pytest.approx(2.8625)
    # 0.3 + 0.28125 + 0.28125, also for a car that moves away
    np.testing.assert_allclose(emergency_braking.rss_clearance_m(np.array([0.0, -2.0]), Rss()), 0.8625)


def test_rss__a_road_user_that_waits_to_yield_is_no_danger() -> None:
    """10 m ahead at 13 m/s, 0.8 m beside, neither distance is safe: 0.5 (13 + 15.25) 0.75 + 15.25^2 / 12 = 29.97 m, and
    0.8625 m."""
    own = np.array([[13.0]])

    def danger(yielding_mps: float, clearance_m: float = 0.8) -> bool:
        of_other = encounter(10.0, WIDTH_M + clearance_m)._replace(yielding_mps=np.array([[yielding_mps]]))
        return bool(emergency_braking.rss(of_other, own, Rss())[0][0, 0])

    assert danger(np.inf), "it need not yield"
    assert not danger(0.0)
    assert danger(0.2), "it moves"
    assert danger(0.0, clearance_m=0.29), "within the margin of 0.3 m"


def test_proactive__is_the_published_formula() -> None:
    # v = 20, other 10: 15 + 400 / 8 - 100 / 14 + 4 = 61.857143; 15 + 400 / 12 - 100 / 14 + 2 = 43.190476
    own, other = np.array(20.0), np.array(10.0)
    gaps = np.array([61.86, 61.857143 - 0.25 * 18.666667, 43.19, 5.0])
    np.testing.assert_allclose(
        emergency_braking.proactive(gaps, own, other, FuzzySafety()), [0.0, 0.25, 1.0, 1.0], atol=1e-6
    )
    # one that comes with 10 m/s: 69 + 100 / 14 = 76.142857 and 50.333333 + 100 / 14 = 57.476190; half way 66.809524
    assert emergency_braking.proactive(np.array(66.809524), own, -other, FuzzySafety()) == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("own_mps", "own_mps2", "gaps_m", "shares"),
    [
        # other 10, a = 0: 7.5 + 100 / 8 = 20; 7.5 + 100 / 12 = 15.833333
        (20.0, 0.0, [20.01, 17.916667, 15.83], [0.0, 0.5, 1.0]),
        # a = 2: v' - other = 11.5; 0.375 (10 + 11.5) = 8.0625; + 132.25 / 8 = 24.59375, + 132.25 / 12 = 19.083333
        (20.0, 2.0, [24.6, 19.08], [0.0, 1.0]),
        # closing 2, a = -3: v' - other = -0.25; 4 / 6 = 0.666667 m are needed
        (12.0, -3.0, [0.66, 0.67], [1.0, 0.0]),
        (9.0, 0.0, [0.1], [0.0]),
    ],
)
def test_critical__is_the_published_formula(
    own_mps: float, own_mps2: float, gaps_m: list[float], shares: list[float]
) -> None:
    own, pushed, other = (np.array(each) for each in (own_mps, own_mps2, 10.0))
    law = FuzzySafety()
    found = emergency_braking.critical(np.array(gaps_m), own_mps=own, own_mps2=pushed, other_mps=other, law=law)
    np.testing.assert_allclose(found, shares, atol=1e-6)


def test_fuzzy__braking_is_graded() -> None:
    """PFS gives up to comfortable braking, CFS from comfortable to hardest."""
    own, zero = np.array([[20.0]]), np.array([[0.0]])
    for gap, braking in ((61.857143 - 0.25 * 18.666667, 1.0), (17.916667, 5.0), (10.0, 6.0)):
        danger, demand = emergency_braking.fuzzy(encounter(gap, other_mps=10.0), own, zero, FuzzySafety())
        assert danger.all()
        assert demand[0, 0] == pytest.approx(braking, abs=1e-5)
    assert not emergency_braking.fuzzy(encounter(62.0, other_mps=10.0), own, zero, FuzzySafety())[0].any()


def test_fuzzy__a_car_that_enters_the_path_too_late_is_no_danger() -> None:
    """Past after (gap + two lengths) / closing = (10 + 8.6) / 10 = 1.86 s; the other needs 1.6 m / approach."""
    own, zero = np.array([[20.0]]), np.array([[0.0]])
    soon = encounter(10.0, LANE_M, 10.0, 1.6 / 1.9)
    late = encounter(10.0, LANE_M, 10.0, 1.6 / 2.0)
    assert emergency_braking.fuzzy(soon, own, zero, FuzzySafety())[0].all()
    assert not emergency_braking.fuzzy(late, own, zero, FuzzySafety())[0].any()


def test_careful_and_competent__perceives_a_cut_in_after_wander_distance_and_perception_time() -> None:
    """0.375 m + 0.4 s at 1 m/s: the centre of the other car must be 0.775 m from the centre of its lane."""
    law = CarefulAndCompetent(lane_width_m=LANE_M)
    own, no = np.array([[20.0]]), np.array([[False]])

    def danger(moved_m: float, gap_m: float, approach_mps: float = 1.0) -> bool:
        encounters = encounter(gap_m, LANE_M - moved_m, 10.0, approach_mps)
        return bool(emergency_braking.careful_and_competent(encounters, own, no, law)[0][0, 0])

    assert not danger(0.77, 15.0)
    assert danger(0.78, 15.0)
    assert danger(0.78, 19.9), "time to collision up to 2 s"
    assert not danger(0.78, 20.1)
    assert not danger(0.78, 15.0, approach_mps=-1.0), "it moves back to its lane"


def test_careful_and_competent__brakes_harder_for_a_car_wholly_ahead() -> None:
    own, no = np.array([[20.0]]), np.array([[False]])
    for offset, share in ((0.0, 0.85), (1.0, 0.774)):
        _, demand = emergency_braking.careful_and_competent(encounter(10.0, offset), own, no, CarefulAndCompetent())
        assert demand[0, 0] == pytest.approx(share * 9.81)


def test_careful_and_competent__brakes_until_the_danger_is_over() -> None:
    own, law = np.array([[20.0]]), CarefulAndCompetent()
    for gap, began, stays in ((25.0, False, False), (25.0, True, True), (41.0, True, False)):
        danger, _ = emergency_braking.careful_and_competent(
            encounter(gap, other_mps=10.0), own, np.array([[began]]), law
        )
        assert danger[0, 0] == stays


def test_emergency__warns_and_then_brakes() -> None:
    law, own, no = EmergencyBraking(), np.array([[10.0]]), np.array([[False]])
    for gap, danger, demand in ((22.1, False, None), (21.9, True, 1.0), (14.1, True, 1.0), (13.9, True, 9.0)):
        found, required = emergency_braking.emergency(encounter(gap), own, no, law)
        assert found[0, 0] == danger
        assert demand is None or required[0, 0] == demand


def test_react__waits_for_the_reaction_time_and_builds_up() -> None:
    """0.75 s of coasting, then 12.65 m/s^3 up to 0.774 g: full after 0.6 s."""
    state = ReactionState(*np.zeros((3, 1)))
    parameters = BrakeReaction(reaction_s=0.75, jerk_mps3=12.65, coasting_mps2=0.4)
    seen = []
    for _ in range(16):
        state, reacting, braking = react(
            state, danger=np.array([True]), demand_mps2=np.array([7.59]), parameters=parameters, step_s=STEP_S
        )
        seen.append((bool(reacting[0]), float(braking[0])))
    assert [each[0] for each in seen] == [True] * 8 + [False] * 8
    assert [each[1] for each in seen[:8]] == [0.4] * 8
    assert [each[1] for each in seen[8:14]] == pytest.approx([1.665, 2.93, 4.195, 5.46, 6.725, 7.59])


def test_react__needs_the_reaction_time_again_after_a_calm_second() -> None:
    parameters, state = BrakeReaction(reaction_s=0.2, jerk_mps3=10.0), ReactionState(*np.zeros((3, 2)))
    seen = []
    for danger in [[True, True]] * 4 + [[False, False]] * 9 + [[True, False], [True, True]]:
        state, reacting, braking = react(
            state, danger=np.array(danger), demand_mps2=np.full(2, 8.0), parameters=parameters, step_s=STEP_S
        )
        seen.append((reacting.tolist(), braking.tolist()))
    assert seen[12][1] == [0.0, 0.0]
    assert not seen[13][0][0], "the reaction time is over"
    assert seen[14][0] == [False, True]


# --- properties ----------------------------------------------------------------------------------------------------

gaps = st.floats(0.0, 60.0)
speeds = st.floats(0.0, 40.0)


@settings(deadline=None)
@given(gaps, gaps, speeds, speeds, st.floats(-6.0, 3.0))
def test_braking__is_never_harder_at_a_larger_gap(one: float, two: float, own: float, other: float, a: float) -> None:
    near, far = (encounter(gap, other_mps=other) for gap in sorted((one, two)))
    mine, pushed, no = np.array([[own]]), np.array([[a]]), np.array([[False]])
    reactions: tuple[Callable[[Encounters], tuple[BoolArray, FloatArray]], ...] = (
        lambda encounters: emergency_braking.fuzzy(encounters, mine, pushed, FuzzySafety()),
        lambda encounters: emergency_braking.rss(encounters, mine, Rss()),
        lambda encounters: emergency_braking.careful_and_competent(encounters, mine, no, CarefulAndCompetent()),
        lambda encounters: (
            emergency_braking.emergency(encounters, mine, no, EmergencyBraking())
            if encounters.gap_m[0, 0] > 0.0
            else full()
        ),
    )
    for react_to in reactions:
        braking = [np.where(*react_to(encounters), 0.0)[0, 0] for encounters in (near, far)]
        assert braking[0] >= braking[1] - 1e-9


def full() -> tuple[BoolArray, FloatArray]:
    return np.array([[True]]), np.array([[EmergencyBraking().braking_mps2]])


# --- whole cut-ins -------------------------------------------------------------------------------------------------


def crashes(driver: str, *, own_kmh: float, other_kmh: float, gaps_m: FloatArray, approach_mps: float) -> BoolArray:
    """[K] whether there is a crash: a car in the next lane moves over at `approach_mps` from each of these gaps; the
    own car keeps its speed except while it brakes. The steps are those of the programme."""
    parameters, reaction = REACTIONS[driver]
    gap: FloatArray = gaps_m.astype(float)
    offset: FloatArray = np.full(len(gaps_m), LANE_M)
    own: FloatArray = np.full(len(gaps_m), own_kmh * KMH)
    before = own
    other, crashed = np.full(len(gaps_m), other_kmh * KMH), np.zeros(len(gaps_m), dtype=bool)
    gap, offset = gap + STEP_S * (other - own), offset - STEP_S * approach_mps  # as in the programme's first sample
    state = ReactionState(*np.zeros((3, len(gaps_m))))
    for _ in range(340):
        clearance = np.abs(offset) - WIDTH_M
        crashed |= (clearance < 0.0) & (gap < 0.0) & (gap > -2.0 * LENGTH_M)
        moving = np.where(offset > 1e-9, approach_mps, 0.0)
        columns = (gap + LENGTH_M, gap, offset, clearance, other, moving, np.full_like(gap, LENGTH_M))
        no_conflict = (np.full((len(gap), 1), value) for value in NO_CONFLICT)
        seen = np.ones((len(gap), 1), dtype=bool)
        encounters = Encounters(seen, *(column[:, None] for column in columns), *no_conflict)
        began = state.braking_mps2[:, None]
        each, demand = reaction(encounters, own[:, None], ((own - before) / STEP_S)[:, None], began)
        state, _, braking = react(
            state, danger=each[:, 0], demand_mps2=demand[:, 0], parameters=parameters, step_s=STEP_S
        )
        before, own = own, np.maximum(own - STEP_S * braking, 0.0)
        gap, offset = gap + STEP_S * (other - own), np.maximum(offset - STEP_S * moving, 0.0)
    return crashed


# In lanes of 3.5 m the programme's person perceives a cut-in at 0.375 + 0.72 m: 0.4 s at 1.8 m/s. It has no emergency
# braking for a car that is wholly ahead.
PERSON = CarefulAndCompetent(lane_width_m=LANE_M, wrapped_braking_g=0.774)
REACTIONS: dict[str, tuple[BrakeReaction, React]] = {
    "careful_and_competent": (
        BrakeReaction(reaction_s=0.75, jerk_mps3=12.65, coasting_mps2=0.4),
        lambda encounters, own, a, began: emergency_braking.careful_and_competent(encounters, own, began > 0.4, PERSON),
    ),
    "rss": (
        BrakeReaction(reaction_s=0.75, jerk_mps3=12.65),
        lambda encounters, own, a, began: emergency_braking.rss(encounters, own, Rss()),
    ),
    "fuzzy": (
        BrakeReaction(reaction_s=0.75, jerk_mps3=12.65),
        lambda encounters, own, a, began: emergency_braking.fuzzy(encounters, own, a, FuzzySafety()),
    ),
}

# Driver, lateral speed (m/s), own speed and the other's (km/h), largest gap (m) at the start of the cut-in from which
# the programme's driver crashes; gaps are whole metres. At 130 against 70 km/h its careful and competent person crashes
# from any gap: a time to collision of 2 s is too short for a difference of 60 km/h.
PUBLISHED = [
    ("careful_and_competent", 1.8, 60, 20, 25),
    ("careful_and_competent", 1.8, 60, 40, 10),
    ("careful_and_competent", 1.8, 50, 10, 25),
    ("careful_and_competent", 1.8, 40, 20, 10),
    ("careful_and_competent", 1.8, 90, 50, 25),
    ("careful_and_competent", 1.8, 130, 100, 17),
    ("rss", 0.6, 60, 20, 20),
    ("rss", 1.2, 60, 20, 20),
    ("rss", 1.8, 60, 20, 20),
    ("rss", 0.6, 60, 40, 5),
    ("rss", 1.2, 60, 40, 8),
    ("rss", 1.2, 90, 50, 20),
    ("rss", 1.2, 130, 70, 36),
    ("rss", 1.2, 130, 100, 13),
    ("fuzzy", 0.6, 60, 20, 21),
    ("fuzzy", 1.2, 60, 20, 21),
    ("fuzzy", 1.8, 60, 20, 21),
    ("fuzzy", 0.6, 60, 40, 7),
    ("fuzzy", 1.2, 60, 40, 8),
    ("fuzzy", 1.2, 90, 50, 21),
    ("fuzzy", 1.2, 130, 70, 40),
    ("fuzzy", 1.2, 130, 100, 14),
]


@pytest.mark.parametrize(("driver", "approach_mps", "own_kmh", "other_kmh", "last_crash_m"), PUBLISHED)
def test_cut_in__smallest_avoidable_gap_is_that_of_the_published_programme(
    driver: str, approach_mps: float, own_kmh: int, other_kmh: int, last_crash_m: int
) -> None:
    gaps_m = np.arange(1.0, 60.0)
    crashed = crashes(driver, own_kmh=own_kmh, other_kmh=other_kmh, gaps_m=gaps_m, approach_mps=approach_mps)
    assert abs(int(gaps_m[crashed].max()) - last_crash_m) <= 1


def test_cut_in__careful_and_competent_needs_the_gap_of_the_formula() -> None:
    """By hand: after the perception there are 0.75 s of coasting at 0.4, 0.6 s of growing braking, then full braking.

    c = 40 km/h = 11.11: 0.75 c - 0.1125 = 8.22 m, leaving 10.81; ramp 0.6 c - 7.59 0.6^2 / 6 = 6.03 m, leaving
    10.81 - 2.28 = 8.53 (slightly less braking at its start); 8.53^2 / (2 7.593) = 4.79 m: 19.0 m. The perception
    takes 1.095 / 1.8 = 0.61 s and 6.76 m: 25.8 m.
    """
    gaps_m = np.arange(1.0, 60.0, 0.1)
    crashed = crashes("careful_and_competent", own_kmh=60.0, other_kmh=20.0, gaps_m=gaps_m, approach_mps=1.8)
    assert gaps_m[crashed].max() == pytest.approx(25.8, abs=1.2), "a step of 0.1 s is 1.1 m"


@pytest.mark.parametrize(("driver", "approach_mps"), [("rss", 1.5), ("fuzzy", 1.5), ("careful_and_competent", 0.6)])
def test_cut_in__is_avoided_as_r157_requires(driver: str, approach_mps: float) -> None:
    """UN R157, 5.2.5.2: an automated system must avoid the crash if, 0.3 m into the lane, the time to collision exceeds
    v_rel / (2 6 m/s^2) + 0.35 s, and the cut-in was visible for 0.72 s: up to 1.5 m/s across. The defensive drivers
    avoid it, because they brake before the lane is entered."""
    inside_m = 0.5 * (LANE_M - WIDTH_M) + 0.3
    for own, other in CUT_INS:
        required = _required_gap_m((own - other) * KMH, inside_m / approach_mps)
        gaps_m = required + np.arange(0.01, 20.0, 0.5)
        assert not crashes(driver, own_kmh=own, other_kmh=other, gaps_m=gaps_m, approach_mps=approach_mps).any()


CUT_INS = ((60, 20), (60, 40), (50, 10), (40, 20))  # own speed and the other's, km/h


def _required_gap_m(closing_mps: float, inside_s: float) -> float:
    """Smallest gap at the start of a cut-in that R157 requires to be avoided, if 0.3 m of the lane is entered after
    `inside_s`."""
    return closing_mps * (closing_mps / 12.0 + 0.35 + inside_s)


R152 = {10: 0, 15: 0, 20: 0, 25: 0, 30: 0, 35: 0, 40: 0, 42: 0, 45: 15, 50: 25, 55: 30, 60: 35}


@pytest.mark.parametrize(("own_kmh", "at_most_kmh"), R152.items())
def test_emergency__hits_a_standing_car_no_faster_than_r152_allows(own_kmh: int, at_most_kmh: int) -> None:
    """UN R152, 5.2.1.4, table for M1 in running order, with a car that brakes with at most 8 m/s^2."""
    law = EmergencyBraking()
    gap, own, state, began = 60.0, own_kmh * KMH, ReactionState(*np.zeros((3, 1))), np.array([[False]])
    for _ in range(300):
        danger, demand = emergency_braking.emergency(encounter(gap), np.array([[own]]), began, law)
        state, _, braking = react(
            state,
            danger=danger[:, 0],
            demand_mps2=demand[:, 0],
            parameters=BrakeReaction(reaction_s=0.0, jerk_mps3=law.build_up_mps3),
            step_s=STEP_S,
        )
        began = state.braking_mps2[:, None] > law.warning_braking_mps2
        own = max(own - STEP_S * min(float(braking[0]), 8.0), 0.0)
        gap -= STEP_S * own
        if gap <= 0.0:
            break
    assert gap > 0.0 or own * 3.6 <= at_most_kmh
