"""The picture of docs/egos-in-cartesian.md: a road, and a view, as planners get them.

    python docs/egos/cartesian.py docs/egos/cartesian.png

plays four seconds of a game on the roundabout, in which SUMO drives the other player, and draws the last view.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import harness
from harness.drivers.sumo import SumoDriver
from harness.environments.arena import Arena, Seat
from harness.game.arrays import FloatArray, IntArray
from harness.game.cartesian_view import CartesianView
from harness.game.initial_state import draw_initial_state

STEPS, MARGIN_M = 40, 20.0


class Watcher:
    """Follows its route without touching the pedals, and keeps its last view."""

    takes_over, history_s = True, 0.0
    view: CartesianView

    def reset(self, games: IntArray) -> None:
        """Do nothing: there is no state."""

    def see(self, games: IntArray, views: Sequence[CartesianView]) -> None:
        """Keep the view."""
        self.view = views[0]

    def decide(self, games: IntArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        """Roll along the route."""
        return np.zeros((len(games), 2))


def view_of(scene_name: str) -> CartesianView:
    """The ego's view on a shipped scene after `STEPS` steps."""
    scene, watcher = harness.open_scene(scene_name), Watcher()
    people = [Seat(SumoDriver())] * (len(scene.world.roles) - 1)
    arena = Arena(scene, 1, [Seat(watcher), *people])
    try:
        arena.reset({0: draw_initial_state(scene.usual_starts, "picture")})
        for _ in range(STEPS):
            arena.step()
    finally:
        arena.close()
    return watcher.view


def draw(view: CartesianView, axes: Axes) -> None:
    """Draw a view and its road, from the own car to the goal and to all that it sees."""
    road = view.road
    for lane in road.lanes.values():
        axes.plot(*lane.line.T, color="0.75", linewidth=1.0)
    for name in road.route_lanes:
        axes.plot(*road.lanes[name].line.T, color="tab:cyan", linewidth=5.0, alpha=0.35)
    for rail in road.rails:
        axes.plot(*rail.T, color="black", linewidth=1.0)
    axes.plot(*road.route_line.T, color="tab:blue", linewidth=1.2)
    axes.plot(road.goal_x_m, road.goal_y_m, marker="*", color="tab:blue", markersize=14)
    _box(axes, (view.x_m, view.y_m, view.heading_rad), (4.6, 1.8), "tab:blue")
    for each in view.objects:
        _box(axes, (each.x_m, each.y_m, each.heading_rad), (each.length_m, each.width_m), "tab:orange")
        velocity = (each.velocity_x_mps, each.velocity_y_mps)
        axes.annotate(
            "", (each.x_m + velocity[0], each.y_m + velocity[1]), (each.x_m, each.y_m), arrowprops={"arrowstyle": "->"}
        )
        axes.text(each.x_m + 2.0, each.y_m + 2.0, f"{each.id}: {each.kind}", clip_on=True)
    shown = [(view.x_m, view.y_m), (road.goal_x_m, road.goal_y_m), *((each.x_m, each.y_m) for each in view.objects)]
    (left, bottom), (right, top) = np.min(shown, axis=0) - MARGIN_M, np.max(shown, axis=0) + MARGIN_M
    axes.set(xlim=(left, right), ylim=(bottom, top), aspect="equal")
    axes.set(xlabel="x_m, to the east", ylabel="y_m, to the north")


def _box(axes: Axes, pose: tuple[float, float, float], size_m: tuple[float, float], colour: str) -> None:
    x, y, heading = pose
    corners = 0.5 * np.array(size_m) * np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)])
    turn = np.array([(np.cos(heading), np.sin(heading)), (-np.sin(heading), np.cos(heading))])
    axes.fill(*(corners @ turn + (x, y)).T, color=colour)


def main() -> None:
    """Write the picture to the file that the command names."""
    matplotlib.use("Agg")
    figure = Figure(figsize=(8.0, 8.0), layout="constrained")
    draw(view_of("roundabout"), figure.add_subplot())
    figure.savefig(Path(sys.argv[1]), dpi=80)


if __name__ == "__main__":
    main()
