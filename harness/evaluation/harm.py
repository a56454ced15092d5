"""What a game does to others than the ego: failures in contacts without the ego, and the braking of its follower.

A contact with the ego is a failure of the ego, and `ego_failed` counts it. What is counted here happens beside it: an
ego that saves itself may leave the contact to others.
"""

from __future__ import annotations

import numpy as np

from harness.evaluation.column import MAYBE
from harness.evaluation.metrics import Drive, metric
from harness.evaluation.recorded_game import RecordedGame
from harness.evaluation.severity.contact import comes_to_touch
from harness.game.follower import FOLLOWER
from harness.game.outcome import Outcome
from harness.game.roles import EGO, NON_EGO

_ON_FOOT = ("pedestrian", "wheelchair")
"""SUMO's vehicle classes of road users that pass each other closely without harm."""


@metric(
    "game",
    dtype=MAYBE,
    meaning="1 if a person touched the edge of the drivable area, or a road user or obstacle other than the ego; empty "
    "without a person.",
)
def person_failed(drive: Drive) -> int | None:
    game = drive.game
    people = [player for player in range(NON_EGO, len(game.world.roles)) if game.last_step(player) is not None]
    return int(any(_fails_without_ego(game, each) for each in people)) if people else None


@metric(
    "game",
    dtype=MAYBE,
    meaning="1 if a vehicle of the background traffic, such as the ego's follower, came to touch a road user or "
    "obstacle other than the ego. Two people on foot that touch do not count. Empty without background traffic.",
)
def bystander_failed(drive: Drive) -> int | None:
    game, players = drive.game, len(drive.game.world.roles)
    places = np.arange(len(game.names))
    bystanders = (places >= players) & (places < len(places) - len(game.obstacles))
    if not game.bodies.present[:, bystanders].any():
        return None
    on_foot = np.array([kind.vehicle_class in _ON_FOOT for kind in game.body_kinds])
    return int(comes_to_touch(game.bodies.boxes, game.bodies.present, bystanders, places != EGO, on_foot).any())


@metric(
    "game",
    dtype=MAYBE,
    meaning="1 if person_failed or bystander_failed is 1; empty where both are.",
)
def harm_to_others(drive: Drive) -> int | None:
    marks = [mark for mark in (person_failed(drive), bystander_failed(drive)) if mark is not None]
    return int(any(marks)) if marks else None


@metric(
    "game",
    meaning="Strongest braking of the vehicle that follows the ego while the ego drives, by the change of its speed in "
    "a step; empty in games without one.",
)
def follower_max_deceleration_mps2(drive: Drive) -> float | None:
    game = drive.game
    if FOLLOWER not in game.names:
        return None
    follower = game.names.index(FOLLOWER)
    there, speed_mps = game.bodies.present[:, follower], game.bodies.speed_mps[:, follower]
    steps = game.drove[1:, EGO] & there[1:] & there[:-1]
    braking_mps2 = -np.diff(speed_mps)[steps] / drive.step_s
    return max(0.0, float(braking_mps2.max())) if steps.any() else None


def _fails_without_ego(game: RecordedGame, player: int) -> bool:
    match game.outcomes[player]:
        case Outcome.RAIL:
            return True
        case Outcome.COLLISION:
            last = game.last_step(player)
            return last is not None and game.nearest(last, player) != EGO
        case _:
            return False
