"""A recorded game as plain data, for the player of the page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.floating[Any]]


@dataclass(frozen=True, kw_only=True)
class Track:
    """The track of one road user, of its body's centre; `outcome` and `ended_step` are those of a player."""

    name: str
    """`ego`, `non_ego`, `non_ego_2` and so on, or SUMO's id of a background vehicle."""
    size_m: tuple[float, float]
    """Length and width."""
    first_step: int
    columns: Mapping[str, FloatArray]
    """[n] values from `first_step` on, by names of `embedding.COLUMNS` and in their order: all of a player."""
    outcome: str = ""
    """goal, collision, rail, timeout; empty if it was still driving at the end of the game."""
    ended_step: int | None = None


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
    players: Sequence[Track]
    background: Sequence[Track]
    touches: Sequence[tuple[float, float, float]]
    """Time (s) and place (x, y in m) of each contact."""


def key(arm: str, seed: int, episode: int) -> str:
    """The name of a game in addresses."""
    return f"{quote(arm, safe='')},{seed},{episode}"
