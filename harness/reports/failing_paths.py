"""The paths of the games that an ego fails, over one another on the road, with the places of contact; and of the worst
games by themselves, for paper."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from markupsafe import Markup

from harness.game.arrays import FloatArray
from harness.reports.embedding import key
from harness.reports.figures import ROAD, figure_of, svg

SPAN_S = 3.0
"""A path is drawn from this time before the end of the game on."""
MOST_PATHS = 60
"""Of an arm; of more failures the worst are drawn."""
MOST_ON_PAPER = 3
"""Games of which the printed page has a picture each."""
_MARGIN_M = 6.0
_WIDTH_IN, _LEAST_IN, _MOST_IN = 7.2, 1.3, 4.0


@dataclass(frozen=True, kw_only=True)
class FailingPath:
    """The last seconds of a game that the ego fails."""

    arm: str
    persona: str
    players: Mapping[str, FloatArray]
    """Centres [n, 2] (m), by role."""
    contact_m: tuple[float, float] | None
    """The last contact of the game; None: there is none."""
    seed: int = 0
    episode: int = 0


def paths_figures(
    paths: Sequence[FailingPath],
    scene: Mapping[str, Any],
    labels: Mapping[str, str],
    failures: Mapping[str, int],
    name: str,
) -> Iterator[tuple[str, Markup]]:
    """A picture for each arm of `labels` that has paths, with its title. `failures` is the number of failures of each
    arm, `scene` the road as `road.js` reads it, `name` the prefix of the pictures' ids."""
    for place, (arm, label) in enumerate(labels.items()):
        drawn = [path for path in paths if path.arm == arm]
        if drawn:
            count = failures[arm]
            some = f"{len(drawn)} of {count} failures"
            which = some if count > len(drawn) else f"all {count} failures" if count > 1 else "the only failure"
            title = f"The {label}: {which}"
            yield title, _figure(drawn, scene, f"{name}-{place}", f"{title}, seen from above on the road.")


def worst_figures(
    paths: Sequence[FailingPath], scene: Mapping[str, Any], causes: Mapping[str, str], several_seeds: bool
) -> Iterator[tuple[str, Markup]]:
    """A picture of each of the worst games, which are the first of `paths`, with its title. `causes` says by
    `embedding.key` why the ego failed."""
    for place, path in enumerate(paths[:MOST_ON_PAPER]):
        seed = f", seed {path.seed}" if several_seeds else ""
        cause = causes.get(key(path.arm, path.seed, path.episode), "")
        title = f"{path.arm}{seed}, game {path.episode}{f': {cause}' if cause else ''}"
        yield title, _figure([path], scene, f"worst-{place}", f"{title}; seen from above on the road.")


def _figure(paths: Sequence[FailingPath], scene: Mapping[str, Any], name: str, alternative: str) -> Markup:
    points = np.concatenate([line for path in paths for line in path.players.values()])
    low, high = points.min(axis=0) - _MARGIN_M, points.max(axis=0) + _MARGIN_M
    width_m, height_m = high - low
    height_in = float(np.clip(_WIDTH_IN * height_m / width_m, _LEAST_IN, _MOST_IN))
    from matplotlib.collections import LineCollection, PathCollection
    from matplotlib.path import Path

    window = shapely.box(*low, *high)
    with figure_of(_WIDTH_IN, height_in) as figure:
        figure.set_layout_engine("none")
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        axes.set_axis_off()
        road = [
            Path.make_compound_path(*(Path(np.asarray(ring.coords)) for ring in (each.exterior, *each.interiors)))
            for rings in scene["surfaces"]
            for each in _polygons(shapely.Polygon(rings[0], rings[1:]).buffer(0).intersection(window))
        ]
        axes.add_collection(PathCollection(road, facecolor=ROAD["asphalt"], linewidth=0))
        rails = [np.asarray(each.coords) for line in scene["rails"] for each in _lines(line, window)]
        axes.add_collection(LineCollection(rails, colors=ROAD["rail"], linewidths=1.2))
        for role in ("non_ego", "ego"):
            is_ego = role == "ego"
            lines = [line for path in paths for player, line in path.players.items() if (player == "ego") == is_ego]
            axes.add_collection(
                LineCollection(lines, colors=ROAD["ego" if is_ego else "non-ego"], linewidths=1.0, alpha=0.6)
            )
        contacts = np.array([path.contact_m for path in paths if path.contact_m is not None]).reshape(-1, 2)
        axes.plot(*contacts.T, "x", color=ROAD["contact"], markersize=5, markeredgewidth=1.3)
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1], high[1])
        axes.set_aspect("equal")
        return svg(figure, name, alternative)


def _polygons(shape: shapely.Geometry) -> list[shapely.Polygon]:
    return [each for each in shapely.get_parts(shape) if each.geom_type == "Polygon" and not each.is_empty]


def _lines(line: Sequence[Sequence[float]], window: shapely.Polygon) -> list[shapely.LineString]:
    inside = shapely.LineString(line).intersection(window) if len(line) > 1 else shapely.LineString()
    return [each for each in shapely.get_parts(inside) if each.geom_type == "LineString" and not each.is_empty]
