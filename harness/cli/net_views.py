"""What is shown of a net: tables of its lanes and conflicts, and the drawing on its page, with a scene on it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from rich.table import Table

from harness.game.arrays import FloatArray
from harness.game.initial_state import draw_initial_state
from harness.maps.candidates import Candidate, CandidateKind, LaneWay, Priority
from harness.maps.game_plans import GamePlan
from harness.reports.net_page import Drawing, DrawnShape
from harness.reports.text_table import add_text_row, text_table
from harness.road.net.net_listing import NetEdge, NetLane, junction_outline, lane_outline, permissions, signalled_ends
from harness.road.net.network import nodes_of
from harness.road.scene.open_scene import OpenScene

_STARTS = 60  # drawn for each player


def lane_table(lanes: Sequence[NetLane]) -> Table:
    """A row for each lane."""
    numbers = ("length m", "limit m/s", "width m")
    table = text_table(("lane", *numbers, "for", "from", "to", "leads to"), right=numbers, header_style="bold")
    for lane in lanes:
        size = (f"{lane.getLength():.1f}", f"{lane.getSpeed():.2f}", f"{lane.getWidth():.1f}")
        # SUMO's letter of the direction, and the edge: `l north_out` is to the left
        leads_to = [f"{link.getDirection()} {link.getTo().getID()}" for link in lane.getOutgoing()]
        add_text_row(table, lane.getID(), *size, permissions(lane), *_ends(lane), leads_to)
    return table


def conflict_table(conflicts: Sequence[Candidate]) -> Table:
    """A row for each conflict of two lanes, numbered from 1."""
    table = text_table(("conflict", "junction", "kind", "first", "second", "priority"), header_style="bold")
    for number, each in enumerate(conflicts, start=1):
        kind = "merging" if each.kind is CandidateKind.MERGE else "crossing"
        add_text_row(table, str(number), each.junction, kind, _way(each.first), _way(each.second), _priority(each))
    return table


def plan_table(rows: Sequence[tuple[GamePlan, str]]) -> Table:
    """A row for each game that can be made on a map, with its place."""
    headings = ("conflict", "score", "kind", "place", "ego", "person", "priority")
    table = text_table(headings, header_style="bold")
    for plan, place in rows:
        candidate = plan.candidate
        person = "on foot" if candidate.second is None else " to ".join(candidate.second.edges)
        ego = " to ".join(dict.fromkeys(candidate.first.edges))
        numbers = str(plan.number), f"{plan.score:.0f}"
        add_text_row(table, *numbers, candidate.kind.value, place, ego, person, plan_priority(plan))
    return table


def plan_priority(plan: GamePlan) -> str:
    """Which player has priority."""
    if plan.candidate.kind is CandidateKind.ZEBRA:
        return "the person"
    return _priority(plan.candidate, first="the ego")


def conflict_words(conflict: Candidate) -> str:
    """The ways and the priority of a conflict of two lanes."""
    verb = "merges with" if conflict.kind is CandidateKind.MERGE else "crosses"
    return f"{_way(conflict.first)} {verb} {_way(conflict.second)}; priority: {_priority(conflict)}"


def _ends(lane: NetLane) -> tuple[str, str]:
    """The junctions from which and to which a lane leads."""
    edge = lane.getEdge()
    return edge.getFromNode().getID(), edge.getToNode().getID()


def _way(way: LaneWay | None) -> str:
    return "" if way is None else f"{way.start.getID()} to {way.end.getID()}"


def _priority(conflict: Candidate, first: str = "the first") -> str:
    rules = {Priority.FIRST: first, Priority.FIRST_TO_ARRIVE: "first to arrive", Priority.NONE: "no rule"}
    return f"signals, then {rules[conflict.priority]}" if conflict.with_signals else rules[conflict.priority]


def drawing_of(
    title: str,
    edges: Sequence[NetEdge],
    conflicts: Iterable[tuple[int, FloatArray, str]],
    scene: OpenScene | None = None,
) -> Drawing:
    """The drawing of edges, their junctions, and conflicts with their number, place [2] (m) and text; for a scene also
    its routes and goals, and seeded starts."""
    lanes, junctions, listed = [lane for edge in edges for lane in edge.getLanes()], nodes_of(edges), set(edges)
    shapes = [
        DrawnShape(points=outline, kind="junction", text=f"junction {node.getID()} ({node.getType()})")
        for node in junctions
        if len(outline := junction_outline(node)) > 2
    ]
    for lane in lanes:
        name, (start, end) = lane.getID(), _ends(lane)
        text = f"{name}: {lane.getLength():.1f} m, {lane.getSpeed():.2f} m/s, {permissions(lane)}; "
        text += f"from {start} to {end}"
        kind = "lane" if lane.allows("passenger") else "lane other"
        shapes.append(DrawnShape(points=lane_outline(lane), kind=kind, text=text, label=name))
    signals = [
        DrawnShape(points=point[None], kind="signal", text=f"signal of junction {node.getID()}")
        for node in junctions
        for point in signalled_ends(node, listed)
    ]
    numbers = [
        DrawnShape(points=place[None], kind="conflict", text=f"conflict {number}: {text}", label=str(number))
        for number, place, text in conflicts
    ]
    summary = (
        f"{len(lanes)} lanes, {len(junctions)} junctions, {len(signals)} lanes with a signal, {len(numbers)} conflicts."
    )
    ways, starts = ([], []) if scene is None else (list(_routes_and_goals(scene)), list(_starts(scene)))
    return Drawing(
        title=title,
        summary=summary,
        shapes=[*shapes, *ways],
        marks=[*signals, *numbers, *starts],
        opens_on=[*ways, *starts],
    )


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
