"""Human factors by hand: reaction time, inexact and limited sight, partial use of the car, lapses of attention."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.environments.arena import Arena, Seat
from harness.evaluation.rule_book.course import runs
from harness.game.arrays import FloatArray
from harness.game.human_factors import (
    NO_LIMITS,
    HumanFactors,
    Limits,
    PlayersLimits,
    Sight,
    draw_estimation_errors,
    glances_over_shoulder,
)
from harness.game.initial_state import InitialState, draw_initial_state
from harness.game.lapses import NOTICED_TTC_S, Attention, Lapses, draw_lapses, held_steering_rad, lags
from harness.game.observation_layout import LAYOUT, in_units
from harness.game.state import State
from harness.game.world import World
from harness.road.scene.open_scene import OpenScene
from tests.support.moments import Moment, car, seen
from tests.support.scenes import LEFT_Y, drawn, placed


@pytest.fixture(scope="module")
def arena(straight: OpenScene) -> Iterator[Arena]:
    opened = Arena(straight, 2, [Seat(None), Seat(None)], seed=1)
    yield opened
    opened.close()


def limited(start: InitialState, player: int, limits: Limits) -> InitialState:
    """The initial state with limits for one player."""
    all_limits = list(start.limits)
    all_limits[player] = limits
    return replace(start, limits=tuple(all_limits))


def played(arena: Arena, starts: dict[int, InitialState], actions: FloatArray) -> list[tuple[FloatArray, ...]]:
    """Accelerations, steering angles and observations of each step [G, P, ...]."""
    arena.reset(starts)
    steps = []
    for action in actions:
        state = arena.step(action).quantities.state
        steps.append((state.acceleration_mps2.copy(), state.steering_rad.copy(), arena.observation.copy()))
    return steps


# --- reaction ---------------------------------------------------------------------------------------------------------


def test_reaction__others_are_taken_to_move_on_as_they_did(arena: Arena, straight: OpenScene) -> None:
    """The other player brakes from the first step on. With a reaction time of 4 steps the first player takes it to
    have kept its speed, from where it was 4 steps ago."""
    start, actions = drawn(straight, 1), np.zeros((12, 2, 2, 2))
    actions[:, :, 1, 0] = -0.5
    late = {0: start, 1: limited(start, 0, Limits(delay_steps=4))}
    arena.reset(late)
    ahead, closing = LAYOUT.index("other0_ahead_m"), LAYOUT.index("other0_ahead_mps")
    places, speeds = [arena.state.x_m[1, 1]], [arena.state.speed_mps[1, 1]]
    for step, action in enumerate(actions, 1):
        arena.step(action)
        places.append(arena.state.x_m[1, 1])
        speeds.append(arena.state.speed_mps[1, 1])
        known = max(step - 4, 0)
        own_m, own_mps = arena.state.x_m[1, 0], arena.state.speed_mps[1, 0]
        view = in_units(arena.observation[:, 0], 0.6)
        taken_m = places[known] + speeds[known] * (step - known) * 0.1
        assert view[1, ahead] == pytest.approx(taken_m - own_m, abs=1e-3)
        assert view[1, closing] == pytest.approx(speeds[known] - own_mps, abs=1e-3)
        assert view[0, ahead] == pytest.approx(places[-1] - own_m, abs=1e-3)  # in the other game at once


def test_reaction__a_lapse_stops_what_is_known() -> None:
    lapsed = np.array([False, False, True, True, True, False, False, False])
    assert lags(lapsed, 0).tolist() == [0, 0, 1, 2, 3, 0, 0, 0]
    # two steps late: in step 5 what was known in step 3, which is that of step 1
    assert lags(lapsed, 2).tolist() == [0, 1, 2, 2, 3, 4, 5, 2]


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 2**32), delay=st.integers(0, 30))
def test_reaction__nothing_is_known_sooner_or_of_before_the_game(seed: int, delay: int) -> None:
    attention = Attention(mean_attentive_s=3.0, lapse_s=(0.5, 2.0))
    late = lags(draw_lapses(attention, 200, 0.1, np.random.default_rng(seed)).lapsed, delay)
    steps = np.arange(200)
    assert (late <= steps).all()
    assert (late >= np.minimum(delay, steps)).all()
    assert (np.diff(steps - late) >= 0).all()  # what was known is not forgotten


def body_limits(straight: OpenScene, human_factors: HumanFactors, games: int) -> list[Limits]:
    """The non-ego's limits in some games."""
    starts = straight.start_distribution([HumanFactors(), human_factors], [1.0, 1.0])
    return [draw_initial_state(starts, "episode", game).limits[1] for game in range(games)]


def test_reaction__is_drawn_from_its_range(straight: OpenScene) -> None:
    late = HumanFactors(delay_s=(0.3, 0.8))
    drawn = [each.delay_steps for each in body_limits(straight, late, 500)]
    assert set(drawn) == {3, 4, 5, 6, 7, 8}
    assert np.mean(drawn) == pytest.approx(5.5, abs=0.3)  # 4 standard errors of 1.44 / sqrt(500)


# --- sight ------------------------------------------------------------------------------------------------------------


def test_range__a_vehicle_beyond_it_is_not_seen(moment: Moment, world: World) -> None:
    def sees(range_m: float) -> tuple[float, float]:
        entries = seen(moment(world, [car(50.0, sight_m=range_m), car(80.0)]))
        return entries["other0_seen"], entries["free_right_m@30m"]

    assert sees(29.9)[0] == 0.0
    assert sees(30.1)[0] == 1.0
    assert sees(np.inf) == sees(30.1)
    assert sees(29.9)[1] != sees(30.1)[1]  # and it does not reduce the free width


def test_errors__of_distance_are_a_share_in_every_direction(moment: Moment, world: World) -> None:
    # 20 m ahead and 3.2 m to the right; a quarter farther is 25 m and 4 m
    entries = seen(moment(world, [car(50.0, distance_error=0.25), car(70.0, -4.8)]))
    assert entries["other0_ahead_m"] == pytest.approx(25.0, rel=1e-5)
    assert entries["other0_left_m"] == pytest.approx(-4.0, rel=1e-5)
    near = seen(moment(world, [car(50.0, distance_error=-0.25), car(50.5, -4.8)]))
    # its flank is at 2.4 - 0.9 = 1.5 m rather than at 3.2 - 0.9 = 2.3 m
    assert near["free_right_m@0m"] == pytest.approx(-1.5, abs=0.01)


def test_errors__of_closing_speed_grow_with_the_distance(moment: Moment, world: World) -> None:
    for ahead_m in (10.0, 40.0):
        players = [car(50.0, closing_error_per_s=0.05), car(50.0 + ahead_m, speed_mps=7.0)]
        entries = seen(moment(world, players))
        assert entries["other0_ahead_mps"] == pytest.approx(7.0 - 10.0 + 0.05 * ahead_m, abs=1e-5)
        assert entries["other0_ahead_m"] == pytest.approx(ahead_m, rel=1e-5)
        assert entries["leader_mps"] == pytest.approx(7.0 - 10.0 + 0.05 * ahead_m, abs=1e-5)


def test_errors__have_their_deviation_and_correlation_time() -> None:
    sight = Sight(distance_error=0.2, closing_error_per_s=0.03)
    errors = np.array([draw_estimation_errors(sight, 200, 1.0, np.random.default_rng(seed)) for seed in range(400)])
    logarithm, closing = np.log1p(errors[..., 0]), errors[..., 1]
    for step in (0, 100, 199):  # stationary; standard error 1 / sqrt(800)
        assert logarithm[:, step].std() == pytest.approx(0.2, rel=0.15)
        assert closing[:, step].std() == pytest.approx(0.03, rel=0.15)
    for process in (logarithm, closing):  # after 20 s the correlation is 1/e
        assert np.corrcoef(process[:, 50], process[:, 70])[0, 1] == pytest.approx(np.exp(-1.0), abs=0.2)
        assert np.corrcoef(process[:, 50], process[:, 51])[0, 1] > 0.9
    assert abs(np.corrcoef(logarithm[:, 50], closing[:, 50])[0, 1]) < 0.2


def test_errors__an_arena_applies_the_error_of_each_step(arena: Arena, straight: OpenScene) -> None:
    start = drawn(straight, 1)
    errors = np.zeros((straight.world.steps, 2))
    errors[:, 0] = np.linspace(0.0, 0.5, len(errors))
    coast = np.zeros((8, 2, 2, 2))
    steps = played(arena, {0: start, 1: limited(start, 0, Limits(estimation_errors=errors))}, coast)
    ahead = LAYOUT.index("other0_ahead_m")
    for step, (_, _, observation) in enumerate(steps, 1):
        exact, seen = in_units(observation[:, 0], 0.6)[:, ahead]
        assert seen == pytest.approx(exact * (1.0 + errors[step, 0]), rel=1e-5)
        assert (observation[1, 1] == observation[0, 1]).all()  # the other player has no errors


def test_failure_to_see__occurs_in_its_share_of_the_games(straight: OpenScene) -> None:
    failure = HumanFactors(sight=Sight(looked_but_failed_to_see_share=0.25, noticed_within_m=8.0))
    drawn = [each.sight_m for each in body_limits(straight, failure, 1000)]
    assert set(drawn) == {8.0, np.inf}
    assert np.mean(np.isfinite(drawn)) == pytest.approx(0.25, abs=4 * 0.0137)


def test_open_eyes__remove_failures_to_see_and_keep_the_limits_of_the_body() -> None:
    failures = {"no_shoulder_glance_share": 0.5}
    failures |= {"looked_but_failed_to_see_share": 0.5, "noticed_within_m": 5.0}
    late = (0.2, 0.4)
    person = HumanFactors(delay_s=late, sight=Sight(range_m=60.0, **failures))
    assert person.with_open_eyes == HumanFactors(delay_s=late, sight=Sight(range_m=60.0))


# --- actuator shares --------------------------------------------------------------------------------------------------


def test_actuator_shares__limit_the_car(arena: Arena, straight: OpenScene) -> None:
    start, actions = drawn(straight, 1), np.zeros((3, 2, 2, 2))
    actions[..., 0] = 1.0
    (first, *_) = played(arena, {0: start, 1: limited(start, 1, Limits(actuator_shares=(0.4, 1.0, 1.0)))}, actions)
    largest = straight.world.actuators.max_acceleration_mps2
    followed = 1.0 - np.exp(-0.1 / straight.world.actuators.throttle_lag_s)  # of a request, in a step
    assert first[0][0] == pytest.approx(followed * largest)
    assert first[0][1] == pytest.approx(followed * [largest[0], 0.4 * largest[1]])


# --- independent draws ------------------------------------------------------------------------------------------------


def test_start__without_limits_has_none(straight: OpenScene) -> None:
    assert all(each is NO_LIMITS for each in drawn(straight, 1).limits)
    assert body_limits(straight, HumanFactors(sight=Sight()), 1) == [NO_LIMITS]


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32))
def test_arena__limits_without_effect_equal_no_limits(arena: Arena, seed: int) -> None:
    """With a delay of 0 steps, errors of 0 and full use of the car, the game is bit-identical to one without limits."""
    start = drawn(arena.scene, "law", seed)
    actions = np.random.default_rng(seed).uniform(-0.4, 0.4, (6, 2, 2, 2))
    actions[:, 1] = actions[:, 0]
    neutral = Limits(estimation_errors=np.zeros((arena.world.steps, 2)))
    neutral_start = limited(limited(start, 0, neutral), 1, neutral)
    arena._limits.delays = arena._limits.spares = True  # as if another player had limits
    for acceleration, steering, observation in played(arena, {0: start, 1: neutral_start}, actions):
        assert (acceleration[0] == acceleration[1]).all()
        assert (steering[0] == steering[1]).all()
        assert (observation[0] == observation[1]).all()


# --- lapses of attention ----------------------------------------------------------------------------------------------

TEXTING = Attention(mean_attentive_s=10.0, lapse_s=(4.0, 6.0), bump_steering_sd_rad=0.01)


def test_lapses__have_their_mean_length_and_rate() -> None:
    # an attentive stretch of 10 s on average and a lapse of 5 s: a third of the time, one lapse in 15 s
    lapses = draw_lapses(TEXTING, 200_000, 0.1, np.random.default_rng(2))
    lengths = [last - first + 1 for first, last in runs(lapses.lapsed)]
    assert np.mean(lengths) == pytest.approx(50.0, abs=5 * 0.2)  # uniform over 4..6 s: 5.8 / sqrt(1300) steps
    assert lapses.lapsed.mean() == pytest.approx(1.0 / 3.0, abs=0.03)
    assert len(lengths) == pytest.approx(20_000.0 / 15.0, rel=0.1)


def test_lapses__the_first_may_occur_at_any_time_of_a_game() -> None:
    first = []
    for seed in range(400):
        lapsed = draw_lapses(TEXTING, 250, 0.1, np.random.default_rng(seed)).lapsed
        first.append(lapsed.argmax() * 0.1 if lapsed.any() else np.inf)
    # a third of the games starts within a lapse (5 s of every 15 s); of the others, whose first lapse is exponential
    # with mean 10 s, a share of 1 - 1/e = 0.632 has lapsed by 10 s: 0.333 + 0.667 * 0.632 = 0.755, standard error 0.024
    assert np.mean(np.array(first) == 0.0) == pytest.approx(1.0 / 3.0, abs=4 * 0.024)
    assert np.mean(np.array(first) <= 10.0) == pytest.approx(0.755, abs=4 * 0.022)


def test_lapses__each_has_one_steering_angle() -> None:
    lapses = draw_lapses(TEXTING, 50_000, 0.1, np.random.default_rng(3))
    angles = []
    for first, last in runs(lapses.lapsed):
        within = lapses.steering_rad[first : last + 1]
        assert (within == within[0]).all()
        angles.append(within[0])
    assert not lapses.steering_rad[~lapses.lapsed].any()
    assert np.std(angles) == pytest.approx(0.01, rel=0.15)
    assert np.mean(angles) == pytest.approx(0.0, abs=0.003)


@settings(max_examples=60, deadline=None)
@given(
    mean=st.floats(0.11, 50.0),
    shortest=st.floats(0.01, 3.0),
    more=st.floats(0.0, 3.0),
    step=st.sampled_from([0.02, 0.1, 0.5]),
    seed=st.integers(0, 2**32),
)
def test_lapses__are_apart_and_within_the_range(
    mean: float, shortest: float, more: float, step: float, seed: int
) -> None:
    attention = Attention(mean_attentive_s=mean, lapse_s=(shortest, shortest + more))
    lapses = draw_lapses(attention, 400, step, np.random.default_rng(seed))
    for first, last in runs(lapses.lapsed):
        length = last - first + 1
        assert length <= max((shortest + more) / step + 0.5 + 1e-9, 1)
        if 0 < first < 400 - length:  # not cut off by the start or the end of the game
            assert length >= max(shortest / step - 0.5 - 1e-9, 1)


def test_glances__have_a_lognormal_length_with_the_middle_90_percent_in_the_range() -> None:
    glances = Attention(mean_attentive_s=1.5, lapse_s=(0.42, 4.0), lapse_distribution="lognormal")
    drawn = np.array([glances.lapse_at_s(np.random.default_rng(seed)) for seed in range(4000)])
    assert np.quantile(drawn, [0.05, 0.95]) == pytest.approx([0.42, 4.0], rel=0.1)
    # mu = ln(0.42 * 4.0) / 2 = 0.2594, sigma = ln(4.0 / 0.42) / 3.2898 = 0.6851: exp(mu + sigma^2 / 2) = 1.639
    assert glances.mean_lapse_s == pytest.approx(1.639, abs=1e-3)
    assert drawn.mean() == pytest.approx(1.639, rel=0.05)  # standard error 1.27 / sqrt(4000) = 0.02
    assert np.mean(drawn >= 2.0) == pytest.approx(0.265, abs=0.03)  # what was counted of young drivers


def test_lapses__released_or_held(arena: Arena, straight: OpenScene) -> None:
    """Both players brake for two steps, then their attention lapses: one releases the pedals, one holds them."""
    start, steps = drawn(straight, 1), straight.world.steps
    lapsed = np.arange(steps) >= 2
    held, released = (Lapses(lapsed, np.zeros(steps), held=each) for each in (True, False))
    actions = np.zeros((8, 2, 2, 2))
    actions[..., 0] = np.where(np.arange(8) < 2, -0.2, 0.5)[:, None, None]
    played_steps = played(arena, {0: replace(start, lapses=(released, held)), 1: start}, actions)
    braking = played_steps[1][0][0]
    assert (braking < 0.0).all()
    for acceleration, steering, _ in played_steps[2:]:
        assert acceleration[0, 1] == pytest.approx(braking[1])
        assert steering[0] == pytest.approx([0.0, 0.0], abs=1e-9)
    released_mps2 = [each[0][0, 0] for each in played_steps[1:]]
    assert (np.diff(np.abs(released_mps2)) < 0.0).all()  # it fades with the lag of the pedals


@pytest.mark.parametrize(("ahead_mps", "ends"), [(5.0, True), (10.0, False)])
def test_glance__ends_where_the_car_closes_in_on_the_one_ahead(
    arena: Arena, straight: OpenScene, ahead_mps: float, ends: bool
) -> None:
    """A car at 10 m/s, 25 m behind another, in a glance from the first step on. At 5 m/s the other is 4 s ahead in the
    step in which 20 m are left, after 1 s; where it is as fast, the glance goes on."""
    length_m = straight.world.length_m
    ahead_m = 100.0 + 25.0 + 0.5 * (length_m[0] + length_m[1])
    start = placed(straight, (100.0, LEFT_Y, 0.0, 10.0), (ahead_m, LEFT_Y, 0.0, ahead_mps))
    steps = straight.world.steps
    glance = Lapses(np.ones(steps, dtype=bool), np.zeros(steps), held=True)
    arena.reset({0: replace(start, lapses=(glance, Lapses.none(steps))), 1: start})
    lapsed = []
    for _ in range(15):
        arena.step(np.zeros((2, 2, 2)))
        lapsed.append(bool(arena.state.lapsed[0, 0]))
    attentive_from = lapsed.index(False) if False in lapsed else None
    assert attentive_from == (pytest.approx(10, abs=1) if ends else None)
    assert not any(lapsed[attentive_from:] if ends else [])


def test_glance__that_ends_is_followed_by_the_reaction_time() -> None:
    """A glance from step 2 on ends in step 4: two steps later the player knows what it then saw."""
    limits, state = PlayersLimits(1, 1, 8), State.empty(1, 1)
    glance = Lapses(np.arange(8) >= 2, np.zeros(8), held=True)
    limits.reset(0, 0, Limits(delay_steps=2), glance, state)
    state.lapsed[:], state.step[:] = True, 4
    limits.end_glances(state, np.array([[NOTICED_TTC_S]]))
    assert [int(limits.lags(np.array([step]))[0, 0]) for step in range(8)] == [0, 1, 2, 2, 3, 4, 2, 2]


def test_shoulder_glance__is_missing_in_its_share_of_the_games() -> None:
    factor = Sight(no_shoulder_glance_share=0.75)
    drawn = [glances_over_shoulder(factor, draw) for draw in np.random.default_rng(1).random(2000)]
    # standard error sqrt(0.75 * 0.25 / 2000) = 0.0097
    assert np.mean(drawn) == pytest.approx(0.25, abs=4 * 0.0097)


def test_hands__random_decisions_are_correlated_in_time(straight: OpenScene) -> None:
    noise = np.array([drawn(straight, seed).noise for seed in range(300)])  # [N, P, T, 2]
    for step in (0, 100):
        assert noise[:, :, step].std() == pytest.approx(1.0, abs=0.1)
    for later, correlation in ((1, np.exp(-0.2)), (5, np.exp(-1.0)), (40, 0.0)):  # steps of 0.1 s; 0.5 s
        pairs = noise[:, :, 20].ravel(), noise[:, :, 20 + later].ravel()
        assert np.corrcoef(*pairs)[0, 1] == pytest.approx(correlation, abs=0.12)  # 4 standard errors of 1 / sqrt(1200)


def test_glance__peripheral_sight_turns_the_car_to_the_road_in_two_seconds() -> None:
    state = State.empty(1, 2)
    state.heading_rad[:], state.speed_mps[:] = [[0.1, -0.1]], 10.0
    road = (np.array([[0.0, 0.02]]), np.zeros((1, 2)))
    found = held_steering_rad(state, road, np.array([2.7, 2.7]))
    # 0.1 rad in 2 s at 10 m/s: a curvature of 0.005 /m, and a wheel of atan(2.7 * 0.005) = 0.0134992
    assert found[0] == pytest.approx([-0.0134992, 0.02 + 0.0134992], abs=1e-6)
