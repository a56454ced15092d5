"""An ordinary person on foot, in the places where the people of other scenes are driven by SUMO.

It walks along its way at a comfortable speed. At a kerb it waits until each vehicle arrives later than it has passed
the vehicle's lane, by the start-up and clearance time of the Highway Capacity Manual. On a marked crossing it also goes
before a vehicle that can still stop in comfort. On the carriageway it does not turn back.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from harness.config.road_user import WALKING_MPS
from harness.drivers.car import car_of
from harness.drivers.perception import Encounters, OwnMotion, perceive
from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.junctions import KERB_M
from harness.game.walking import TURNS_AS_AT_MPS
from harness.game.world import World

MARGIN_S = 3.0
"""Start-up and end clearance in the critical headway of pedestrians (Highway Capacity Manual 2010)."""
_REFUGE_M = 1.5  # room between two lanes in which people wait
_DRIVERS_REACT_S, _DRIVERS_BRAKE_MPS2 = 1.0, 3.0  # of a vehicle that can stop in comfort
_STOPPING_MPS2, _CHANGE_MPS2 = 1.0, 1.4
_LOOKS_AHEAD_M = 1.5  # it turns to a point of its way this far ahead
_TURNS_PER_S = 2.0  # share of the turn to that point


class OrdinaryWalker:
    """Walks in the place of one player, in any number of games at once."""

    takes_over = True

    def __init__(self, world: World, player: int) -> None:
        conflicts = world.right_of_way.conflicts
        own = np.flatnonzero(conflicts.player == player)
        self._car = car_of(world, player)
        self._goal_m = float(world.road.routes.goal_m[player])
        self._kerbs_m = _kerbs_m(conflicts.begin_m[own], conflicts.end_m[own], conflicts.stop_m[own])
        self._zone_m = float((conflicts.end_m - conflicts.begin_m)[own].max(initial=0.0))

    def reset(self, games: IntArray) -> None:
        """It keeps no state."""

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        """Actions [N, 2] from observations [N, SIZE]. Decisions are deterministic: `noise` is not used."""
        motion, others = perceive(self._car, observation)
        front_m = self._goal_m - motion.goal_m + 0.5 * self._car.length_m
        ahead_m = self._kerbs_m - front_m[:, None]
        room_m = np.where(ahead_m >= -KERB_M, np.maximum(ahead_m, 0.0), np.inf).min(axis=1, initial=np.inf)
        waits = self._must_wait(others) & np.isfinite(room_m)
        target_mps = np.where(waits, np.sqrt(2.0 * _STOPPING_MPS2 * np.where(waits, room_m, 0.0)), WALKING_MPS)
        target_mps = np.minimum(target_mps, WALKING_MPS)
        change_mps2 = np.clip((target_mps - motion.speed_mps) / self._car.step_s, -_CHANGE_MPS2, _CHANGE_MPS2)
        stands = (motion.speed_mps <= 0.0) & (target_mps < 0.1)
        change_mps2 = np.where(stands, 0.0, change_mps2)
        return self._car.actions(change_mps2, self._steering_rad(motion), observation)

    def _must_wait(self, others: Encounters) -> BoolArray:
        """[N] whether a vehicle arrives before the walker has passed its lane, were it to go now."""
        passes_s = (others.own_to_conflict_m + self._zone_m + self._car.length_m) / WALKING_MPS
        speed_mps = np.hypot(others.speed_mps, others.approach_mps)
        arrives_s = np.where(others.seen, others.other_to_conflict_s, np.inf)
        distance_m = np.where(np.isfinite(arrives_s), arrives_s, 0.0) * speed_mps
        stopping_m = _DRIVERS_REACT_S * speed_mps + speed_mps**2 / (2.0 * _DRIVERS_BRAKE_MPS2)
        gives_way = ~others.has_priority & (distance_m > stopping_m)
        comes = arrives_s < passes_s + MARGIN_S
        waits: BoolArray = np.any(comes & ~gives_way, axis=1)
        return waits

    def _steering_rad(self, motion: OwnMotion) -> FloatArray:
        """[N] the steering angle that leads back to the way."""
        turn_rad = motion.path_turned_rad[:, 0] + np.arctan2(motion.path_left_m, _LOOKS_AHEAD_M)
        curvature_per_m = _TURNS_PER_S * turn_rad / np.maximum(motion.speed_mps, TURNS_AS_AT_MPS)
        return np.arctan(curvature_per_m * float(self._car.actuators.wheelbase_m[0]))


def _kerbs_m(begin_m: FloatArray, end_m: FloatArray, stop_m: FloatArray) -> FloatArray:
    """[K] the stations at which a walker waits: before its first zone, and in refuges."""
    if not len(begin_m):
        return np.zeros(0)
    zones = sorted(zip(begin_m.tolist(), end_m.tolist(), stop_m.tolist(), strict=True))
    kerbs = [zones[0][2]]
    for before, after in pairwise(zones):
        if after[0] - before[1] > _REFUGE_M:
            kerbs.append(after[2])
    return np.array(kerbs)
