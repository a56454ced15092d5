"""The players of each arm, which the tables of games do not contain."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from harness.evaluation.research_questions import AloneBound

Role = Literal["ego", "non_ego"]


@dataclass(frozen=True, kw_only=True)
class Pairing:
    """One arm as a cell of the cross-play: an ego strategy and a non-ego strategy."""

    arm: str
    seed: int
    ego: str
    non_ego: str
    persona: str
    """Of the non-ego; "" for SUMO's own driver, which has no payoff and is in no empirical game."""
    alone: tuple[AloneBound, ...] = ()
    """What its players have to achieve alone; otherwise there is no verdict on them."""


@dataclass(frozen=True, kw_only=True)
class Response:
    """In `response_arm` the player of `role` of the pair in `pair_arm` is replaced by a best response: the best of
    several trainings against the unchanged other player, chosen by separate games."""

    seed: int
    role: Role
    persona: str
    round: int
    pair_arm: str
    response_arm: str
    ego: str
    non_ego: str
    alone: tuple[AloneBound, ...] = ()
    """What the players of the pair have to achieve alone; otherwise there is no verdict on them."""
