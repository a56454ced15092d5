"""The drivers of the players that an environment's learner meets."""

from __future__ import annotations

from pathlib import Path

from harness.config.campaign import SUMO
from harness.drivers.car import car_of
from harness.drivers.external import ExternalDriver, find_driver
from harness.drivers.sumo import SumoDriver
from harness.environments.seats import Seat
from harness.errors import UsageError
from harness.game.roles import ROLES
from harness.game.world import World


def external_opponent(other: str | Path | None, player: str, allow_code: bool) -> ExternalDriver | None:
    """The external driver of an environment's argument `other`; None if nothing or SUMO drives the other players.

    Raises UsageError if it is not found, if it is code without permission, and if it is a vehicle type of the ego and
    `player` is the ego.
    """
    if other is None or other == SUMO:
        return None
    external = find_driver(str(other), Path("DrivingEnv"), "other", allow_code)
    if external.vehicle_type is not None and player == ROLES[0]:
        message = f"{external.written} names a vehicle type of the ego, and the others are not the ego"
        raise UsageError.of("DrivingEnv", "other", message, 'other = "sumo" drives them by their own types')
    return external


def opponent_seats(external: ExternalDriver | None, world: World, learner: int, sampled: bool) -> list[Seat]:
    """A seat for each player [P], each with a driver of its own: of the learner's place too, which has another seat.

    Raises UsageError or DriverError as `ExternalDriver.make` does.
    """
    if external is None:
        return [Seat(SumoDriver())] * len(world.roles)
    places = range(len(world.roles))
    return [
        Seat(SumoDriver() if place == learner else external.make(car_of(world, place), sampled)) for place in places
    ]
