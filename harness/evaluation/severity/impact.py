"""The contact with a road user that ends a player's game."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from harness.evaluation.recorded_game import RecordedGame
from harness.evaluation.severity import contact
from harness.evaluation.severity import limits as at
from harness.game.outcome import Outcome

Side: TypeAlias = Literal["front", "left", "rear", "right"]


@dataclass(frozen=True, kw_only=True)
class Hit:
    """One of the two bodies of a contact."""

    vehicle_class: str
    """Of SUMO; empty: an obstacle."""
    side: Side
    """The side of its box that is hit."""
    delta_v_mps: float
    """Change of its velocity, if both move on as one."""


@dataclass(frozen=True, kw_only=True)
class Impact:
    """A contact of two bodies at the end of a game."""

    closing_mps: float
    own: Hit
    other: Hit

    @property
    def delta_v_mps(self) -> float:
        return max(self.own.delta_v_mps, self.other.delta_v_mps)


def impact_of(game: RecordedGame, player: int) -> Impact | None:
    """The contact with a road user that ends a player's game, with the body that is nearest then; None without one."""
    last = game.last_step(player)
    if game.outcomes[player] is not Outcome.COLLISION or last is None or (other := game.nearest(last, player)) is None:
        return None
    closing_mps = float(np.hypot(*(game.velocity_mps(last, other) - game.velocity_mps(last, player))))

    def hit(body: int, by: int) -> Hit:
        relative = game.velocity_mps(last, by) - game.velocity_mps(last, body)
        angle_rad = contact.impact_angle_rad(game.box(last, body), game.box(last, by), *relative.tolist())
        return Hit(
            vehicle_class=_class_of(game, body),
            side=side_of(angle_rad),
            delta_v_mps=closing_mps / (1.0 + _mass_kg(game, body) / _mass_kg(game, by)),
        )

    return Impact(closing_mps=closing_mps, own=hit(player, other), other=hit(other, player))


def _class_of(game: RecordedGame, body: int) -> str:
    return "" if game.names[body] in game.obstacles else game.body_kinds[body].vehicle_class


def _mass_kg(game: RecordedGame, body: int) -> float:
    return math.inf if game.names[body] in game.obstacles else at.mass_kg(game.body_kinds[body].vehicle_class)


def side_of(angle_rad: float) -> Side:
    """The side of a box that is hit from a direction in its frame: 0 from ahead, counter-clockwise."""
    if abs(angle_rad) <= 0.25 * math.pi:
        return "front"
    if abs(angle_rad) >= 0.75 * math.pi:
        return "rear"
    return "left" if angle_rad > 0.0 else "right"
