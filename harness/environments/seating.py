"""Who plays in an environment for one learner: its scene, its place, its payoff, and the driver of the others."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from harness.config.campaign import SUMO
from harness.config.persona import Persona
from harness.config.toml_reading import nearest, read_document
from harness.drivers.car import car_of
from harness.drivers.external import ExternalDriver, find_driver
from harness.drivers.sumo import SumoDriver
from harness.environments.seats import Seat
from harness.errors import UsageError
from harness.game.human_factors import HumanFactors
from harness.game.initial_state import StartDistribution
from harness.game.roles import ROLES
from harness.game.world import World
from harness.road.scene.open_scene import OpenScene, open_scene
from harness.shipped_documents import Kind, named_document


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


SCENE, PERSONA = "merge", "careful"

Place: TypeAlias = str | Path
"""A path, relative to the working folder, or the name of a shipped document."""


@dataclass(frozen=True, kw_only=True)
class Seating:
    """The players of an environment. Sequences are [P]."""

    scene: OpenScene
    learner: int
    seats: tuple[Seat, ...]
    human_factors: tuple[HumanFactors, ...]
    present: tuple[float, ...]
    """The share of games in which each player takes part."""

    @property
    def start_distribution(self) -> StartDistribution:
        """The initial states of the games."""
        return self.scene.start_distribution(self.human_factors, self.present)


def seating_of(
    scene: Place | OpenScene,
    player: str,
    *,
    persona: Place,
    other: Place | None,
    other_persona: Place | None,
    allow_code: bool = False,
) -> Seating:
    """The players, by the arguments of `DrivingEnv`. Raises UsageError for arguments that are wrong and files that
    can't be read."""
    external = external_opponent(other, player, allow_code)
    opened = opened_scene(scene, None if external is None else external.vehicle_type)
    roles = opened.world.roles
    if player not in roles:
        raise UsageError.of("environment", "player", f"there is no player {player!r}", nearest(player, roles))
    if other in (None, "sumo") and other_persona is not None:
        raise UsageError.of("environment", "other_persona", "only a policy has a persona", "leave it out")
    learner = roles.index(player)
    own = read_persona(persona)
    opponent_persona = read_persona(other_persona or PERSONA)
    opponent_factors = opponent_persona.human_factors if other_persona else HumanFactors()
    seats = opponent_seats(external, opened.world, learner, opponent_persona.decisions == "sampled")
    factors, present = [opponent_factors] * len(roles), [float(other is not None)] * len(roles)
    seats[learner], factors[learner], present[learner] = Seat(None, own.payoff), own.human_factors, 1.0
    return Seating(
        scene=opened, learner=learner, seats=tuple(seats), human_factors=tuple(factors), present=tuple(present)
    )


def opened_scene(written: Place | OpenScene, type_of_ego: str | None = None) -> OpenScene:
    """A scene by its path, its name, or as it is; the ego may have another vehicle type. Raises UsageError with every
    mistake in it."""
    return written if isinstance(written, OpenScene) else open_scene(written, type_of_ego)


def read_persona(written: Place) -> Persona:
    """A persona by its path or name. Raises UsageError with every mistake in it."""
    return read_document(_find(written, "personas"), Persona)


def _find(written: Place, kind: Kind) -> Path:
    return named_document(written, kind) if isinstance(written, str) else written
