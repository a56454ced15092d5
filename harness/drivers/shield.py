"""A shield: a safety layer around any driver, which keeps its decision unless a rule forbids it.

The rule is that of the reference driver of responsibility-sensitive safety (`egos/rss.toml`, `emergency_braking.rss`):
where neither the longitudinal nor the lateral distance to a road user ahead is safe, the car has to brake
(Shalev-Shwartz et al. 2017, definitions 1, 6 and 8), unless the road user waits for it. The shield then brakes as that
driver does, but at once: the reaction time and the jerk of that driver are those of a person, and the safe distances
have a margin for them. A decision that brakes as hard is kept. The wheel is always the driver's own: the rule says
nothing about steering, and steering may be what avoids the contact.
"""

from __future__ import annotations

import numpy as np

from harness.config.rule_driver import Rss
from harness.drivers.car import car_of
from harness.drivers.protocol import Driver
from harness.drivers.reference_drivers import reference_driver
from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.bicycle import GRAVITY_MPS2
from harness.game.roles import EGO
from harness.game.world import World


class ShieldedDriver:
    """Drives as another driver, and brakes where responsibility-sensitive safety demands more braking."""

    takes_over = True

    def __init__(self, driver: Driver, world: World) -> None:
        """The driver is that of the ego in this world."""
        self._world, self._car = world, car_of(world, EGO)
        self.wrapped = driver
        """The driver behind the shield."""
        self._rule = reference_driver("rss", world)
        self._braking_mps2 = Rss().full_braking_g * GRAVITY_MPS2
        self.intervenes: BoolArray = np.zeros(0, dtype=bool)
        """By game: whether its last decision was changed."""

    def around(self, driver: Driver) -> ShieldedDriver:
        """The same shield around another driver."""
        return ShieldedDriver(driver, self._world)

    def reset(self, games: IntArray) -> None:
        """Reset games [N] of the driver; nothing has been changed in them."""
        missing = int(games.max(initial=-1)) + 1 - len(self.intervenes)
        self.intervenes = np.pad(self.intervenes, (0, max(missing, 0)))
        self.intervenes[games] = False
        self.wrapped.reset(games)

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        """The driver's actions [N, 2]; in danger, the pedals of full braking if the driver brakes less."""
        decided = self.wrapped.decide(games, observation, noise)
        braking = self._car.actions(np.full(len(games), -self._braking_mps2), np.zeros(len(games)), observation)[:, 0]
        changed = self._rule.sees_danger(observation) & (decided[:, 0] > braking)
        self.intervenes[games] = changed
        if not changed.any():
            return decided
        actions = np.array(decided, dtype=np.float64)
        actions[changed, 0] = braking[changed]
        return actions
