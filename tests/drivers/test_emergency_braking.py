"""Emergency braking and the reference drivers of UN R157: formulas by hand, and the cut-ins that they can avoid.

UN R157 draws its cut-in figures (Annex 4, Appendix 3, section 5) without numbers. So the boundary between what can be
avoided and what can't is held against two other things: distances computed by hand from the formulas, and those that
the public programme of the EU Joint Research Centre computes (github.com/ec-jrc/JRC-FSM), whose authors proposed the
fuzzy model to the regulation. The tables of R152 (5.2.1.4) are in numbers, and are held directly.
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
from harness.drivers.reaction import Alert, Manner, react
from harness.game.arrays import BoolArray, FloatArray

KMH = 1.0 / 3.6
LENGTH_M, WIDTH_M, LANE_M = 4.3, 1.9, 3.5  # of the cars and the lanes in the programme
STEP_S = 0.1

React = Callable[[Encounters, FloatArray, FloatArray, FloatArray], tuple[BoolArray, FloatArray]]


def meet(gap_m: float, offset_m: float = 0.0, other_mps: float = 0.0, approach_mps: float = 0.0) -> Encounters:
    """One other of one's own size, in one game."""
    values = (True, gap_m + LENGTH_M, gap_m, offset_m, abs(offset_m) - WIDTH_M, other_mps, approach_mps, LENGTH_M)
    return Encounters(*(np.array([[value]]) for value in values))


# --- formulas, by hand -------------------------------------------------------------------------------------------


def test_time_to_collision__is_gap_over_closing_speed() -> None:
    gaps, closing = np.array([20.0, 20.0, 20.0, -3.0]), np.array([10.0, 0.0, -5.0, 10.0])
    np.testing.assert_array_equal(emergency_braking.time_to_collision_s(gaps, closing), [2.0, np.inf, np.inf, 0.0])


def test_rss__gap_is_the_published_formula() -> None:
    # v = 20, r = 0.75, a = 3: after 22.25 m/s; 0.5 (20 + 22.25) 0.75 = 15.84375; 22.25^2 / 12 = 41.255208;
    # other 10 m/s: 100 / 12 = 8.333333
    assert emergency_braking.rss_gap_m(np.array(20.0), np.array(10.0), Rss()) == pytest.approx(48.765625)
    assert emergency_braking.rss_gap_m(np.array(0.0), np.array(30.0), Rss()) == 0.0


def test_rss__clearance_is_the_published_formula() -> None:
    # v = 1, r = 0.75, a = 1: after 1.75; 0.3 + 0.5 (1 + 1.75) 0.75 + 1.75^2 / 2 = 0.3 + 1.03125 + 1.53125
    assert emergency_braking.rss_clearance_m(np.array(1.0), Rss()) == pytest.approx(2.8625)
    # 0.3 + 0.28125 + 0.28125, also for one who moves away
    np.testing.assert_allclose(emergency_braking.rss_clearance_m(np.array([0.0, -2.0]), Rss()), 0.8625)


def test_proactive__is_the_published_formula() -> None:
    # v = 20, other 10: 15 + 400 / 8 - 100 / 14 + 4 = 61.857143; 15 + 400 / 12 - 100 / 14 + 2 = 43.190476
    own, other = np.array(20.0), np.array(10.0)
    gaps = np.array([61.86, 61.857143 - 0.25 * 18.666667, 43.19, 5.0])
    np.testing.assert_allclose(
        emergency_braking.proactive(gaps, own, other, FuzzySafety()), [0.0, 0.25, 1.0, 1.0], atol=1e-6
    )


def test_critical__is_the_published_formula() -> None:
    # v = 20, other 10, a = 0: 7.5 + 100 / 8 = 20; 7.5 + 100 / 12 = 15.833333
    law = FuzzySafety()
    gaps = np.array([20.01, 17.916667, 15.83])
    found = emergency_braking.critical(gaps, np.array(20.0), np.array(0.0), np.array(10.0), law)
    np.testing.assert_allclose(found, [0.0, 0.5, 1.0], atol=1e-6)
    # a = 2: v' - other = 11.5; 0.375 (10 + 11.5) = 8.0625; + 132.25 / 8 = 24.59375, + 132.25 / 12 = 19.083333
    found = emergency_braking.critical(np.array([24.6, 19.08]), np.array(20.0), np.array(2.0), np.array(10.0), law)
    np.testing.assert_array_equal(found, [0.0, 1.0])


def test_critical__who_brakes_enough_already_is_in_danger_only_if_it_is_too_late() -> None:
    # closing 2, a = -3: v' - other = -0.25; 4 / 6 = 0.666667 m are needed
    found = emergency_braking.critical(
        np.array([0.66, 0.67]), np.array(12.0), np.array(-3.0), np.array(10.0), FuzzySafety()
    )
    np.testing.assert_array_equal(found, [1.0, 0.0])
    assert emergency_braking.critical(np.array(0.1), np.array(9.0), np.array(0.0), np.array(10.0), FuzzySafety()) == 0.0


def test_fuzzy__brakes_by_degrees() -> None:
    """PFS up to comfortable, CFS from comfortable to hardest."""
    own, zero = np.array([[20.0]]), np.array([[0.0]])
    for gap, braking in ((61.857143 - 0.25 * 18.666667, 1.0), (17.916667, 5.0), (10.0, 6.0)):
        danger, demand = emergency_braking.fuzzy(meet(gap, other_mps=10.0), own, zero, FuzzySafety())
        assert danger.all()
        assert demand[0, 0] == pytest.approx(braking, abs=1e-5)
    assert not emergency_braking.fuzzy(meet(62.0, other_mps=10.0), own, zero, FuzzySafety())[0].any()


def test_fuzzy__who_comes_over_too_late_is_no_danger() -> None:
    """Past after (gap + two lengths) / closing = (10 + 8.6) / 10 = 1.86 s; the other needs 1.6 m / approach."""
    own, zero = np.array([[20.0]]), np.array([[0.0]])
    soon = meet(10.0, LANE_M, 10.0, 1.6 / 1.9)
    late = meet(10.0, LANE_M, 10.0, 1.6 / 2.0)
    assert emergency_braking.fuzzy(soon, own, zero, FuzzySafety())[0].all()
    assert not emergency_braking.fuzzy(late, own, zero, FuzzySafety())[0].any()


def test_careful_and_competent__a_cut_in_is_perceived_beyond_the_wander_after_the_perception_time() -> None:
    """0.375 m + 0.4 s at 1 m/s: the other's centre has to be 0.775 m from its lane's."""
    law = CarefulAndCompetent(lane_width_m=LANE_M)
    own, no = np.array([[20.0]]), np.array([[False]])

    def danger(moved_m: float, gap_m: float, approach_mps: float = 1.0) -> bool:
        met = meet(gap_m, LANE_M - moved_m, 10.0, approach_mps)
        return bool(emergency_braking.careful_and_competent(met, own, no, law)[0][0, 0])

    assert not danger(0.77, 15.0)
    assert danger(0.78, 15.0)
    assert danger(0.78, 19.9), "time to collision up to 2 s"
    assert not danger(0.78, 20.1)
    assert not danger(0.78, 15.0, approach_mps=-1.0), "on its way back"


def test_careful_and_competent__brakes_harder_for_who_is_wholly_ahead() -> None:
    own, no = np.array([[20.0]]), np.array([[False]])
    for offset, share in ((0.0, 0.85), (1.0, 0.774)):
        _, demand = emergency_braking.careful_and_competent(meet(10.0, offset), own, no, CarefulAndCompetent())
        assert demand[0, 0] == pytest.approx(share * 9.81)


def test_careful_and_competent__goes_on_braking_until_the_danger_is_over() -> None:
    own, law = np.array([[20.0]]), CarefulAndCompetent()
    for gap, began, stays in ((25.0, False, False), (25.0, True, True), (41.0, True, False)):
        danger, _ = emergency_braking.careful_and_competent(meet(gap, other_mps=10.0), own, np.array([[began]]), law)
        assert danger[0, 0] == stays


def test_emergency__warns_and_then_brakes() -> None:
    law, own, no = EmergencyBraking(), np.array([[10.0]]), np.array([[False]])
    for gap, danger, demand in ((22.1, False, None), (21.9, True, 1.0), (14.1, True, 1.0), (13.9, True, 9.0)):
        found, asked = emergency_braking.emergency(meet(gap), own, no, law)
        assert found[0, 0] == danger
        assert demand is None or asked[0, 0] == demand


def test_emergency__leaves_alone_who_stays_beside() -> None:
    law, own, no = EmergencyBraking(), np.array([[10.0]]), np.array([[False]])
    assert not emergency_braking.emergency(meet(10.0, 3.2), own, no, law)[0].any()
    assert emergency_braking.emergency(meet(10.0, 3.2, approach_mps=1.4), own, no, law)[0].all(), "1.3 m in 1 s"


def test_react__takes_its_time_and_builds_up() -> None:
    """0.75 s of coasting, then 12.65 m/s^3 up to 0.774 g: full after 0.6 s."""
    alert, manner = Alert(*np.zeros((3, 1))), Manner(reaction_s=0.75, jerk_mps3=12.65, coasting_mps2=0.4)
    seen = []
    for _ in range(16):
        alert, reacting, braking = react(alert, np.array([True]), np.array([7.59]), manner, STEP_S)
        seen.append((bool(reacting[0]), float(braking[0])))
    assert [each[0] for each in seen] == [True] * 8 + [False] * 8
    assert [each[1] for each in seen[:8]] == [0.4] * 8
    assert [each[1] for each in seen[8:14]] == pytest.approx([1.665, 2.93, 4.195, 5.46, 6.725, 7.59])


def test_react__is_surprised_anew_after_a_calm_second() -> None:
    manner, alert = Manner(reaction_s=0.2, jerk_mps3=10.0), Alert(*np.zeros((3, 2)))
    for danger in [True] * 4 + [False] * 9:
        alert, _, braking = react(alert, np.array([danger, danger]), np.full(2, 8.0), manner, STEP_S)
    assert braking.tolist() == [0.0, 0.0]
    alert, reacting, _ = react(alert, np.array([True, False]), np.full(2, 8.0), manner, STEP_S)
    assert not reacting[0], "still alert"
    _, reacting, _ = react(alert, np.array([True, True]), np.full(2, 8.0), manner, STEP_S)
    assert reacting.tolist() == [False, True]


# --- properties ----------------------------------------------------------------------------------------------------

gaps = st.floats(0.0, 60.0)
speeds = st.floats(0.0, 40.0)


@settings(deadline=None)
@given(gaps, gaps, speeds, speeds, st.floats(-6.0, 3.0))
def test_more_gap__never_calls_for_harder_braking(one: float, two: float, own: float, other: float, a: float) -> None:
    near, far = (meet(gap, other_mps=other) for gap in sorted((one, two)))
    mine, pushed, no = np.array([[own]]), np.array([[a]]), np.array([[False]])
    reactions: tuple[Callable[[Encounters], tuple[BoolArray, FloatArray]], ...] = (
        lambda met: emergency_braking.fuzzy(met, mine, pushed, FuzzySafety()),
        lambda met: emergency_braking.rss(met, mine, Rss()),
        lambda met: emergency_braking.careful_and_competent(met, mine, no, CarefulAndCompetent()),
        lambda met: emergency_braking.emergency(met, mine, no, EmergencyBraking()) if met.gap_m[0, 0] > 0.0 else full(),
    )
    for react_to in reactions:
        asked = [np.where(*react_to(met), 0.0)[0, 0] for met in (near, far)]
        assert asked[0] >= asked[1] - 1e-9


def full() -> tuple[BoolArray, FloatArray]:
    return np.array([[True]]), np.array([[EmergencyBraking().braking_mps2]])


@settings(deadline=None)
@given(gaps, speeds, speeds)
def test_fuzzy__is_between_nothing_and_hardest(gap: float, own: float, other: float) -> None:
    law = FuzzySafety()
    for share in (
        emergency_braking.proactive(np.array(gap), np.array(own), np.array(other), law),
        emergency_braking.critical(np.array(gap), np.array(own), np.array(0.0), np.array(other), law),
    ):
        assert 0.0 <= share <= 1.0


# --- whole cut-ins -------------------------------------------------------------------------------------------------


def crashes(
    own_kmh: float, other_kmh: float, gaps_m: FloatArray, approach_mps: float, manner: Manner, reaction: React
) -> BoolArray:
    """[K] who crashes: a car in the next lane moves over at `approach_mps`, from each of these gaps; one's own keeps
    to its speed until it reacts, and to what is left of it afterwards. Stepped like the programme."""
    gap: FloatArray = gaps_m.astype(float)
    offset: FloatArray = np.full(len(gaps_m), LANE_M)
    own: FloatArray = np.full(len(gaps_m), own_kmh * KMH)
    before = own
    other, crashed = np.full(len(gaps_m), other_kmh * KMH), np.zeros(len(gaps_m), dtype=bool)
    gap, offset = gap + STEP_S * (other - own), offset - STEP_S * approach_mps  # as its first sample is
    alert = Alert(*np.zeros((3, len(gaps_m))))
    for _ in range(340):
        clearance = np.abs(offset) - WIDTH_M
        crashed |= (clearance < 0.0) & (gap < 0.0) & (gap > -2.0 * LENGTH_M)
        moving = np.where(offset > 1e-9, approach_mps, 0.0)
        columns = (gap + LENGTH_M, gap, offset, clearance, other, moving, np.full_like(gap, LENGTH_M))
        met = Encounters(np.ones((len(gap), 1), dtype=bool), *(column[:, None] for column in columns))
        began = alert.braking_mps2[:, None]
        each, demand = reaction(met, own[:, None], ((own - before) / STEP_S)[:, None], began)
        alert, _, braking = react(alert, each[:, 0], demand[:, 0], manner, STEP_S)
        before, own = own, np.maximum(own - STEP_S * braking, 0.0)
        gap, offset = gap + STEP_S * (other - own), np.maximum(offset - STEP_S * moving, 0.0)
    return crashed


# In lanes of 3.5 m the programme's person perceives a cut-in at 0.375 + 0.72 m: 0.4 s at 1.8 m/s. It knows no
# emergency braking for who is wholly ahead.
PERSON = CarefulAndCompetent(lane_width_m=LANE_M, wrapped_braking_g=0.774)
REACTIONS: dict[str, tuple[Manner, React]] = {
    "careful_and_competent": (
        Manner(reaction_s=0.75, jerk_mps3=12.65, coasting_mps2=0.4),
        lambda met, own, a, began: emergency_braking.careful_and_competent(met, own, began > 0.4, PERSON),
    ),
    "rss": (
        Manner(reaction_s=0.75, jerk_mps3=12.65),
        lambda met, own, a, began: emergency_braking.rss(met, own, Rss()),
    ),
    "fuzzy": (
        Manner(reaction_s=0.75, jerk_mps3=12.65),
        lambda met, own, a, began: emergency_braking.fuzzy(met, own, a, FuzzySafety()),
    ),
}

# driver, lateral speed (m/s), own speed and the other's (km/h), greatest gap (m) at the start of the cut-in from which
# the programme's driver crashes; gaps of whole metres. At 130 against 70 km/h its careful and competent person crashes
# from any gap: a time to collision of 2 s leaves too little for 60 km/h.
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
def test_cut_in__is_avoided_from_the_gap_that_the_published_programme_needs(
    driver: str, approach_mps: float, own_kmh: int, other_kmh: int, last_crash_m: int
) -> None:
    gaps_m = np.arange(1.0, 60.0)
    crashed = crashes(own_kmh, other_kmh, gaps_m, approach_mps, *REACTIONS[driver])
    assert abs(int(gaps_m[crashed].max()) - last_crash_m) <= 1


def test_cut_in__careful_and_competent_needs_what_the_formula_says() -> None:
    """By hand: from perceiving on, closing by c takes 0.75 s of coasting at 0.4, 0.6 s of growing, then full braking.

    c = 40 km/h = 11.11: 0.75 c - 0.1125 = 8.22 m, leaving 10.81; ramp 0.6 c - 7.59 0.6^2 / 6 = 6.03 m, leaving
    10.81 - 2.28 = 8.53 (slightly less braking at its start); 8.53^2 / (2 7.593) = 4.79 m: 19.0 m. Perceived after
    1.095 / 1.8 = 0.61 s, in which 6.76 m are lost: 25.8 m.
    """
    gaps_m = np.arange(1.0, 60.0, 0.1)
    crashed = crashes(60.0, 20.0, gaps_m, 1.8, *REACTIONS["careful_and_competent"])
    assert gaps_m[crashed].max() == pytest.approx(25.8, abs=1.2), "a step of 0.1 s is 1.1 m"


@pytest.mark.parametrize(("driver", "approach_mps"), [("rss", 1.5), ("fuzzy", 1.5), ("careful_and_competent", 0.6)])
def test_cut_in__is_avoided_where_r157_demands_it(driver: str, approach_mps: float) -> None:
    """UN R157, 5.2.5.2: to be avoided if, 0.3 m into the lane, the time to collision exceeds v_rel / (2 6 m/s^2) +
    0.35 s, by an automated system, and the cut-in was visible for 0.72 s: up to 1.5 m/s across. The defensive drivers
    manage that, for they begin before the lane is entered."""
    inside_m = 0.5 * (LANE_M - WIDTH_M) + 0.3
    for own, other in CUT_INS:
        demanded = _demanded_gap_m((own - other) * KMH, inside_m / approach_mps)
        gaps_m = demanded + np.arange(0.01, 20.0, 0.5)
        assert not crashes(own, other, gaps_m, approach_mps, *REACTIONS[driver]).any()


def test_cut_in__a_person_is_not_as_quick_as_r157_demands_of_a_machine() -> None:
    """0.75 s and 0.6 s of growing braking are more than 0.35 s: a fast cut-in is not avoided."""
    for own, other in CUT_INS:
        demanded = _demanded_gap_m((own - other) * KMH, (0.5 * (LANE_M - WIDTH_M) + 0.3) / 1.5)
        gaps_m = demanded + np.arange(0.01, 20.0, 0.5)
        assert crashes(own, other, gaps_m, 1.5, *REACTIONS["careful_and_competent"]).any()


CUT_INS = ((60, 20), (60, 40), (50, 10), (40, 20))  # own speed and the other's, km/h


def _demanded_gap_m(closing_mps: float, inside_s: float) -> float:
    """Gap at the start of a cut-in that R157 demands to avoid, if the lane is entered by 0.3 m after so long."""
    return closing_mps * (closing_mps / 12.0 + 0.35 + inside_s)


R152 = {10: 0, 15: 0, 20: 0, 25: 0, 30: 0, 35: 0, 40: 0, 42: 0, 45: 15, 50: 25, 55: 30, 60: 35}


@pytest.mark.parametrize(("own_kmh", "at_most_kmh"), R152.items())
def test_emergency__hits_a_standing_car_no_faster_than_r152_allows(own_kmh: int, at_most_kmh: int) -> None:
    """UN R152, 5.2.1.4, table for M1 in running order, with a car that brakes with 8 m/s^2 at most."""
    law = EmergencyBraking()
    gap, own, alert, began = 60.0, own_kmh * KMH, Alert(*np.zeros((3, 1))), np.array([[False]])
    for _ in range(300):
        danger, demand = emergency_braking.emergency(meet(gap), np.array([[own]]), began, law)
        alert, _, braking = react(
            alert, danger[:, 0], demand[:, 0], Manner(reaction_s=0.0, jerk_mps3=law.build_up_mps3), STEP_S
        )
        began = alert.braking_mps2[:, None] > law.warning_braking_mps2
        own = max(own - STEP_S * min(float(braking[0]), 8.0), 0.0)
        gap -= STEP_S * own
        if gap <= 0.0:
            break
    assert gap > 0.0 or own * 3.6 <= at_most_kmh
