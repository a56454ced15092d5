"""The seats of an arena: who decides a player's actions, and what it wants."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from harness.drivers.mixture import Mixture
from harness.drivers.ordinary_walker import OrdinaryWalker
from harness.drivers.protocol import Driver
from harness.game.payoff import Payoff
from harness.game.world import World


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
