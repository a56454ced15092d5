"""Drivers in games that are played side by side: each decides the same, to the last bit, as in a game alone.

The sum of a matrix product depends on the number of its rows in the last bits. A policy therefore decides each game by
a product of its own, and a network of others one game after the other. Rules are the same numbers in any number of
games. Drivers of others (programs, FMUs, packages) are asked about one game, as their authors tried them out: they play
no games side by side. SUMO's driver decides the same only in games that do not share its random numbers with others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from harness.drivers.mixture import Mixture
from harness.drivers.network_driver import NetworkDriver
from harness.drivers.ordinary_walker import OrdinaryWalker
from harness.drivers.policy_file import LearnedDriver
from harness.drivers.protocol import Driver
from harness.drivers.reference_drivers import StrongestBraking
from harness.drivers.rules_driver import RulesDriver
from harness.drivers.shield import ShieldedDriver
from harness.game.arrays import BoolArray, FloatArray, IntArray


def side_by_side(
    players: Sequence[Mixture | None], walks: BoolArray, *, with_sumo: bool
) -> tuple[Mixture | None, ...] | None:
    """[P] the players' drivers for games side by side; None if one of them can't play such games, as SUMO's driver
    unless `with_sumo`. `walks` [P] are on foot: there an ordinary walker drives for SUMO."""
    found = list[Mixture | None]()
    for player, on_foot in zip(players, walks.tolist(), strict=True):
        members = player.members if player is not None else ()
        drivers = [_apart(each.driver, for_sumo=on_foot or with_sumo) for each in members]
        if None in drivers:
            return None
        changed = (replace(each, driver=driver) for each, driver in zip(members, drivers, strict=True) if driver)
        found.append(Mixture(tuple(changed)) if members else None)
    return tuple(found)


def _apart(driver: Driver, *, for_sumo: bool) -> Driver | None:
    """A driver for games side by side; None if it can't play such games. `for_sumo`: SUMO's driver can."""
    match driver:
        case ShieldedDriver():
            wrapped = _apart(driver.wrapped, for_sumo=for_sumo)
            return driver.around(wrapped) if wrapped is not None else None
        case LearnedDriver():
            return _Apart(driver)
        case NetworkDriver():  # it keeps no state
            return _OneByOne(driver)
        case RulesDriver() | StrongestBraking() | OrdinaryWalker():
            return driver
        case _:
            return driver if for_sumo and not driver.takes_over else None


class _Apart:
    """Lets a policy decide each game by a matrix product of its own."""

    takes_over = True

    def __init__(self, driver: LearnedDriver) -> None:
        self._driver = driver

    def reset(self, games: IntArray) -> None:
        """Do nothing: each decision depends on the current observation only."""

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        """Actions [N, 2] from observations [N, SIZE] and noise [N, 2]."""
        return self._driver.decide_apart(observation, noise)


class _OneByOne:
    """Lets a driver decide one game after the other."""

    takes_over = True

    def __init__(self, driver: Driver) -> None:
        self._driver = driver

    def reset(self, games: IntArray) -> None:
        """Reset games [N]."""
        self._driver.reset(games)

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        """Actions [N, 2] from observations [N, SIZE] and noise [N, 2]."""
        rows = (slice(k, k + 1) for k in range(len(games)))
        return np.concatenate([self._driver.decide(games[row], observation[row], noise[row]) for row in rows])
