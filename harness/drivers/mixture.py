"""A mixed strategy: several drivers for one player; each game has one of them, drawn when the game is reset.

A population of people is a mixture, and so is the mixture of all opponents of earlier rounds. A driver that plays every
game is a mixture of one. A player that is in no game has None instead of a mixture.
"""

from __future__ import annotations

from dataclasses import dataclass

from harness.config.persona import Persona
from harness.drivers.protocol import Driver
from harness.game.human_factors import HumanFactors


@dataclass(frozen=True, kw_only=True)
class Member:
    """One member of a mixture: a driver, its persona, and its share of the games (shares are relative)."""

    driver: Driver
    persona: Persona
    share: float = 1.0


@dataclass(frozen=True)
class Mixture:
    """A player's drivers. SUMO drives all of them or none: a player's control mode is the same in all games."""

    members: tuple[Member, ...]

    def __post_init__(self) -> None:
        """Raises ValueError without members or with a share that is not positive, or if SUMO drives only some."""
        if not self.members or not all(each.share > 0.0 for each in self.members):
            raise ValueError("a mixture needs members, each with a share above 0")
        if len({each.driver.takes_over for each in self.members}) > 1:
            raise ValueError("SUMO can't drive a player in some games and not in others")

    @property
    def takes_over(self) -> bool:
        """False: SUMO drives the player."""
        return self.members[0].driver.takes_over


def mixture_of(driver: Driver, persona: Persona) -> Mixture:
    """A driver that plays every game, with its persona."""
    return Mixture((Member(driver=driver, persona=persona),))


def factors_of(player: Mixture | None) -> list[HumanFactors]:
    """The human factors of a player's drivers; none where no one drives, or SUMO."""
    if player is None or not player.takes_over:
        return [HumanFactors()]
    return [each.persona.human_factors for each in player.members]


def shares_of(player: Mixture | None) -> list[float]:
    """The shares of a player's drivers, one for each of `factors_of`."""
    return [1.0] if player is None else [each.share for each in player.members]
