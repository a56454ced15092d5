"""A pairing of drivers on a scene, to be assessed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import pyarrow as pa

from harness.drivers.mixture import Mixture
from harness.drivers.shield import ShieldedDriver
from harness.evaluation.trace_file import schema_of
from harness.game.roles import EGO
from harness.road.scene.open_scene import OpenScene


@dataclass(frozen=True, kw_only=True)
class SeatedArm:
    """A pairing to assess. Each player has one of the drivers of its mixture per game; None: it does not take part.

    Several people without an ego drive one at a time: in episode k, person k modulo their number (`present_in`).
    """

    name: str
    scene: OpenScene
    drivers: tuple[Mixture | None, ...]
    """[P], ego first."""
    seed: int
    """The seed of the starts, `Campaign.start_seed`: not that of the trainings of the drivers."""

    @property
    def trace_schema(self) -> pa.Schema:
        """The columns of the traces of its games."""
        return schema_of(shielded=any(self.shields), perceiving=self.perceives)

    @property
    def perceives(self) -> bool:
        """Whether the ego drives with perception errors."""
        ego = self.drivers[EGO]
        return self.scene.perception_errors is not None and ego is not None and ego.takes_over

    @property
    def shields(self) -> list[ShieldedDriver | None]:
        """[P] the shield of each player, which then has one driver; None without one."""
        drivers = [None if player is None else player.members[0].driver for player in self.drivers]
        return [each if isinstance(each, ShieldedDriver) else None for each in drivers]

    def present_in(self, episode: int) -> list[bool]:
        """[P] which players take part in an episode."""
        present = [driver is not None for driver in self.drivers]
        if present[EGO] or sum(present) < 2:
            return present
        people = [player for player, there in enumerate(present) if there]
        return [player == people[episode % len(people)] for player in range(len(present))]


def joined(arms: Sequence[SeatedArm]) -> tuple[SeatedArm, list[list[int]]]:
    """Arms of one scene and one seed as one arm, in which each player has the drivers of all of them; and for each arm
    and player the place of its first driver [arms, P]. What is the same mixture in all arms stays one.

    Raises ValueError where a player takes part in some arms only, where SUMO drives it in some only, and for a shield
    in one of several arms.
    """
    if len(arms) > 1 and any(any(each.shields) for each in arms):
        raise ValueError("a player with a shield has one driver")
    drivers, firsts = list[Mixture | None](), list[list[int]]()
    for of_player in zip(*(each.drivers for each in arms), strict=True):
        mixture, first = _joined_mixture(of_player)
        drivers.append(mixture)
        firsts.append(first)
    return replace(arms[0], drivers=tuple(drivers)), [list(each) for each in zip(*firsts, strict=True)]


def _joined_mixture(of_arms: Sequence[Mixture | None]) -> tuple[Mixture | None, list[int]]:
    if all(each is of_arms[0] for each in of_arms):
        return of_arms[0], [0] * len(of_arms)
    taking_part = [each for each in of_arms if each is not None]
    if len(taking_part) < len(of_arms):
        raise ValueError("a player takes part in all arms or in none")
    sizes = [len(each.members) for each in taking_part]
    return Mixture(tuple(member for each in taking_part for member in each.members)), [
        sum(sizes[:place]) for place in range(len(sizes))
    ]
