"""The causes of many failures in words: a line for each kind of cause, the most frequent first."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from harness.evaluation.rule_book.causes import NO_REACTION

_WORDS = {
    "cut_in": "cut-in",
    "oncoming": "oncoming",
    "cross": "crosses the way",
    "ahead": "goes on ahead",
    "stands": "stands ahead",
    "from_behind": "hits from behind",
    "changes_lane": "the ego changes lane",
    "leaves_lane": "the ego leaves its lane",
    "leaves_road": "the ego leaves the road",
    "late": "the ego is late",
}
MOST_LINES = 3
"""Kinds of causes in a summary; the rest is counted."""


def event_words(event: str) -> str:
    """The name of a manoeuvre or of another event as text."""
    return _WORDS.get(event, event.replace("_", " "))


def causes_in_words(causes: pd.DataFrame) -> Mapping[tuple[str, int, int], str]:
    """Event and response of every failure, such as "drift in -> swerves", by arm, seed and episode."""
    rows = causes.itertuples()
    return {(row.arm, row.seed, row.episode): f"{event_words(row.event)} -> {row.reaction}" for row in rows}


def cause_lines(causes: pd.DataFrame, most: int = MOST_LINES) -> list[str]:
    """The causes in rows of `causes.csv`, alike ones as one line, the most frequent first; empty without rows.

    E.g. "24 of 30: cuts in from the left, 0.4 to 0.9 s before contact; the ego sees it, no reaction (braking up to 0.9
    m/s²)".
    """
    kinds = causes.groupby(["ego_outcome", "deed", "ego_broke"], sort=False)
    groups = sorted((rows for _, rows in kinds), key=lambda rows: -len(rows))
    lines = [f"{len(rows)} of {len(causes)}: {kind_in_words(rows)}" for rows in groups[:most]]
    rest = sum(len(rows) for rows in groups[most:])
    return [*lines, f"{rest} of {len(causes)}: other causes"] if rest else lines


def kind_in_words(rows: pd.DataFrame) -> str:
    """Rows with the same cause in words: what the other did, how long that left, and what the ego saw and did."""
    first: Any = rows.iloc[0]
    if not first["other"]:
        return str(first["deed"])
    end = "contact" if first["ego_outcome"] == "collision" else "the ego leaves the road"
    parts = [f"{first['deed']}, {_span(rows['time_left_s'].tolist())} s before {end}"]
    hidden = rows["hidden_until_s"].dropna().tolist()
    if hidden:
        among = f" (in {len(hidden)})" if len(hidden) < len(rows) else ""
        parts.append(f"hidden from the ego until {_span(hidden)} s before{among}")
    if first["ego_broke"]:
        parts.append(f"the ego {first['ego_broke']}")
    braking = f"braking up to {rows['braking_mps2'].max():.1f} m/s²"
    return "; ".join([*parts, f"{_seen(rows)}{_reactions(rows)} ({braking})"])


def _seen(rows: pd.DataFrame) -> str:
    seen = int((rows["ego_saw"] == "yes").sum())
    if seen == len(rows):
        return "the ego sees it"
    return f"the ego sees it in {seen}" if seen else "the ego does not see it"


def _reactions(rows: pd.DataFrame) -> str:
    """The ego's reactions: the most frequent first, each with its number if there are several."""
    counts = rows["reaction"].value_counts()
    if len(counts) > 1:
        return ": " + ", ".join(f"{reaction} in {count}" for reaction, count in counts.items())
    reaction = str(counts.index[0])
    return f", {reaction}" if reaction == NO_REACTION else f" and {reaction}"


def _span(seconds: Sequence[float]) -> str:
    low, high = (f"{value:.1f}" for value in (min(seconds), max(seconds)))
    return low if low == high else f"{low} to {high}"
