"""The initial state of a game: all its random draws, and their dependence on the named parts only."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.game.human_factors import HumanFactors, Sight
from harness.game.initial_state import InitialState, StartDistribution, draw_initial_state
from harness.game.lapses import Attention
from harness.game.seeding import seed_of
from harness.game.start_range import OnLine, StartRange
from harness.road.scene.open_scene import OpenScene

TEXTING = HumanFactors(attention=Attention(mean_attentive_s=2.0, lapse_s=(1.0, 2.0)))


@pytest.fixture(scope="module")
def start_distribution(merge: OpenScene) -> StartDistribution:
    return merge.start_distribution((HumanFactors(), HumanFactors()), (1.0, 1.0))


def starts(start_distribution: StartDistribution, games: int = 200) -> list[InitialState]:
    return [draw_initial_state(start_distribution, "test", 1, "episode", k) for k in range(games)]


def test_start__is_within_the_ranges_of_the_scene(start_distribution: StartDistribution) -> None:
    drawn = starts(start_distribution)
    positions = np.array([each.position_m for each in drawn])
    speeds = np.array([each.speed_mps for each in drawn])
    beside = positions[:, 1] - positions[:, 0]
    for values, low, high in ((positions[:, 0], 30.0, 45.0), (beside, -8.0, 8.0), (speeds, 11.0, 14.0)):
        assert values.min() >= low
        assert values.max() <= high
        assert values.max() - values.min() > 0.9 * (high - low)  # the draws cover the range


def test_start__is_on_the_lane_with_the_bumper_at_the_position(start_distribution: StartDistribution) -> None:
    for each in starts(start_distribution, 20):
        assert each.x_m == pytest.approx(each.position_m - 2.3)  # the centre of 4.6 m
        assert each.y_m == pytest.approx([-1.6, -4.8])  # lanes 1 and 0
        assert each.heading_rad == pytest.approx([0.0, 0.0])


def test_start__the_same_parts_give_the_same_start(start_distribution: StartDistribution) -> None:
    one, two = draw_initial_state(start_distribution, "a", 1), draw_initial_state(start_distribution, "a", 1)
    for field in fields(InitialState):
        if field.name not in ("lapses", "lazy_noise"):
            assert np.array_equal(getattr(one, field.name), getattr(two, field.name))
    assert np.array_equal(one.noise, two.noise)
    assert one.seed == two.seed


def test_start__is_paired_for_all_human_factors(start_distribution: StartDistribution) -> None:
    """What differs in one player changes no draw of another, and no draw of its own that has other parts."""
    late = replace(TEXTING, delay_s=(0.2, 0.9), sight=Sight(distance_error=0.1))
    own, other = (replace(start_distribution, human_factors=([TEXTING], [each])) for each in (HumanFactors(), late))
    slow = replace(start_distribution, human_factors=([TEXTING], [HumanFactors(delay_s=late.delay_s)]))
    for episode in range(5):
        one = draw_initial_state(own, "a", episode)
        two = draw_initial_state(replace(other, present_share=(1.0, 0.0)), "a", episode)
        for name in ("x_m", "y_m", "heading_rad", "speed_mps", "position_m", "noise", "seed"):
            assert np.array_equal(getattr(one, name), getattr(two, name))
        assert np.array_equal(one.lapses[0].lapsed, two.lapses[0].lapsed)
        assert not one.lapses[1].lapsed.any()
        assert two.lapses[1].lapsed.any()
        assert two.limits[1].delay_steps > 0 == one.limits[1].delay_steps
        assert two.limits[1].delay_steps == draw_initial_state(slow, "a", episode).limits[1].delay_steps
        assert two.present.tolist() == [True, False]


def test_start__a_share_of_the_games_has_one_player(start_distribution: StartDistribution) -> None:
    drawn = starts(replace(start_distribution, present_share=(1.0, 0.25)), 800)
    present = np.array([each.present for each in drawn])
    assert present[:, 0].all()
    assert present[:, 1].mean() == pytest.approx(0.25, abs=4 * 0.0153)  # sqrt(0.25 * 0.75 / 800)


def test_start__has_noise_and_lapses_for_every_step(start_distribution: StartDistribution) -> None:
    start = draw_initial_state(start_distribution, "a", 1)
    assert start.noise.shape == (2, 250, 2)  # 25 s in steps of 0.1 s
    assert replace(start, parts=("b", 1)).noise is start.noise  # drawn once
    assert [each.lapsed.shape for each in start.lapses] == [(250,), (250,)]


@pytest.mark.parametrize(
    ("position", "scale", "pose"),
    [
        (6.0, 1.0, (4.0, 0.0, 0.0)),  # bumper at (6, 0), centre 2 m behind
        (12.0, 1.0, (10.0, 0.0, np.pi / 2)),  # bumper at (10, 2), 2 m round the corner
        (15.0, 1.0, (10.0, 3.0, np.pi / 2)),
        (1.0, 1.0, (-1.0, 0.0, 0.0)),  # the rear may stand before the lane's start
        (20.0, 1.0, (10.0, 8.0, np.pi / 2)),  # the very end
        (30.0, 0.5, (10.0, 3.0, np.pi / 2)),  # the lane has a length of 40 m in SUMO: 30 m are 15 m along its shape
    ],
)
def test_pose__along_a_lane_that_bends(position: float, scale: float, pose: tuple[float, ...]) -> None:
    line = np.array([(0.0, 0.0), (10.0, 0.0), (10.0, 10.0)])
    place = StartRange(line=line, place=OnLine((0.0, 1.0)), speed_mps=(0.0, 1.0), scale=scale)
    assert place.pose(position, 4.0) == pytest.approx(pose)


PART = st.one_of(st.text(max_size=5), st.integers(-5, 5))
PARTS = st.lists(PART, min_size=1, max_size=4).map(tuple)


@settings(max_examples=100, deadline=None)
@given(PARTS, PARTS)
def test_seed__differs_for_different_parts(one: tuple[str | int, ...], two: tuple[str | int, ...]) -> None:
    assert (seed_of(*one) == seed_of(*two)) == (one == two)
    assert 0 <= seed_of(*one) < 2**63


def test_seed__distinguishes_numbers_from_text_and_the_ends_of_parts() -> None:
    assert len({seed_of("a", 1), seed_of("a", "1"), seed_of("a1"), seed_of("a", "", "1"), seed_of(1, "a")}) == 5


def test_seed__is_the_same_in_every_process_and_release() -> None:
    # printf 'str:assessment\x1fint:1\x1fstr:episode\x1fint:7' | sha256sum  begins with  a3c78411fec693c7;
    # with any other number, earlier results could not be repeated
    digest = bytes.fromhex("a3c78411fec693c7")
    assert seed_of("assessment", 1, "episode", 7) == int.from_bytes(digest, "little") >> 1


def test_start__the_place_in_the_cycle_of_traffic_lights_is_within_its_range(
    start_distribution: StartDistribution,
) -> None:
    narrow = replace(start_distribution, signal_place=(0.28, 0.4))
    places = [
        [draw_initial_state(each, "signals", k).signal_place for k in range(200)]
        for each in (start_distribution, narrow)
    ]
    anywhere, within = map(np.array, places)
    assert anywhere.min() < 0.05 < 0.95 < anywhere.max()
    assert within == pytest.approx(0.28 + 0.12 * anywhere)  # the same draw
