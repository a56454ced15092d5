"""The tables of a net's lanes and conflicts."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table
from rich.text import Text

from harness.errors import plain
from harness.maps.candidates import CandidateKind, ListedConflict, Priority
from harness.maps.game_plans import GamePlan
from harness.road.net.net_listing import ListedLane

_RULES = {Priority.FIRST: "the first", Priority.FIRST_TO_ARRIVE: "first to arrive", Priority.NONE: "no rule"}


def lane_table(lanes: Sequence[ListedLane]) -> Table:
    """A row for each lane."""
    table = _table("lane", "length m", "limit m/s", "width m", "for", "from", "to", "leads to")
    for lane in lanes:
        numbers = (f"{lane.length_m:.1f}", f"{lane.limit_mps:.2f}", f"{lane.width_m:.1f}")
        ends = (lane.start_junction, lane.end_junction, "\n".join(lane.leads_to))
        table.add_row(lane.name, *numbers, lane.permissions, *ends)
    return table


def conflict_table(conflicts: Sequence[ListedConflict]) -> Table:
    """A row for each conflict."""
    table = _table("conflict", "junction", "kind", "first", "second", "priority")
    for each in conflicts:
        kind = "merging" if each.merging else "crossing"
        table.add_row(str(each.number), each.junction, kind, _way(each.first), _way(each.second), _priority(each))
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
    candidate = plan.candidate
    if candidate.kind is CandidateKind.ZEBRA:
        return "the person"
    first_is = {Priority.FIRST: "the ego"}
    return _with_signals(first_is.get(candidate.priority, _RULES[candidate.priority]), candidate.with_signals)


def conflict_words(conflict: ListedConflict) -> str:
    """The ways and the priority of a conflict."""
    verb = "merges with" if conflict.merging else "crosses"
    ways = f"{_way(conflict.first)} {verb} {_way(conflict.second)}"
    return f"{ways}; priority: {_priority(conflict)}"


def _way(lanes: tuple[str, str]) -> str:
    return " to ".join(lanes)


def _priority(conflict: ListedConflict) -> str:
    return _with_signals(_RULES[conflict.priority], conflict.with_signals)


def _with_signals(rule: str, signals: bool) -> str:
    return f"signals, then {rule}" if signals else rule


def _table(*columns: str) -> Table:
    table = Table(box=None, pad_edge=False, header_style="bold")
    for name in columns:
        number = name.endswith((" m", " m/s"))
        table.add_column(name, justify="right" if number else "left", overflow="fold")
    return table
