"""The bodies of a game: its players, the background vehicles near them, and its obstacles."""

from __future__ import annotations

import numpy as np

from harness.game.arrays import FloatArray, IntArray
from harness.game.initial_state import InitialState
from harness.game.placed_obstacles import Obstacles
from harness.game.state import Bodies, State, nearest_to_players
from harness.game.world import World
from harness.sumo.simulation import Reading


class NearbyBodies:
    """The bodies of G games: the players, then background vehicles, then the obstacles of the scene."""

    def __init__(self, world: World, obstacles: Obstacles, games: int) -> None:
        self._length_m, self._width_m = (np.tile(each, (games, 1)) for each in (world.length_m, world.width_m))
        self._obstacles, self._roles = obstacles, list(world.roles)
        shape = (games, len(obstacles.each))
        self.poses: FloatArray = np.zeros((*shape, 3))
        """[G, O, 3] x_m, y_m and heading_rad of the obstacles."""
        sizes_m = (np.broadcast_to(each, shape) for each in (obstacles.length_m, obstacles.width_m))
        self._at_rest = (np.zeros(shape), *sizes_m, np.ones(shape, dtype=bool))

    def place(self, game: int, start: InitialState) -> None:
        """Put the obstacles of a game where it has them."""
        if self._obstacles.each:
            self.poses[game] = self._obstacles.poses(*start.parts)

    def of(self, state: State, reading: Reading | None, games: IntArray | slice = slice(None)) -> Bodies:
        """The players [N, P], up to `NEAREST` background vehicles nearest to them, and the obstacles [N, O].

        `state` is that of `games`; `reading` is that of all games.
        """
        pose = (state.x_m, state.y_m, state.heading_rad)
        sizes_m = (self._length_m[games], self._width_m[games])
        bodies = Bodies(*pose, state.speed_mps, *sizes_m, state.present.copy())
        if reading is not None and reading.present.size:
            bodies = bodies.with_nearest(_bodies_in(reading, games))
        if not self._obstacles.each:
            return bodies
        standing = (*np.moveaxis(self.poses[games], -1, 0), *(each[games] for each in self._at_rest))
        columns = zip(bodies, standing, strict=True)
        return Bodies(*(np.concatenate(pair, axis=1) for pair in columns))

    def names(self, bodies: Bodies, reading: Reading | None, games: IntArray) -> list[list[str]]:
        """[N][B] the names of bodies that `of` found in games [N] with this reading; empty where none is present."""
        last = [each.name for each in self._obstacles.each]
        between = bodies.present.shape[1] - len(self._roles) - len(last)
        if not between:
            return [[*self._roles, *last]] * len(games)
        assert reading is not None, "it has the bodies between players and obstacles"
        players = Bodies._make(each[:, : len(self._roles)] for each in bodies)
        nearest, present = nearest_to_players(_bodies_in(reading, games), players)
        others = np.where(present, np.take_along_axis(reading.names[games], nearest, 1), "")
        return [[*self._roles, *names, *last] for names in others.tolist()]


def _bodies_in(reading: Reading, games: IntArray | slice) -> Bodies:
    return Bodies(*(getattr(reading, name)[games] for name in Bodies._fields))
