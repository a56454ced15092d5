"""What planners see, in Cartesian coordinates: the views of the games that they play.

Nothing is computed for other drivers. A view has what the player's eyes see: the same bodies, at the same places and
with the same velocities, as its observation, and all of them.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from harness.drivers.protocol import Planner
from harness.environments.nearby_bodies import NearbyBodies
from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.cartesian_view import SIGNAL_STATES, CartesianView, SeenObject, SeenSignal
from harness.game.field_of_view import Seen
from harness.game.memory import Perceived
from harness.game.observation import seen_bodies
from harness.game.quantities import Quantities
from harness.game.state import Bodies, State
from harness.road.scene.cartesian_road import signal_lines
from harness.road.scene.open_scene import OpenScene
from harness.sumo.simulation import Reading, Simulation

_NO_SIGNALS = "off"
_ON_FOOT = "pedestrian"
_OBSTACLE = "obstacle"
_GHOST = "passenger"
"""The kind of an object that is not there, which perception errors of the ego make."""


class _Named(NamedTuple):
    """A body, as the harness knows it."""

    key: Hashable
    kind: str
    driven_by_sumo: str | None
    """Its name in the simulation; None: the harness moves it, it walks or it stands."""


@dataclass
class _Memory:
    """What a planner's player has seen in a game."""

    numbers: dict[Hashable, int]
    """Of the objects, in the order in which they came into sight."""
    before: dict[int, SeenObject]
    """The objects of the step before, by number."""
    past: deque[CartesianView]


class CartesianViews:
    """The views of all planners on the seats of an arena."""

    def __init__(
        self,
        scene: OpenScene,
        around: tuple[NearbyBodies, Simulation],
        taken_over: BoolArray,
    ) -> None:
        """`taken_over` [P] are the players that the harness drives."""
        (self._nearby, self._simulation), self._taken_over = around, taken_over
        self._scene, self._memories = scene, dict[tuple[int, int], _Memory]()

    def reset(self, games: IntArray) -> None:
        """Forget what was seen in these games."""
        for key in [each for each in self._memories if each[0] in games]:
            del self._memories[key]

    def show(
        self, planner: Planner, player: int, games: IntArray, there: tuple[Quantities, Seen, Reading | None]
    ) -> None:
        """Show a planner what its player sees in games [N], by their quantities, what the players take the bodies to
        be, and the reading of all games."""
        quantities, known, reading = there
        sights = _Sights(
            games=games,
            state=quantities.state,
            bodies=known.bodies,
            names=self._nearby.names(quantities.bodies, reading, games),
            reading=reading,
            perceived=known.motion,
            seen=seen_bodies(quantities, known),
            driven_by_sumo=quantities.state.running & ~self._taken_over,
        )
        views = [self._view(planner, player, row, game, sights) for row, game in enumerate(games.tolist())]
        planner.see(games, views)

    def _view(self, planner: Planner, player: int, row: int, game: int, sights: _Sights) -> CartesianView:
        world, state, road = self._scene.world, sights.state, self._scene.cartesian_roads[player]
        longest = round(planner.history_s / world.step_s)
        memory = self._memories.setdefault((game, player), _Memory({}, {}, deque(maxlen=longest)))
        links = world.right_of_way.stop_lines.link[signal_lines(world, player)]
        view = CartesianView(
            time_s=float(state.step[row] * world.step_s),
            x_m=float(state.x_m[row, player]),
            y_m=float(state.y_m[row, player]),
            heading_rad=_wrapped(state.heading_rad[row, player]),
            speed_mps=float(state.speed_mps[row, player]),
            acceleration_mps2=float(state.acceleration_mps2[row, player]),
            steering_rad=float(state.steering_rad[row, player]),
            station_m=float(state.station_m[row, player]),
            speed_limit_share=float(state.limit_share[row]),
            objects=tuple(self._objects(memory, (row, game, player), sights)),
            signals=tuple(
                SeenSignal(state=SIGNAL_STATES[state.signals[row, k]], since_s=float(state.signal_s[row, k]))
                for k in links.tolist()
            ),
            road=road,
        )
        memory.before = {each.id: each for each in view.objects}
        shown = replace(view, history=tuple(memory.past))
        memory.past.append(view)
        return shown

    def _objects(self, memory: _Memory, who: tuple[int, int, int], sights: _Sights) -> list[SeenObject]:
        row, game, player = who
        bodies = np.flatnonzero(sights.seen[row, player]).tolist()
        named = [self._named(row, body, sights) for body in bodies]
        by_sumo = [(game, each.driven_by_sumo) for each in named if each.driven_by_sumo is not None]
        lights = iter(self._simulation.turn_signals(by_sumo) if by_sumo else ())
        objects = []
        for body, each in zip(bodies, named, strict=True):
            number = memory.numbers.setdefault(each.key, len(memory.numbers))
            before, step_s = memory.before.get(number), self._scene.world.step_s
            x_m, y_m, heading_rad, vx, vy = sights.sighting(row, player, body)
            ax, ay = (
                ((vx - before.velocity_x_mps) / step_s, (vy - before.velocity_y_mps) / step_s) if before else (0.0, 0.0)
            )
            objects.append(
                SeenObject(
                    id=number,
                    kind=each.kind,
                    x_m=x_m,
                    y_m=y_m,
                    heading_rad=_wrapped(heading_rad),
                    length_m=float(sights.bodies.length_m[row, body]),
                    width_m=float(sights.bodies.width_m[row, body]),
                    velocity_x_mps=vx,
                    velocity_y_mps=vy,
                    acceleration_x_mps2=ax,
                    acceleration_y_mps2=ay,
                    turn_signal=_NO_SIGNALS if each.driven_by_sumo is None else next(lights),
                )
            )
        return objects

    def _named(self, row: int, body: int, sights: _Sights) -> _Named:
        """The body of an index: a player, a background vehicle, or an obstacle."""
        scene, types = self._scene, self._scene.routes.types
        if body < len(scene.world.roles):
            kind = _ON_FOOT if scene.world.walks[body] else types[scene.vehicle(body).vehicle_type].vehicle_class
            name = scene.world.roles[body] if sights.driven_by_sumo[row, body] else None
            return _Named(("player", body), kind, name)
        names, obstacles = sights.names[row], len(scene.obstacles.each)
        if body >= len(names):
            return _Named(("ghost", body), _GHOST, None)
        name = names[body]
        if body >= len(names) - obstacles:
            return _Named((_OBSTACLE, name), _OBSTACLE, None)
        assert sights.reading is not None
        game = int(sights.games[row])
        column = sights.reading.names[game].tolist().index(name)
        kind = types[sights.reading.types[game, column]].vehicle_class
        return _Named(("vehicle", name), kind, None if kind == _ON_FOOT else name)


@dataclass(frozen=True, kw_only=True)
class _Sights:
    """What there is to see in games [N], and who sees it. Rows are games [N]; `reading` has all games of the arena."""

    games: IntArray
    state: State
    bodies: Bodies
    names: Sequence[Sequence[str]]
    """[N][B] of the bodies of the game, as `NearbyBodies.names`: those after them are ghosts."""
    reading: Reading | None
    perceived: Perceived
    seen: BoolArray
    """[N, P, B]"""
    driven_by_sumo: BoolArray
    """[N, P] players that SUMO drives now."""

    def sighting(self, row: int, player: int, body: int) -> tuple[float, float, float, float, float]:
        """Place (x, y), heading and velocity (x, y) of a body as a player takes them to be: errors scale its distance,
        and add a velocity along the line of sight."""
        state = self.state
        x_m, y_m, heading_rad, speed_mps = self.perceived[:, row, player, body].tolist()
        own_x_m, own_y_m = float(state.x_m[row, player]), float(state.y_m[row, player])
        dx_m, dy_m = x_m - own_x_m, y_m - own_y_m
        further = 1.0 + float(state.distance_error[row, player])
        closing_per_s = float(state.closing_error_per_s[row, player])
        vx_mps = speed_mps * float(np.cos(heading_rad)) + closing_per_s * dx_m
        vy_mps = speed_mps * float(np.sin(heading_rad)) + closing_per_s * dy_m
        return own_x_m + further * dx_m, own_y_m + further * dy_m, heading_rad, vx_mps, vy_mps


def _wrapped(heading_rad: FloatArray | float) -> float:
    """A heading from -π to π."""
    return float((heading_rad + np.pi) % (2.0 * np.pi) - np.pi)
