"""The tables of a net's lanes and conflicts."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table
from rich.text import Text

from harness.errors import plain
from harness.maps.candidates import Candidate, CandidateKind, LaneWay, Priority
from harness.maps.game_plans import GamePlan
from harness.road.net.net_listing import ListedLane


def lane_table(lanes: Sequence[ListedLane]) -> Table:
    """A row for each lane."""
    table = _table("lane", "length m", "limit m/s", "width m", "for", "from", "to", "leads to")
    for lane in lanes:
        numbers = (f"{lane.length_m:.1f}", f"{lane.limit_mps:.2f}", f"{lane.width_m:.1f}")
        ends = (lane.start_junction, lane.end_junction, "\n".join(lane.leads_to))
        table.add_row(lane.name, *numbers, lane.permissions, *ends)
    return table


def conflict_table(conflicts: Sequence[Candidate]) -> Table:
    """A row for each conflict of two lanes, numbered from 1."""
    table = _table("conflict", "junction", "kind", "first", "second", "priority")
    for number, each in enumerate(conflicts, start=1):
        kind = "merging" if each.kind is CandidateKind.MERGE else "crossing"
        table.add_row(str(number), each.junction, kind, _way(each.first), _way(each.second), _priority(each))
    return table


def plan_table(rows: Sequence[tuple[GamePlan, str]]) -> Table:
    """A row for each game that can be made on a map, with its place."""
    table = _table("conflict", "kind", "place", "ego", "person", "priority")
    for plan, place in rows:
        candidate = plan.candidate
        person = "on foot" if candidate.second is None else " to ".join(candidate.second.edges)
        ego = " to ".join(dict.fromkeys(candidate.first.edges))
        cells = (str(plan.number), candidate.kind.value, place, ego, person, plan_priority(plan))
        table.add_row(*(Text(plain(cell)) for cell in cells))
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


def _way(way: LaneWay | None) -> str:
    return "" if way is None else f"{way.start.getID()} to {way.end.getID()}"


def _priority(conflict: Candidate, first: str = "the first") -> str:
    rules = {Priority.FIRST: first, Priority.FIRST_TO_ARRIVE: "first to arrive", Priority.NONE: "no rule"}
    return f"signals, then {rules[conflict.priority]}" if conflict.with_signals else rules[conflict.priority]


def _table(*columns: str) -> Table:
    table = Table(box=None, pad_edge=False, header_style="bold")
    for name in columns:
        number = name.endswith((" m", " m/s"))
        table.add_column(name, justify="right" if number else "left", overflow="fold")
    return table
