"""The layout of observations: scales, compression and its inverse."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.game.observation_layout import COMPRESSED, LAYOUT, SCALE, SCALES, SIZE, in_units
from tests.support.observations import observation_of

LOCK_RAD = 0.6


def test_compressed__by_hand() -> None:
    # x / (|x| + 20): 5 m is 0.2, 20 m is a half, 80 m is 0.8
    view = observation_of({"other0_ahead_m": -5.0, "other1_ahead_m": 20.0, "other2_ahead_m": 80.0})
    entries = dict(zip(LAYOUT, view[0].tolist(), strict=True))
    assert [entries[f"other{k}_ahead_m"] for k in range(3)] == pytest.approx([-0.2, 0.5, 0.8])


@given(name=st.sampled_from(list(SCALES)), share=st.floats(-1.0, 1.0))
def test_in_units__is_the_inverse_of_an_entry(name: str, share: float) -> None:
    value = share * SCALES[name].scale * (100.0 if SCALES[name].compressed else 1.0)
    restored = in_units(observation_of({name: value}).astype(np.float32), LOCK_RAD)[0, LAYOUT.index(name)]
    unit = LOCK_RAD if name in ("steering_rad", "road_steering_rad") else 1.0  # shares of the lock
    assert restored == pytest.approx(value * unit, rel=1e-4, abs=1e-5)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_in_units__of_the_bounds_is_finite_and_keeps_the_sign(sign: float) -> None:
    values = in_units(np.full((1, SIZE), sign, dtype=np.float32), LOCK_RAD)[0]
    assert np.isfinite(values).all()
    assert (np.sign(values) == sign).all()
    assert (np.abs(values[COMPRESSED]) > 1e5 * SCALE[COMPRESSED]).all()
    in_lock = ["steering_rad" in name for name in LAYOUT]
    expected = np.where(in_lock, LOCK_RAD, SCALE)
    assert np.abs(values[~COMPRESSED]) == pytest.approx(expected[~COMPRESSED])
