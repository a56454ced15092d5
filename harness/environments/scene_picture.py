"""Pictures of a running game, for `render`: the road, the vehicles and the goal around one player, seen from above."""

from __future__ import annotations

import os
import sys
from typing import Any

import numpy as np
from PIL import Image, ImageDraw

from harness.game.arrays import FloatArray
from harness.game.geometry import Box
from harness.game.state import Bodies
from harness.road.net.network import read_net
from harness.road.scene.drawing import goal_lines, lane_marks, surfaces
from harness.road.scene.open_obstacles import polygon_of
from harness.road.scene.open_scene import OpenScene

SIZE_PX = (640, 320)
WIDTH_M = 100.0  # of the road that is shown: a car of 4.6 m is 29 pixels long
_FINER = 2  # drawn larger and scaled down: edges are smooth
_GROUND, _ROAD, _MARK = "#e8ece4", "#9a9da3", "#ffffff"
_GOAL, _OUTLINE = "#2ca02c", "#303030"
_BACKGROUND, _OBSTACLE = "#dcdcdc", "#6e6e78"
_PLAYERS = ("#1f77ff", "#ff7f0e", "#d62728", "#9467bd", "#8c564b")  # as in films: the ego is blue


class ScenePicture:
    """Draws games of a scene."""

    def __init__(self, scene: OpenScene) -> None:
        net = read_net(scene.net_file)
        self._scene, self._surfaces = scene, surfaces(net)
        self._lines = (  # with colour and width in metres
            (lane_marks(net), _MARK, 0.15),
            (scene.rail_lines, _OUTLINE, 0.25),
            (goal_lines(scene, net), _GOAL, 1.0),
        )

    def draw(self, bodies: Bodies, game: int, player: int) -> Any:
        """The surroundings of a player, uint8 [height, width, 3], in network directions: north is up."""
        centre = np.array([bodies.x_m[game, player], bodies.y_m[game, player]])
        size = (_FINER * SIZE_PX[0], _FINER * SIZE_PX[1])
        image = Image.new("RGB", size, _GROUND)
        draw, scale = ImageDraw.Draw(image), size[0] / WIDTH_M

        def pixels(points_m: FloatArray) -> list[tuple[float, float]]:
            place = (points_m[:, :2] - centre) * (scale, -scale) + 0.5 * np.array(size)
            return [(x, y) for x, y in place.tolist()]

        for rings in self._surfaces:
            for ring, colour in zip(rings, (_ROAD, *[_GROUND] * (len(rings) - 1)), strict=True):
                draw.polygon(pixels(ring), fill=colour)
        for lines, colour, width_m in self._lines:
            for line in lines:
                draw.line(pixels(line), fill=colour, width=round(width_m * scale))
        for body in reversed(range(bodies.x_m.shape[1])):  # the players last: above everything
            if bodies.present[game, body]:
                outline = polygon_of(Box(*(float(each[game, body]) for each in bodies.boxes))).exterior
                corners = pixels(np.array(outline.coords))
                draw.polygon(corners, fill=self._colour(bodies, body), outline=_OUTLINE)
        return np.asarray(image.resize(SIZE_PX, Image.Resampling.BOX))

    def _colour(self, bodies: Bodies, body: int) -> str:
        players, obstacles = len(self._scene.world.roles), len(self._scene.obstacles.each)
        if body < players:
            return _PLAYERS[body]
        return _OBSTACLE if body >= bodies.x_m.shape[1] - obstacles else _BACKGROUND


def can_open_window() -> bool:
    """Whether there is a screen, and a backend of matplotlib that opens windows on it."""
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        return False  # known without the import
    import matplotlib.pyplot as plt
    from matplotlib.backends.registry import backend_registry

    backend = plt.get_backend()
    try:
        plt.switch_backend(backend)  # loads it: one that MPLBACKEND names may not be installed
    except ImportError:
        return False
    return backend_registry.resolve_backend(backend)[1] is not None


class Window:
    """A window that shows pictures, by matplotlib's interactive backends."""

    def __init__(self, title: str) -> None:
        import matplotlib.pyplot as plt

        self._plt: Any = plt
        self._figure, axes = plt.subplots(figsize=(SIZE_PX[0] / 100, SIZE_PX[1] / 100), dpi=100, num=title)
        self._figure.subplots_adjust(0, 0, 1, 1)
        axes.set_axis_off()
        self._shown = axes.imshow(np.zeros((SIZE_PX[1], SIZE_PX[0], 3), dtype=np.uint8))

    def show(self, picture: Any, pause_s: float) -> None:
        """Show a picture for at least `pause_s`."""
        self._shown.set_data(picture)
        self._figure.canvas.draw_idle()
        self._plt.pause(max(pause_s, 1e-3))

    def close(self) -> None:
        self._plt.close(self._figure)
