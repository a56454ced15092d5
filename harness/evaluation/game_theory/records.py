"""Who met whom: what the tables of games do not say by themselves, in the words of the findings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import pandas as pd

Role = Literal["ego", "non_ego"]


@dataclass(frozen=True)
class Pairing:
    """One arm as a cell of the cross-play: which ego strategy met which strategy of a non-ego."""

    arm: str
    seed: int
    ego: str
    non_ego: str
    persona: str
    """Of the non-ego; "" for none, as of SUMO's own driver: it has no payoff and plays no game."""


@dataclass(frozen=True)
class Response:
    """In `response_arm` the player of `role` of the pair in `pair_arm` is replaced by a best response: of several
    trainings against the other player, who stays as they are, the best by games played for this choice alone."""

    seed: int
    role: Role
    persona: str
    round: int
    pair_arm: str
    response_arm: str
    ego: str
    non_ego: str


@dataclass(frozen=True)
class GameFindings:
    """The four tables of findings, each with its columns of `columns`; empty where nothing was asked."""

    gaps: pd.DataFrame
    crossplay: pd.DataFrame
    equilibria: pd.DataFrame
    generalisation: pd.DataFrame
