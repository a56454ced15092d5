"""Human factors by hand: late decisions, inexact and limited sight, partial use of the car, lapses of attention."""

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
    Attention,
    HumanFactors,
    Lapses,
    Limits,
    Reaction,
    Sight,
    draw_estimation_errors,
    draw_lapses,
    unseen_behind_m,
)
from harness.game.initial_state import InitialState, draw_initial_state
from harness.game.observation_layout import LAYOUT, in_units
from harness.game.world import World
from harness.road.scene.open_scene import OpenScene
from tests.support.moments import Moment, car, seen
from tests.support.scenes import drawn


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


def test_delay__the_car_follows_earlier_decisions(arena: Arena, straight: OpenScene) -> None:
    start = drawn(straight, 1)
    actions = np.random.default_rng(0).uniform(-0.3, 0.3, (12, 2, 2, 2))
    actions[:, 1] = actions[:, 0]  # the same decisions in both games
    seen = played(arena, {0: start, 1: limited(start, 0, Limits(delay_steps=4))}, actions)
    assert not seen[3][0][1, 0]
    assert not seen[3][1][1, 0]
    for step in range(4, 12):
        pedals = actions[step - 4, 1, 0, 0]
        car = straight.world.actuators
        largest = car.max_acceleration_mps2 if pedals > 0 else car.max_braking_mps2
        assert seen[step][0][1, 0] == pytest.approx(pedals * largest[0], rel=0.05)  # less the friction circle
    assert (seen[3][0][1, 1] == seen[3][0][0, 1]).all()  # the other player has no delay


def test_delay__after_a_lapse_the_controls_are_released_until_the_first_decision_arrives() -> None:
    lapsed = np.array([False, True, True, False, False, False, False, True, False, False])
    steering = np.where(lapsed, -0.01, 0.0)
    steering[7] = 0.02
    delayed = Lapses(lapsed, steering).with_reaction_delay(2)
    assert delayed.lapsed.tolist() == [False, True, True, True, True, False, False, True, True, True]
    assert delayed.steering_rad.tolist() == [0.0, -0.01, -0.01, -0.01, -0.01, 0.0, 0.0, 0.02, 0.02, 0.02]


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 2**32), delay=st.integers(0, 30))
def test_delay__extends_lapses_and_starts_none_earlier(seed: int, delay: int) -> None:
    attention = Attention(mean_attentive_s=3.0, lapse_s=(0.5, 2.0), bump_steering_sd_rad=0.001)
    lapses = draw_lapses(attention, 200, 0.1, np.random.default_rng(seed))
    delayed = lapses.with_reaction_delay(delay)
    assert (delayed.lapsed >= lapses.lapsed).all()
    assert (delayed.steering_rad[lapses.lapsed] == lapses.steering_rad[lapses.lapsed]).all()
    begins = np.flatnonzero(np.diff(np.concatenate(([0], delayed.lapsed.astype(int)))) == 1)
    assert lapses.lapsed[begins].all()
    if delay == 0:
        assert (delayed.lapsed == lapses.lapsed).all()


def body_limits(straight: OpenScene, human_factors: HumanFactors, games: int) -> list[Limits]:
    """The non-ego's limits in some games."""
    starts = straight.start_distribution([HumanFactors(), human_factors], [1.0, 1.0])
    return [draw_initial_state(starts, "episode", game).limits[1] for game in range(games)]


def test_delay__is_drawn_from_its_range(straight: OpenScene) -> None:
    late = HumanFactors(reaction=Reaction(delay_s=(0.3, 0.8)))
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
    failures = {"no_blind_spot_check_share": 0.5, "unseen_behind_m": 1.0}
    failures |= {"looked_but_failed_to_see_share": 0.5, "noticed_within_m": 5.0}
    late = Reaction(delay_s=(0.2, 0.4))
    person = HumanFactors(reaction=late, sight=Sight(range_m=60.0, **failures))
    assert person.with_open_eyes == HumanFactors(reaction=late, sight=Sight(range_m=60.0))


# --- actuator shares --------------------------------------------------------------------------------------------------


def test_actuator_shares__limit_the_car(arena: Arena, straight: OpenScene) -> None:
    start, actions = drawn(straight, 1), np.zeros((3, 2, 2, 2))
    actions[..., 0] = 1.0
    (first, *_) = played(arena, {0: start, 1: limited(start, 1, Limits(actuator_shares=(0.4, 1.0, 1.0)))}, actions)
    largest = straight.world.actuators.max_acceleration_mps2
    assert first[0][0] == pytest.approx(largest)
    assert first[0][1] == pytest.approx([largest[0], 0.4 * largest[1]])


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


def test_blind_spot_check__is_missing_in_its_share_of_the_games() -> None:
    factor = Sight(no_blind_spot_check_share=0.75, unseen_behind_m=1.0)
    drawn = [unseen_behind_m(factor, draw) for draw in np.random.default_rng(1).random(2000)]
    assert set(drawn) == {1.0, -np.inf}
    # standard error sqrt(0.75 * 0.25 / 2000) = 0.0097
    assert np.mean(np.isfinite(drawn)) == pytest.approx(0.75, abs=4 * 0.0097)
