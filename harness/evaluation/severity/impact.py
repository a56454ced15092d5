"""The contact with a road user that ends a player's game."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from harness.evaluation.recorded_game import RecordedGame
from harness.evaluation.severity import contact
from harness.evaluation.severity import limits as at
from harness.game.outcome import Outcome


@dataclass(frozen=True, kw_only=True)
class Impact:
    """A contact of two bodies at the end of a game; None of everything without one."""

    closing_mps: float | None = None
    own_delta_v_mps: float | None = None
    """Change of the player's velocity, if both move on as one."""
    other_delta_v_mps: float | None = None
    side: str | None = None


def impact_of(game: RecordedGame, player: int) -> Impact:
    """The contact that ends a player's game, with the body that is nearest then."""
    last = game.last_step(player)
    if game.outcomes[player] is not Outcome.COLLISION or last is None or (other := game.nearest(last, player)) is None:
        return Impact()
    relative = game.velocity_mps(last, other) - game.velocity_mps(last, player)
    closing_mps = float(np.hypot(*relative))
    own_kg, other_kg = (at.mass_kg(game.body_kinds[body].vehicle_class) for body in (player, other))
    if game.names[other] in game.obstacles:
        other_kg = math.inf
    angle_rad = contact.impact_angle_rad(game.box(last, player), game.box(last, other), *relative.tolist())
    return Impact(
        closing_mps=closing_mps,
        own_delta_v_mps=closing_mps / (1.0 + own_kg / other_kg),
        other_delta_v_mps=closing_mps / (1.0 + other_kg / own_kg),
        side=side_of(angle_rad),
    )


def side_of(angle_rad: float) -> str:
    """The side of a box that is hit from a direction in its frame: 0 from ahead, counter-clockwise."""
    if abs(angle_rad) <= 0.25 * math.pi:
        return "front"
    if abs(angle_rad) >= 0.75 * math.pi:
        return "rear"
    return "left" if angle_rad > 0.0 else "right"
