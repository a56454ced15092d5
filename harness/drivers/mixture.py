"""A mixed strategy: several drivers for one player, of whom a game has one, drawn when it starts.

A population of people is one, and so is the mixture of all whom a player has met before. A driver alone is a mixture
of one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from harness.config.persona import Persona
from harness.drivers.protocol import Driver
from harness.game.attention import HumanFactors


@dataclass(frozen=True)
class Member:
    """One of a mixture: who drives, as which person, in what share of the games (shares are relative)."""

    driver: Driver
    persona: Persona
    share: float = 1.0


@dataclass(frozen=True)
class Mixture:
    """A player's drivers. Either SUMO drives all of them or none: who places a car is settled for all games alike."""

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

    @property
    def human_factors(self) -> list[HumanFactors]:
        """The members' human factors."""
        return [each.persona.human_factors for each in self.members]

    @property
    def shares(self) -> list[float]:
        """The members' shares."""
        return [each.share for each in self.members]


Player: TypeAlias = Driver | Mixture | None
"""Who has a player's seat: a driver, one of several in each game, or nobody."""


def mixture_of(player: Driver | Mixture, persona: Persona) -> Mixture:
    """A driver as a mixture of one, who drives as `persona`; a mixture as it is."""
    return player if isinstance(player, Mixture) else Mixture((Member(player, persona),))
