"""A recorded game as plain data, for the player of the page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.floating[Any]]


@dataclass(frozen=True, kw_only=True)
class Track:
    """The track of one road user: arrays [n], a value per step from `first_step` on, of the body's centre."""

    name: str
    """`ego`, `non_ego`, `non_ego_2` and so on, or SUMO's id of a background vehicle."""
    length_m: float
    width_m: float
    first_step: int
    x_m: FloatArray
    y_m: FloatArray
    heading_rad: FloatArray
    speed_mps: FloatArray


@dataclass(frozen=True, kw_only=True)
class PlayerTrack(Track):
    """The track of a player and its measurements; gap and time are inf or NaN without leader or collision course."""

    acceleration_mps2: FloatArray
    steering_rad: FloatArray
    lapsed: NDArray[np.bool_]
    leader_gap_m: FloatArray
    time_to_collision_s: FloatArray
    outcome: str
    """goal, collision, rail, timeout; empty if it was still driving at the end of the game."""
    ended_step: int | None
    """The step of the outcome."""


@dataclass(frozen=True, kw_only=True)
class GameTracks:
    """One game, step 0 to step `steps`."""

    arm: str
    persona: str
    seed: int
    episode: int
    step_s: float
    steps: int
    outcome: str
    """Of the judged player: the ego, or the non-ego where it drives alone."""
    players: Sequence[PlayerTrack]
    background: Sequence[Track]
    touches: Sequence[tuple[float, float, float]]
    """Time (s) and place (x, y in m) of each contact."""


def key(arm: str, seed: int, episode: int) -> str:
    """The name of a game in addresses."""
    return f"{quote(arm, safe='')},{seed},{episode}"
