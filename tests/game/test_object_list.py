"""The object list of the ego: each kind of error by hand, and no error at all to the byte."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.game.memory import as_they_are
from harness.game.object_list import ObjectLists
from harness.game.observation import Seen, observe
from harness.game.perception_errors import Ghost, GhostRates, Noise, PerceptionErrors, draw_ghosts, draw_object
from harness.game.quantities import Quantities
from harness.road.scene.open_scene import OpenScene
from tests.support.moments import FAR, Moment, car

STEPS, STEP_S = 20, 0.1
GAME = np.array([0])
PARTS = ("assessment", 1, "episode", 0)
LOSSES = ((0.0, 6.0, 5.0), (100.0, 30.0, 10.0))
STANDS_THERE = GhostRates(
    per_min=600.0,
    mean_lifetime_s=0.2,
    ahead_m=(20.0, 20.0),
    left_m=(3.0, 3.0),
    speed_mps=(2.0, 2.0),
    length_m=4.0,
    width_m=1.5,
)


def lists(errors: PerceptionErrors, episode: int = 0) -> ObjectLists:
    """Those of one game that begins."""
    made = ObjectLists(errors, 1, STEPS, STEP_S)
    made.reset(0, (*PARTS[:-1], episode))
    return made


def look(made: ObjectLists, q: Quantities, step: int = 0, *, advance: bool = True) -> Seen:
    """What the players know in a step."""
    q.state.step[:] = step
    count = q.bodies.present.shape[1]
    players = q.state.present.shape[1]
    names = [[*("ego", "non_ego")[:players], *(f"car{k}" for k in range(count - players))]]
    if advance:
        made.advance(q, names, GAME)
    return made.seen(q, as_they_are(q.bodies, players), names, GAME)


def is_seen(seen: Seen, body: int = 1) -> bool:
    return not seen.hidden[0, 0, body]


placed = st.builds(
    car,
    x_m=st.floats(-20.0, 220.0),
    y_m=st.floats(-6.0, 2.0),
    heading_rad=st.floats(-3.0, 3.0),
    speed_mps=st.floats(0.0, 20.0),
)


@given(st.lists(placed, min_size=2, max_size=2), st.lists(placed, max_size=3), st.integers(0, 5))
def test_object_list__without_errors_the_observation_is_the_same_bytes(
    merge: OpenScene, moment: Moment, players: list[dict[str, Any]], others: list[dict[str, Any]], step: int
) -> None:
    q = moment(merge.world, players, others)
    none_at_all = PerceptionErrors(range_m=120.0, losses=((0.0, 0.0, 1.0),), ghosts=replace(STANDS_THERE, per_min=0.0))
    for errors in (PerceptionErrors(), none_at_all):
        seen = look(lists(errors), q, step)
        assert observe(q, seen).tobytes() == observe(q).tobytes()


@pytest.mark.parametrize(("x_m", "y_m", "there"), [(139.0, -1.6, True), (141.0, -1.6, False), (100.0, 39.0, False)])
def test_object_list__has_what_is_in_range_and_in_the_field_of_view(
    merge: OpenScene, moment: Moment, x_m: float, y_m: float, there: bool
) -> None:
    """The range is 40 m, and the field of view 90 degrees: beside the ego nothing is seen."""
    errors = PerceptionErrors(range_m=40.0, field_of_view_rad=np.pi / 2)
    seen = look(lists(errors), moment(merge.world, [car(100.0), car(x_m, y_m)]))
    assert is_seen(seen) is there
    assert not seen.hidden[0, 1, 0], "the person's eyes are its own"


def test_object_list__is_as_old_as_the_latency(merge: OpenScene, moment: Moment) -> None:
    """With 0.2 s and steps of 0.1 s: the place of two steps ago; at the start that of the start."""
    made = lists(PerceptionErrors(latency_s=0.2))
    known = []
    for step in range(5):
        seen = look(made, moment(merge.world, [car(100.0), car(120.0 + step, speed_mps=10.0 + step)]), step)
        known.append((seen.motion[0, 0, 0, 1], seen.motion[3, 0, 0, 1]))
    assert known == [(120.0, 10.0), (120.0, 10.0), (120.0, 10.0), (121.0, 11.0), (122.0, 12.0)]


def test_object_list__a_new_object_is_known_after_the_latency(merge: OpenScene, moment: Moment) -> None:
    made, q = lists(PerceptionErrors(range_m=40.0, latency_s=0.2)), moment(merge.world, [car(100.0), car(120.0)])
    look(made, moment(merge.world, [car(100.0), car(190.0)]), 0)
    assert [is_seen(look(made, q, step)) for step in (1, 2, 3)] == [False, False, True]


def test_object_list__looking_twice_in_a_step_changes_nothing(merge: OpenScene, moment: Moment) -> None:
    errors = PerceptionErrors(latency_s=0.1, losses=((0.0, 300.0, 0.3),), position=Noise(sd=1.0))
    made, q = lists(errors), moment(merge.world, [car(100.0), car(120.0)])
    for step in range(STEPS):
        first = observe(q, look(made, q, step))
        assert observe(q, look(made, q, step, advance=False)).tobytes() == first.tobytes()


@pytest.mark.parametrize(("x_m", "share"), [(100.0, 0.5 / 1.5), (150.0, 2.25 / 3.25), (190.0, None)])
def test_object_list__objects_are_lost_for_the_share_of_the_rates(
    merge: OpenScene, moment: Moment, x_m: float, share: float | None
) -> None:
    """At 0 m 0.1 losses per second of 5 s each: lost for 0.5 of 1.5 s. At 50 m, between the tables, 0.3 of 7.5 s."""
    q = moment(merge.world, [car(100.0), car(x_m)])
    if share is None:
        at_90_m = 0.46 * 9.5  # 27.6 losses per minute
        share = at_90_m / (1.0 + at_90_m)
    lost = [lists_lost(q, episode) for episode in range(400)]
    assert np.mean(lost) == pytest.approx(share, abs=4.0 * np.sqrt(0.25 / 400))


def lists_lost(q: Quantities, episode: int) -> bool:
    made = lists(PerceptionErrors(losses=LOSSES), episode)
    seen = look(made, q)
    assert made.lost(0) == ([] if is_seen(seen) else ["non_ego"])
    return not is_seen(seen)


def test_object_list__an_object_is_lost_and_found_at_its_rates(merge: OpenScene, moment: Moment) -> None:
    """In 0.1 s, with 2 losses per second of 0.25 s each: lost with 1 - exp(-0.2), found with 1 - exp(-0.4)."""
    q, before_after = moment(merge.world, [car(100.0), car(120.0)]), list[tuple[bool, bool]]()
    for episode in range(150):
        made = lists(PerceptionErrors(losses=((0.0, 120.0, 0.25),)), episode)
        there = [is_seen(look(made, q, step)) for step in range(STEPS)]
        before_after += pairwise(there)
    was, stays = np.array(before_after).T
    assert 1.0 - stays[was].mean() == pytest.approx(1.0 - np.exp(-0.2), abs=0.04)
    assert stays[~was].mean() == pytest.approx(1.0 - np.exp(-0.4), abs=0.06)


def test_object_list__noise_grows_with_the_distance(merge: OpenScene, moment: Moment) -> None:
    """At 50 m: 0.5 + 50 x 0.01 = 1 m in x and in y, and 0.2 + 50 x 0.004 = 0.4 m/s."""
    errors = PerceptionErrors(position=Noise(sd=0.5, sd_per_m=0.01), speed=Noise(sd=0.2, sd_per_m=0.004))
    q = moment(merge.world, [car(100.0), car(150.0)])
    known = np.array([look(lists(errors, episode), q).motion[:, 0, 0, 1] for episode in range(400)])
    assert known.mean(axis=0) == pytest.approx([150.0, -1.6, 0.0, 10.0], abs=0.2)
    assert known.std(axis=0) == pytest.approx([1.0, 1.0, 0.0, 0.4], rel=0.12)


def test_object_list__noise_is_correlated_in_time() -> None:
    """With steps of 0.1 s and a persistence of 0.5 s, by exp(-0.2) from step to step."""
    errors = PerceptionErrors(position=Noise(sd=1.0, persistence_s=0.5), speed=Noise(sd=1.0, persistence_s=0.05))
    draws = draw_object(errors, 20_000, STEP_S, "non_ego", *PARTS)[:, 1:]
    found = [np.corrcoef(each[:-1], each[1:])[0, 1] for each in draws.T]
    assert found == pytest.approx([np.exp(-0.2), np.exp(-0.2), np.exp(-2.0)], abs=0.03)
    assert draws.std(axis=0) == pytest.approx([1.0, 1.0, 1.0], abs=0.05)


def test_object_list__a_ghost_appears_beside_the_ego_and_goes_its_way(merge: OpenScene, moment: Moment) -> None:
    """The ego at (100, -1.6) heads east; the ghost appears 20 m ahead, 3 m to the left, and moves 0.2 m in a step."""
    made, q = lists(PerceptionErrors(ghosts=STANDS_THERE)), moment(merge.world, [car(100.0), FAR])
    plan = draw_ghosts(STANDS_THERE, STEPS, STEP_S, *PARTS)
    of_plan = [(first, ghost.end_step) for first, ghosts in plan.items() for ghost in ghosts]
    there = 0
    for step in range(STEPS):
        seen = look(made, q, step)
        expected = sorted(
            (120.0 + 0.2 * (step - first), 1.4, 0.0, 2.0) for first, end in of_plan if first <= step < end
        )
        assert sorted(made.ghosts(0, step)) == [pytest.approx(each) for each in expected]
        assert (~seen.hidden[0, 0, 2:]).sum() == len(expected)
        assert seen.hidden[0, 1, 2:].all(), "the person sees no ghost"
        there += len(expected)
    assert there > 10


def test_object_list__a_ghost_is_an_object_without_priority(merge: OpenScene, moment: Moment) -> None:
    """It is seen as a car in its place is, whose way crosses no other way."""
    ghost = replace(STANDS_THERE, ahead_m=(20.0, 20.0), left_m=(0.0, 0.0), mean_lifetime_s=100.0, per_min=1.0)
    made = next(made for made in (lists(PerceptionErrors(ghosts=ghost), k) for k in range(100)) if len(started(made)))
    q = moment(merge.world, [car(100.0), FAR])
    with_ghost = observe(q, look(made, q))
    count = len(made.ghosts(0, 0))
    real = moment(merge.world, [car(100.0), FAR], [car(120.0, speed_mps=2.0, length_m=4.0, width_m=1.5)] * count)
    assert with_ghost[0, 0].tobytes() == observe(real)[0, 0].tobytes()
    assert with_ghost[0, 1].tobytes() == observe(q)[0, 1].tobytes()


def started(made: ObjectLists) -> list[Ghost]:
    """The ghosts that are there when the game starts."""
    return made._drawn_ghosts[0].get(0, [])


def test_object_list__as_many_ghosts_are_there_as_their_rate_and_lifetime_say() -> None:
    """2 per second for 0.5 s each: one at a time, at the start and in every other step."""
    kind = replace(STANDS_THERE, per_min=120.0, mean_lifetime_s=0.5)
    counts = np.zeros(STEPS)
    for episode in range(300):
        for first, ghosts in draw_ghosts(kind, STEPS, 0.01, "episode", episode).items():
            for ghost in ghosts:
                counts[first : ghost.end_step] += 1
    assert counts / 300 == pytest.approx(np.ones(STEPS), abs=0.25)


def test_object_list__the_draws_of_an_object_hang_on_the_game_and_its_name_alone() -> None:
    errors = PerceptionErrors(position=Noise(sd=1.0))
    one = draw_object(errors, STEPS, STEP_S, "car0", *PARTS)
    assert one.tobytes() == draw_object(errors, STEPS, STEP_S, "car0", *PARTS).tobytes()
    assert (one != draw_object(errors, STEPS, STEP_S, "car1", *PARTS)).any()
    assert (one != draw_object(errors, STEPS, STEP_S, "car0", *PARTS[:-1], 1)).any()
