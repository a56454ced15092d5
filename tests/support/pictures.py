"""Pictures of SUMO-GUI: what they need, and the colours of the players in them."""

from __future__ import annotations

import os

import numpy as np
import pytest

from harness.replay.sumo_gui import find_xvfb


def require_gui() -> None:
    """Skips where SUMO-GUI can't run on a virtual screen; under HARNESS_REQUIRE_GUI=1, fails."""
    if find_xvfb() is None:
        reason = "needs Xvfb"
        if os.environ.get("HARNESS_REQUIRE_GUI") == "1":
            pytest.fail(reason)
        pytest.skip(reason)


def blue(picture: np.ndarray) -> np.ndarray:
    red, green, blue = np.moveaxis(picture, -1, 0)
    return (blue > 180) & (blue > red + 90) & (blue > green + 50)


def orange(picture: np.ndarray) -> np.ndarray:
    red, green, blue = np.moveaxis(picture, -1, 0)
    return (red > 200) & (green > 80) & (green < 215) & (blue < 110)
