"""Bounds of the risk of a serious injury, by hand from the published points, and their properties."""

from __future__ import annotations

from itertools import pairwise
from typing import get_args

import pytest
from hypothesis import given, seed
from hypothesis import strategies as st

from harness.evaluation.severity.impact import Hit, Side
from harness.evaluation.severity.injury import risk_of

classes = st.sampled_from(["passenger", "pedestrian", "bicycle", "motorcycle", "truck", "scooter", ""])
hits = st.builds(Hit, vehicle_class=classes, side=st.sampled_from(get_args(Side)), delta_v_mps=st.just(1.0))


def hit(vehicle_class: str, side: Side = "front") -> Hit:
    return Hit(vehicle_class=vehicle_class, side=side, delta_v_mps=5.0)


CAR, WALKER = hit("passenger"), hit("pedestrian", "left")
AT_MOST, AT_LEAST, UNKNOWN = (0.0, 0.1), (0.1, 1.0), (0.0, 1.0)


@pytest.mark.parametrize(
    ("own", "other", "closing_kmh", "bounds"),
    [
        (CAR, WALKER, 28.9, AT_MOST),
        (CAR, WALKER, 31.0, UNKNOWN),  # GIDAS says more than 10 %, TARGET less
        (CAR, WALKER, 34.1, AT_LEAST),
        (WALKER, CAR, 34.1, AT_LEAST),
        (CAR, hit("bicycle", "rear"), 43.0, AT_MOST),
        (CAR, hit("motorcycle"), 49.5, AT_LEAST),
        (CAR, CAR, 98.0, AT_MOST),
        (CAR, hit("passenger", "right"), 74.0, AT_LEAST),  # the near side of the other car
        (CAR, hit("passenger", "rear"), 98.0, AT_MOST),
        (CAR, hit("passenger", "rear"), 120.0, AT_LEAST),  # those in front of 112 km/h
        (hit("passenger", "left"), WALKER, 60.0, None),
        (CAR, hit("truck"), 60.0, None),
        (CAR, hit(""), 60.0, None),
        (WALKER, hit("bicycle"), 60.0, None),
    ],
)
def test_risk__has_the_bounds_of_the_points(
    own: Hit, other: Hit, closing_kmh: float, bounds: tuple[float, float] | None
) -> None:
    assert risk_of(own, other, closing_kmh / 3.6) == bounds


@seed(1)
@given(own=hits, other=hits, speeds=st.lists(st.floats(0.0, 80.0), min_size=2, max_size=6))
def test_risk__grows_with_the_closing_speed_and_is_that_of_both(own: Hit, other: Hit, speeds: list[float]) -> None:
    found = [risk_of(own, other, speed_mps) for speed_mps in sorted(speeds)]
    assert found == [risk_of(other, own, speed_mps) for speed_mps in sorted(speeds)]
    assert len({risk is None for risk in found}) == 1  # whether there is a point does not depend on the speed
    known = [risk for risk in found if risk is not None]
    assert all(0.0 <= risk.low <= risk.high <= 1.0 for risk in known)
    assert all(slow.low <= fast.low and slow.high <= fast.high for slow, fast in pairwise(known))
