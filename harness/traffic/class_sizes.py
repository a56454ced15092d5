"""Sizes and desired speeds of SUMO's vehicle classes."""

from __future__ import annotations

SIZES_M = {
    "pedestrian": (0.215, 0.478),
    "wheelchair": (1.2, 0.72),
    "scooter": (1.2, 0.5),
    "bicycle": (1.6, 0.65),
    "moped": (2.1, 0.78),
    "motorcycle": (2.2, 0.9),
    "truck": (7.1, 2.4),
    "trailer": (16.5, 2.55),
    "bus": (12.0, 2.5),
    "coach": (14.0, 2.6),
    "delivery": (6.5, 2.16),
    "emergency": (6.5, 2.16),
    "tram": (22.0, 2.4),
}
"""Length and width of a vType without them, by its class: the defaults of SUMO 1.28."""
CAR_SIZE_M = (5.0, 1.8)
"""Those of all other classes."""
DESIRED_SPEEDS_MPS = {"bicycle": 20.0 / 3.6, "pedestrian": 5.0 / 3.6}
"""The desiredMaxSpeed of a vType without one, by its class. Other classes have none."""
