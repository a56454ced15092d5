"""The layout of observations: scales, compression and its inverse."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.game.observation import observe
from harness.game.observation_layout import COMPRESSED, LAYOUT, SCALE, SCALES, SIZE, in_units
from harness.game.quantities import Quantities
from harness.traffic.scene import OpenScene
from tests.support.observations import observation_of

Moment = Callable[..., Quantities]
LOCK_RAD = 0.6


def test_compressed__by_hand() -> None:
    # x / (|x| + 20): 5 m is 0.2, 20 m is a half, 80 m is 0.8
    view = observation_of({"other0_ahead_m": -5.0, "other1_ahead_m": 20.0, "other2_ahead_m": 80.0})
    entries = dict(zip(LAYOUT, view[0].tolist(), strict=True))
    assert [entries[f"other{k}_ahead_m"] for k in range(3)] == pytest.approx([-0.2, 0.5, 0.8])


@given(
    name=st.sampled_from([name for name, scale in SCALES.items() if scale.compressed]),
    scales=st.floats(-100.0, 100.0),
)
def test_in_units__is_the_inverse_of_a_compressed_entry(name: str, scales: float) -> None:
    value = scales * SCALES[name].scale
    view = observation_of({name: value}).astype(np.float32)
    restored = in_units(view, LOCK_RAD)[0, LAYOUT.index(name)]
    assert restored == pytest.approx(value, rel=1e-4, abs=1e-5)


@given(
    name=st.sampled_from([name for name, scale in SCALES.items() if not scale.compressed]),
    share=st.floats(-1.0, 1.0),
)
def test_in_units__is_the_inverse_of_a_divided_entry(name: str, share: float) -> None:
    value = share * SCALES[name].scale
    restored = in_units(observation_of({name: value}), LOCK_RAD)[0, LAYOUT.index(name)]
    unit = LOCK_RAD if name in ("steering_rad", "road_steering_rad") else 1.0  # shares of the lock
    assert restored == pytest.approx(value * unit, abs=1e-9)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_in_units__of_the_bounds_is_finite_and_keeps_the_sign(sign: float) -> None:
    values = in_units(np.full((1, SIZE), sign, dtype=np.float32), LOCK_RAD)[0]
    assert np.isfinite(values).all()
    assert (np.sign(values) == sign).all()
    assert (np.abs(values[COMPRESSED]) > 1e5 * SCALE[COMPRESSED]).all()
    in_lock = ["steering_rad" in name for name in LAYOUT]
    expected = np.where(in_lock, LOCK_RAD, SCALE)
    assert np.abs(values[~COMPRESSED]) == pytest.approx(expected[~COMPRESSED])


CROSSING = [
    (9.0, 5.0),
    (20.0, 7.0),
    (40.0, 10.0),
    (60.0, 12.0),
    (80.0, 14.0),
]  # distance to the side, m, and speed, m/s


def test_crossing_cars__from_9_m_to_80_m_and_from_5_to_14_mps_look_different(moment: Moment, merge: OpenScene) -> None:
    views = []
    for distance_m, speed_mps in CROSSING:
        other = {"x_m": 70.0, "y_m": -1.6 - distance_m, "heading_rad": np.pi / 2.0, "speed_mps": speed_mps}
        ego = {"x_m": 50.0, "y_m": -1.6}
        q = moment(merge.world, [ego, {"x_m": 10.0, "y_m": -4.8, "present": False}], [other])
        views.append(dict(zip(LAYOUT, observe(q)[0, 0].tolist(), strict=True)))
    for near, far in pairwise(views):
        assert near["other0_seen"] == far["other0_seen"] == 1.0
        assert near["other0_left_m"] - far["other0_left_m"] > 0.02  # they come from the right
        assert far["other0_left_mps"] - near["other0_left_mps"] > 0.02
    for view, (distance_m, speed_mps) in zip(views, CROSSING, strict=True):
        values = dict(zip(LAYOUT, in_units(np.array(list(view.values())), LOCK_RAD).tolist(), strict=True))
        assert values["other0_left_m"] == pytest.approx(-distance_m, rel=1e-4)
        assert values["other0_left_mps"] == pytest.approx(speed_mps, rel=1e-4)
        assert values["other0_ahead_m"] == pytest.approx(20.0, rel=1e-4)
        assert values["other0_turned_sin"] == pytest.approx(1.0)
