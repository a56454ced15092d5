"""Conversion between headings (radians, 0 east, counter-clockwise) and SUMO's angles (degrees, 0 north, clockwise)."""

from __future__ import annotations

import numpy as np

from harness.game.arrays import FloatArray


def compass_deg_of(heading_rad: FloatArray | float) -> FloatArray:
    """SUMO's angle (degrees, 0 to 360) of a heading (rad)."""
    return (90.0 - np.degrees(heading_rad)) % 360.0


def heading_rad_of(compass_deg: FloatArray | float) -> FloatArray:
    """The heading (rad, within ±pi) of SUMO's angle (degrees)."""
    return (np.radians(90.0 - compass_deg) + np.pi) % (2.0 * np.pi) - np.pi
