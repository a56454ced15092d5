"""The tables of a net's lanes and conflicts."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table

from harness.traffic.net_conflicts import ListedConflict, Priority
from harness.traffic.net_listing import ListedLane

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


def conflict_words(conflict: ListedConflict) -> str:
    """A conflict in one sentence."""
    verb = "merges with" if conflict.merging else "crosses"
    ways = f"{_way(conflict.first)} {verb} {_way(conflict.second)}"
    return f"conflict {conflict.number}: {ways}; priority: {_priority(conflict)}"


def _way(lanes: tuple[str, str]) -> str:
    return " to ".join(lanes)


def _priority(conflict: ListedConflict) -> str:
    rule = _RULES[conflict.priority]
    return f"signals, then {rule}" if conflict.with_signals else rule


def _table(*columns: str) -> Table:
    table = Table(box=None, pad_edge=False, header_style="bold")
    for name in columns:
        number = name.endswith((" m", " m/s"))
        table.add_column(name, justify="right" if number else "left", overflow="fold")
    return table
