"""How players go on across the road where a recording ends."""

from __future__ import annotations

from enum import Enum


class Continuation(Enum):
    """How players go on across the road after the ego's failure."""

    IN_ITS_PLACE = "in_its_place"
    """Each keeps its place in the lane."""
    MOVING_OVER = "moving_over"
    """Each that was coming nearer to the ego's line keeps its lateral speed until it is in that line."""
