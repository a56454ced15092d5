"""The drawing of a net, and of a scene on it, for its page."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from harness.game.arrays import FloatArray
from harness.game.initial_state import draw_initial_state
from harness.reports.net_page import Drawing, DrawnShape
from harness.road.net.net_listing import ListedJunction, ListedLane
from harness.road.scene.open_scene import OpenScene

_STARTS = 60  # drawn for each player


def drawing_of(
    title: str,
    lanes: Sequence[ListedLane],
    junctions: Sequence[ListedJunction],
    conflicts: Iterable[tuple[int, FloatArray, str]],
    scene: OpenScene | None = None,
) -> Drawing:
    """The drawing of lanes, junctions, and conflicts with their number, place [2] (m) and text; for a scene also its
    routes and goals, and seeded starts."""
    shapes = [
        DrawnShape(points=each.outline, kind="junction", text=f"junction {each.name} ({each.kind})")
        for each in junctions
        if len(each.outline) > 2
    ]
    for lane in lanes:
        text = f"{lane.name}: {lane.length_m:.1f} m, {lane.limit_mps:.2f} m/s, {lane.permissions}; "
        text += f"from {lane.start_junction} to {lane.end_junction}"
        kind = "lane" if lane.for_cars else "lane other"
        shapes.append(DrawnShape(points=lane.outline, kind=kind, text=text, label=lane.name))
    signals = [
        DrawnShape(points=point[None], kind="signal", text=f"signal of junction {junction.name}")
        for junction in junctions
        for point in junction.signals
    ]
    numbers = [
        DrawnShape(points=place[None], kind="conflict", text=f"conflict {number}: {text}", label=str(number))
        for number, place, text in conflicts
    ]
    summary = (
        f"{len(lanes)} lanes, {len(junctions)} junctions, {len(signals)} lanes with a signal, {len(numbers)} conflicts."
    )
    marks = [*signals, *numbers]
    if scene is not None:
        shapes += _routes_and_goals(scene)
        marks += _starts(scene)
    return Drawing(title=title, summary=summary, shapes=shapes, marks=marks)


def _kind(player: int) -> str:
    return "ego" if player == 0 else "person"


def _routes_and_goals(scene: OpenScene) -> Iterator[DrawnShape]:
    routes = scene.world.road.routes
    points = np.stack((routes.x_m, routes.y_m), axis=1)
    starts = routes.rows(np.zeros((1, len(routes.goal_m))))[0]
    for player, goal in enumerate(routes.rows(np.array([routes.goal_m]))[0]):
        name, edges = scene.world.roles[player], " ".join(scene.edges[player])
        on_foot = scene.document.players[player].on_foot
        text = f"way of {name}, on foot" if on_foot else f"route of {name}: {edges}"
        yield DrawnShape(points=points[starts[player] : goal + 1], kind=f"route {_kind(player)}", text=text)
        across = 3.0 * np.array([-routes.sin[goal], routes.cos[goal]])
        ends = np.stack((points[goal] - across, points[goal] + across))
        yield DrawnShape(points=ends, kind=f"goal {_kind(player)}", text=f"goal of {name}")


def _starts(scene: OpenScene) -> Iterator[DrawnShape]:
    for k in range(_STARTS):
        state = draw_initial_state(scene.usual_starts, "drawing", k)
        for player in range(len(scene.places)):
            point = np.array([[state.x_m[player], state.y_m[player]]])
            text = f"start of {scene.world.roles[player]}, {state.speed_mps[player]:.1f} m/s"
            yield DrawnShape(points=point, kind=f"start {_kind(player)}", text=text)
