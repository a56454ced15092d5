"""The drawing of a net, and of a scene on it, for its page."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from harness.cli.net_tables import conflict_words
from harness.game.arrays import FloatArray
from harness.game.human_factors import HumanFactors
from harness.game.initial_state import draw_initial_state
from harness.maps.net_conflicts import ListedConflict
from harness.reports.net_page import Drawing, DrawnShape
from harness.road.net.net_listing import ListedJunction, ListedLane
from harness.road.scene.open_scene import OpenScene


def drawing_of(
    title: str,
    lanes: Sequence[ListedLane],
    junctions: Sequence[ListedJunction],
    conflicts: Sequence[ListedConflict],
    scene: OpenScene | None,
    *,
    starts: int,
) -> Drawing:
    """The drawing of these lanes, junctions and conflicts; for a scene also its routes and goals, and seeded starts."""
    shapes = [*_junction_shapes(junctions), *(_lane_shape(lane) for lane in lanes)]
    marks = [
        DrawnShape(points=point[None], kind="signal", text=f"signal of junction {junction.name}")
        for junction in junctions
        for point in junction.signals
    ]
    marks += [
        DrawnShape(
            points=each.place[None],
            kind="conflict",
            text=conflict_words(each),
            label=str(each.number),
        )
        for each in conflicts
    ]
    if scene is not None:
        shapes += _routes_and_goals(scene)
        marks += _starts(scene, starts)
    signals = sum(len(junction.signals) for junction in junctions)
    summary = (
        f"{len(lanes)} lanes, {len(junctions)} junctions, {signals} lanes with a signal, {len(conflicts)} conflicts."
    )
    return Drawing(title=title, summary=summary, shapes=shapes, marks=marks)


def map_drawing(
    title: str,
    lanes: Sequence[ListedLane],
    junctions: Sequence[ListedJunction],
    places: Sequence[tuple[int, FloatArray, str]],
) -> Drawing:
    """The drawing of a map's lanes and junctions, with numbers [2] (m) and texts at places."""
    marks = [
        DrawnShape(points=place[None], kind="conflict", text=text, label=str(number)) for number, place, text in places
    ]
    summary = f"{len(lanes)} lanes, {len(junctions)} junctions, {len(places)} conflicts."
    shapes = [*_junction_shapes(junctions), *(_lane_shape(lane) for lane in lanes)]
    return Drawing(title=title, summary=summary, shapes=shapes, marks=marks)


def _junction_shapes(junctions: Sequence[ListedJunction]) -> Iterator[DrawnShape]:
    for junction in junctions:
        if len(junction.outline) > 2:
            text = f"junction {junction.name} ({junction.kind})"
            yield DrawnShape(points=junction.outline, kind="junction", text=text)


def _lane_shape(lane: ListedLane) -> DrawnShape:
    text = f"{lane.name}: {lane.length_m:.1f} m, {lane.limit_mps:.2f} m/s, {lane.permissions}; "
    text += f"from {lane.start_junction} to {lane.end_junction}"
    kind = "lane" if lane.for_cars else "lane other"
    return DrawnShape(points=lane.outline, kind=kind, text=text, label=lane.name)


def _kind(player: int) -> str:
    return "ego" if player == 0 else "person"


def _route_text(scene: OpenScene, player: int) -> str:
    name = scene.world.roles[player]
    if scene.document.players[player].on_foot:
        return f"way of {name}, on foot"
    return f"route of {name}: {' '.join(scene.edges[player])}"


def _routes_and_goals(scene: OpenScene) -> Iterator[DrawnShape]:
    routes = scene.world.road.routes
    for player in range(len(scene.edges)):
        rows = slice(int(routes.first_row[player]), int(routes.last_row[player]) + 1)
        line = np.stack((routes.x_m[rows], routes.y_m[rows]), axis=1)
        goal = int(routes.rows(np.array([routes.goal_m]))[0, player])
        place = np.array([routes.x_m[goal], routes.y_m[goal]])
        across = 3.0 * np.array([-routes.sin[goal], routes.cos[goal]])
        name = scene.world.roles[player]
        begin = int(routes.rows(np.zeros((1, len(routes.goal_m))))[0, player]) - rows.start
        way = line[begin : goal - rows.start + 1]
        yield DrawnShape(points=way, kind=f"route {_kind(player)}", text=_route_text(scene, player))
        ends = np.stack((place - across, place + across))
        yield DrawnShape(points=ends, kind=f"goal {_kind(player)}", text=f"goal of {name}")


def _starts(scene: OpenScene, number: int) -> Iterator[DrawnShape]:
    players = len(scene.places)
    distribution = scene.start_distribution([HumanFactors()] * players, [1.0] * players)
    for k in range(number):
        state = draw_initial_state(distribution, "drawing", k)
        for player in range(players):
            point = np.array([[state.x_m[player], state.y_m[player]]])
            text = f"start of {scene.world.roles[player]}, {state.speed_mps[player]:.1f} m/s"
            yield DrawnShape(points=point, kind=f"start {_kind(player)}", text=text)
