"""A manoeuvre as its rule finds it."""

from __future__ import annotations

from dataclasses import dataclass

from harness.evaluation.manoeuvres.course import Course

SLACK = 1e-9  # of rounding: a number equal to its threshold counts


@dataclass(frozen=True, kw_only=True)
class Span:
    """One manoeuvre: its first and last step, gap and time to collision (inf: none), and a description."""

    first: int
    last: int
    gap_m: float
    ttc_s: float
    text: str


def span_of(course: Course, player: int, first: int, last: int, text: str) -> Span:
    """A span with the player's least trailing distance and time to collision during it."""
    gap = course.quantities.leader_gap_m[first : last + 1, player].min()
    ttc = course.quantities.time_to_collision_s[first : last + 1, player].min()
    return Span(first=first, last=last, gap_m=float(gap), ttc_s=float(ttc), text=text)
