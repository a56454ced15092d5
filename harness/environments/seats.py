"""The seats of an arena: who decides a player's actions, and what it wants."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

from harness.config.campaign import SUMO
from harness.config.persona import Persona
from harness.config.toml_reading import nearest, read_document
from harness.drivers.car import car_of
from harness.drivers.external import find_driver
from harness.drivers.mixture import Mixture
from harness.drivers.ordinary_walker import OrdinaryWalker
from harness.drivers.protocol import Driver
from harness.drivers.sumo import SumoDriver
from harness.errors import UsageError
from harness.game.human_factors import HumanFactors
from harness.game.initial_state import StartDistribution
from harness.game.payoff import Payoff
from harness.game.roles import ROLES
from harness.game.world import World
from harness.road.scene.open_scene import OpenScene, open_scene
from harness.shipped_documents import named_document


@dataclass(frozen=True)
class Seat:
    """A player's seat in the arena: its driver and its payoff (None: the payoff is not computed).

    >>> import harness
    >>> speedy = harness.read_document("personas/speedy.toml", harness.Persona)
    >>> learner, other = harness.Seat(None, speedy.payoff), harness.Seat(harness.SumoDriver())
    """

    driver: Driver | None
    """None: a learner; its actions are an argument of `Arena.step`."""
    payoff: Payoff | None = None


def seats_of(player: Mixture | None, *, paid: bool) -> tuple[Seat, ...]:
    """The seats of a player's drivers, with the payoffs of their personas if `paid`; a free one where no one drives."""
    if player is None:
        return (Seat(None),)
    return tuple(Seat(each.driver, each.persona.payoff if paid else None) for each in player.members)


def with_walkers(seats: Sequence[Sequence[Seat]], world: World) -> tuple[tuple[Seat, ...], ...]:
    """The seats [P][n]; in the place of a pedestrian an ordinary walker replaces SUMO, which moves vehicles only."""

    def seated(seat: Seat, player: int) -> Seat:
        moved_by_sumo = seat.driver is not None and not seat.driver.takes_over
        on_foot = world.walks[player] and moved_by_sumo
        return replace(seat, driver=OrdinaryWalker(world, player)) if on_foot else seat

    return tuple(tuple(seated(seat, player) for seat in of_player) for player, of_player in enumerate(seats))


def taken_over(seats: Sequence[Sequence[Seat]]) -> tuple[bool, ...]:
    """[P] whether the harness drives a player with these seats [P][n]. SUMO drives all seats of a player or none."""
    drivers = (of_player[0].driver for of_player in seats)
    return tuple(driver is None or driver.takes_over for driver in drivers)


SCENE, PERSONA = "merge", "careful"

Place: TypeAlias = str | Path
"""A path, relative to the working folder, or the name of a shipped document."""


@dataclass(frozen=True, kw_only=True)
class Seating:
    """The players of an environment."""

    scene: OpenScene
    learner: int
    seats: tuple[Seat, ...]
    """[P]"""
    start_distribution: StartDistribution


def seating_of(
    scene: Place | OpenScene = SCENE,
    player: str = "ego",
    *,
    persona: Place = PERSONA,
    other: Place | None = None,
    other_persona: Place | None = None,
    allow_code: bool = False,
) -> Seating:
    """The players, by the arguments of `DrivingEnv`. Raises UsageError for arguments that are wrong and files that
    can't be read."""
    external = None
    if other not in (None, SUMO):
        external = find_driver(str(other), Path("DrivingEnv"), "other", allow_code)
    type_of_ego = external.vehicle_type if external is not None else None
    if type_of_ego is not None and player == ROLES[0]:
        message = f"{other} names a vehicle type of the ego, and the others are not the ego"
        raise UsageError.of("DrivingEnv", "other", message, 'other = "sumo" drives them by their own types')
    opened = opened_scene(scene, type_of_ego)
    roles = opened.world.roles
    if player not in roles:
        raise UsageError.of("environment", "player", f"there is no player {player!r}", nearest(player, roles))
    if external is None and other_persona is not None:
        raise UsageError.of("environment", "other_persona", "only a policy has a persona", "leave it out")
    learner, own, of_others = roles.index(player), read_persona(persona), read_persona(other_persona or PERSONA)
    seats, present = [Seat(SumoDriver())] * len(roles), [float(other is not None)] * len(roles)
    factors = [of_others.human_factors if other_persona else HumanFactors()] * len(roles)
    for place in range(len(roles)):
        if external is not None and place != learner:
            sampled = of_others.decisions == "sampled"
            seats[place] = Seat(external.make(car_of(opened.world, place), sampled))
    seats[learner], factors[learner], present[learner] = Seat(None, own.payoff), own.human_factors, 1.0
    starts = opened.start_distribution(factors, present)
    return Seating(scene=opened, learner=learner, seats=tuple(seats), start_distribution=starts)


def opened_scene(written: Place | OpenScene, type_of_ego: str | None = None) -> OpenScene:
    """A scene by its path, its name, or as it is; the ego may have another vehicle type. Raises UsageError with every
    mistake in it."""
    return written if isinstance(written, OpenScene) else open_scene(written, type_of_ego)


def read_persona(written: Place) -> Persona:
    """A persona by its path or name. Raises UsageError with every mistake in it."""
    file = named_document(written, "personas") if isinstance(written, str) else written
    return read_document(file, Persona)
