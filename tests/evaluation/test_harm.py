"""Harm to others than the ego in a game, by hand.

The road of the merge runs east; its lanes are centred on y = -4.8 and -1.6 m. Cars are 5 m long and 1.8 m wide.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, seed
from hypothesis import strategies as st

from harness.evaluation.measured_game import measured
from harness.evaluation.recorded_game import BodyKind
from harness.evaluation.severity.contact import comes_to_touch
from harness.game.arrays import BoolArray
from harness.game.follower import FOLLOWER
from harness.game.geometry import Box
from tests.support.traces import along, game, rows

FOOT = BodyKind(length_m=0.5, width_m=0.5, vehicle_class="pedestrian")
EGO = rows("ego", along(100.0, -1.6, 0.0, 10.0, 11), end="goal")
INTO_VAN = rows("non_ego", along(40.0, -4.8, 0.0, 10.0, 6), end="collision")
VAN = rows("van", along(48.2, -4.8, 0.0, 0.0, 11))  # 3.2 m ahead: reached at 10 m/s after 0.32 s
HARM = ("person_failed", "bystander_failed", "harm_to_others")


def harm(merge: Any, *players: list[dict]) -> list[int | None]:
    trace = pd.DataFrame([row for player in players for row in player])
    cells = measured(game(merge.world, trace, {"car": BodyKind(), "foot": FOOT}))
    return [cells[name] for name in HARM]


@pytest.mark.parametrize(
    ("players", "expected"),
    [
        ([EGO], [None, None, None]),
        ([EGO, rows("van", along(20.0, -4.8, 0.0, 10.0, 11))], [None, 0, 0]),
        ([EGO, rows("non_ego", along(40.0, -4.8, 0.0, 10.0, 11), end="goal")], [0, None, 0]),
        ([EGO, rows("non_ego", along(40.0, -4.8, 0.0, 10.0, 11), end="timeout")], [0, None, 0]),
        ([EGO, rows("non_ego", along(40.0, -4.8, 0.1, 10.0, 11), end="rail")], [1, None, 1]),
        ([EGO, INTO_VAN, VAN], [1, 1, 1]),
        # the van drives into one that stands, 3.2 m ahead of it; the person is far
        (
            [EGO, rows("van", along(40.0, -4.8, 0.0, 10.0, 6)), rows("truck", along(48.2, -4.8, 0.0, 0.0, 11))],
            [None, 1, 1],
        ),
        # they overlap from the start: SUMO put them there
        (
            [EGO, rows("van", along(40.0, -4.8, 0.0, 0.0, 6)), rows("truck", along(42.0, -4.8, 0.0, 0.0, 6))],
            [None, 0, 0],
        ),
    ],
    ids=["alone", "traffic", "goal", "late", "rail", "into another", "bystanders", "placed in each other"],
)
def test_harm__is_a_failure_without_the_ego(players: list[Any], expected: list[int | None], merge: Any) -> None:
    assert harm(merge, *players) == expected


def test_harm__a_contact_with_the_ego_is_none_of_it(merge: Any) -> None:
    ego = rows("ego", along(20.0, -1.6, 0.0, 14.0, 3), end="collision")
    assert harm(merge, ego, rows("non_ego", along(26.5, -1.6, 0.0, 4.0, 3), end="collision")) == [0, None, 0]
    assert harm(merge, ego, rows(FOLLOWER, along(13.8, -1.6, 0.0, 30.0, 3))) == [None, 0, 0]


@pytest.mark.parametrize(("other", "touches"), [("foot", 0), ("car", 1)])
def test_harm__people_on_foot_may_brush_against_each_other(other: str, touches: int, merge: Any) -> None:
    walker = rows("walker", along(40.0, -4.8, 0.0, 10.0, 6), kind="foot")
    assert harm(merge, EGO, walker, rows("z", along(44.0, -4.8, 0.0, 0.0, 6), kind=other)) == [None, touches, touches]


def test_follower__its_strongest_braking_while_the_ego_drives(merge: Any) -> None:
    # 0.3 m/s and then 0.5 m/s in steps of 0.1 s: 5 m/s2; the ego is at its goal before the 0.9 m/s
    speeds = [13.0, 13.0, 12.7, 12.2, 12.2, 12.3, 11.4]
    follower = rows(FOLLOWER, [(20.0 + k, -1.6, 0.0, speed) for k, speed in enumerate(speeds)])
    ego = rows("ego", along(60.0, -1.6, 0.0, 10.0, 6), end="goal")
    trace = pd.DataFrame([*ego, *follower])
    assert measured(game(merge.world, trace))["follower_max_deceleration_mps2"] == pytest.approx(5.0)
    assert measured(game(merge.world, pd.DataFrame(ego)))["follower_max_deceleration_mps2"] is None


def touched(x_m: Any, judged: BoolArray, partners: BoolArray) -> BoolArray:
    """Of bodies of 2 m by 1 m in a row, at x [T, B]."""
    place = np.array(x_m, dtype=float)
    boxes = Box(place, *(np.full(place.shape, value) for value in (0.0, 0.0, 2.0, 1.0)))
    found: BoolArray = comes_to_touch(
        boxes, np.ones(place.shape, bool), judged, partners, np.zeros(len(judged), dtype=bool)
    )
    return found


@seed(1)
@given(
    st.lists(st.lists(st.integers(-8, 8), min_size=3, max_size=3), min_size=1, max_size=6),
    st.lists(st.booleans(), min_size=3, max_size=3),
)
def test_comes_to_touch__is_mutual_and_among_those_asked(places: list[list[int]], asked: list[bool]) -> None:
    every, chosen = np.ones(3, dtype=bool), np.array(asked)
    both = touched(places, every, every)
    assert both.sum() != 1  # it takes two
    assert (touched(places, chosen, every) == (both & chosen)).all()
    apart_then_near = [
        {a, b}
        for a in range(3)
        for b in range(a)
        if any(abs(now[a] - now[b]) <= 2 < abs(before[a] - before[b]) for before, now in pairwise(places))
    ]
    assert {int(body) for body in np.flatnonzero(both)} == set().union(*apart_then_near)
