"""Between the game's headings (radians, 0 east, counter-clockwise) and SUMO's compass angles (degrees, 0 north)."""

from __future__ import annotations

import numpy as np

from harness.game.arrays import FloatArray


def compass_deg_of(heading_rad: FloatArray | float) -> FloatArray:
    """SUMO's angle of a heading."""
    return (90.0 - np.degrees(heading_rad)) % 360.0


def heading_rad_of(compass_deg: FloatArray | float) -> FloatArray:
    """The heading, within ±pi, of SUMO's angle."""
    return (np.radians(90.0 - compass_deg) + np.pi) % (2.0 * np.pi) - np.pi
