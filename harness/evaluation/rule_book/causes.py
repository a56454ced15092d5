"""The cause of one failure of the ego, chosen among what the rules find in the game; and the causes of many failures in
words.

The rules, in order:

1. The other is the road user that the ego touches. Where the ego leaves the road, it is the player with which it was on
   a collision course last, if that was within `SINCE_S` of the end (`Course.involved`); else the player that drifted
   near it in that time.
2. The event is the other's last entry into the ego's lane (`lane_entries`), if it began within `SINCE_S` of the end; or
   the ego's change into the other's lane. A body that was in the ego's lane before brakes, stands or goes on ahead,
   comes towards the ego, or hits it from behind: that begins with the last stretch at a time to collision of at most
   `DANGER_TTC_S`. So does a player that had touched the edge of the road before that stretch, and stands there.
3. A rule of the road that the other broke in that time is the event instead, and is named with it. One that the ego
   broke is named besides.
4. The ego saw it if in some step from then to the end it was not in a lapse of attention and nothing hid the other.
5. The ego reacted if it braked or swerved, from `BEFORE_S` before then on.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from harness.evaluation.rule_book import thresholds as at
from harness.evaluation.rule_book.course import Course
from harness.evaluation.rule_book.lane_entries import WALKS, entries, in_lane, moves_of, words_of
from harness.evaluation.rule_book.named_manoeuvres import RULES_OF_THE_ROAD, drifts, swerves
from harness.game.arrays import BoolArray
from harness.game.geometry import box_distance
from harness.game.outcome import Outcome
from harness.game.roles import EGO

NO_REACTION = "no reaction"
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
_SAY_IT_ALL = ("turns_across", "wrong_way")  # of the rules that are broken


class _Event(NamedTuple):
    """What led to the failure, and the step in which it began."""

    step: int
    name: str
    words: str


def cause_of(course: Course) -> dict[str, Any] | None:
    """The cause of the ego's failure in a game, as cells of `causes.csv`; None if there is no ego, or it reached its
    goal."""
    last = course.game.last_step(EGO)
    if last is None or course.game.outcomes[EGO] in (Outcome.GOAL, Outcome.RUNNING):
        return None
    other, event = course.involved, None
    if other is not None:
        event = _event(course, other, last)
    elif course.game.outcomes[EGO] is Outcome.RAIL:
        other, event = _drifts_beside(course, last)
    if other is None or event is None:
        return _of_the_ego_alone(course, last)
    players = course.drove.shape[1]
    broke = {player: _broken(course, player, last) for player in {EGO, other} if player < players}
    name, words = broke.get(other, ("", ""))
    if name:
        event = _Event(event.step, name, words if name in _SAY_IT_ALL else f"{words} and {event.words}")
    seen = _seen(course, other, event.step, last)
    reaction, braking_mps2 = _reaction(course, event.step, last)
    return {
        "other": course.game.names[other],
        "event": event.name,
        "deed": _subject(course, other) + event.words,
        "time_s": round(event.step * course.step_s, 6),
        "time_left_s": round((last - event.step) * course.step_s, 6),
        "ego_saw": "yes" if seen.any() else "no",
        "hidden_until_s": _hidden_until_s(course, other, event.step, last),
        "reaction": reaction,
        "braking_mps2": braking_mps2,
        "ego_broke": broke[EGO][1],
    }


def _of_the_ego_alone(course: Course, last: int) -> dict[str, Any]:
    event, deed = (
        ("late", "the ego does not reach its goal in time")
        if course.game.outcomes[EGO] is Outcome.TIMEOUT
        else ("leaves_road", "the ego leaves the road with no road user near")
    )
    reaction, braking_mps2 = _reaction(course, last, last)
    span = {"time_s": round(last * course.step_s, 6), "time_left_s": 0.0}
    return span | {"event": event, "deed": deed, "reaction": reaction, "braking_mps2": braking_mps2}


def _subject(course: Course, other: int) -> str:
    if other < course.drove.shape[1]:
        return ""
    return "an obstacle: " if course.game.names[other] in course.game.obstacles else "background traffic: "


def _event(course: Course, other: int, last: int) -> _Event:
    """What the other did about the ego's lane, or the ego about the other's."""
    lane, danger = in_lane(course, other, EGO), _danger(course, other, last)
    if _left_the_road(course, other, danger):
        return _Event(danger, "stands", "stands at the edge of the road, which it touched before")
    first = max(last - course.steps(at.SINCE_S), 0)
    if not lane.inside[last]:
        return _Event(danger, "leaves_lane", "the ego leaves its lane towards it")
    outside = np.flatnonzero(~lane.inside[first:last])
    entered = first + int(outside[-1]) + 1 if len(outside) else 0
    if len(outside) and lane.changes_lane(entered):
        return _Event(entered, "changes_lane", f"the ego changes into its lane, to the {lane.side(entered)}")
    for name, span in reversed(list(entries(course, other, EGO))):
        if first < span.first <= last:
            return _Event(span.first, name, words_of(name, lane.side(span.first)))
    name, words = _in_lane(course, other, last)
    return _Event(danger, name, words)


def _left_the_road(course: Course, other: int, step: int) -> bool:
    """Whether a body is a player that had touched the edge of the road before a step, and stood there since."""
    if other >= course.drove.shape[1] or course.game.outcomes[other] is not Outcome.RAIL:
        return False
    ended = course.game.last_step(other)
    return ended is not None and ended < step


def _drifts_beside(course: Course, last: int) -> tuple[int | None, _Event | None]:
    """The player that drifted last near the ego, within `SINCE_S` of the end, and its drift."""
    first, latest = last - course.steps(at.SINCE_S), -1
    found: tuple[int | None, _Event | None] = None, None
    for player in range(1, course.drove.shape[1]):
        for span in drifts(course, player) if course.drove[:, player].any() else ():
            step = min(span.last, last)
            away_m = box_distance(course.game.box(step, EGO), course.game.box(step, player))
            near = away_m <= at.CUT_IN_TIME_GAP_S * course.quantities.speed_mps[step, EGO]
            if near and span.first > latest and span.last >= first:
                latest, found = span.first, (player, _Event(span.first, "drift", span.text))
    return found


def _in_lane(course: Course, other: int, last: int) -> tuple[str, str]:
    """What a body does that has been in the ego's lane."""
    if course.angle_rad(last, other, EGO) > at.ONCOMING_RAD:
        return "oncoming", "comes towards the ego in its lane"
    if course.ahead_m(other, EGO)[last] < 0.0:
        return "from_behind", "hits the ego from behind"
    speeds_mps = course.game.bodies.speed_mps[max(last - course.steps(at.SINCE_S), 0) : last + 1, other]
    if speeds_mps[-1] < at.STANDS_MPS:
        return "stands", "stands in the ego's lane"
    moves = moves_of(course, other)
    braking_mps2 = -np.diff(speeds_mps) / course.step_s
    if moves != WALKS and len(braking_mps2) and braking_mps2.max() >= at.BRAKES_MPS2:
        return "brakes_ahead", "brakes ahead of the ego"
    return "ahead", f"{moves} ahead of the ego"


def _danger(course: Course, other: int, last: int) -> int:
    """The first step of the last stretch, up to the end, at a time to collision of at most `DANGER_TTC_S`."""
    step, present = last, course.game.bodies.present[:, other]
    while step > 0 and present[step - 1] and course.ttc_s(step - 1, other, EGO) <= at.DANGER_TTC_S:
        step -= 1
    return step


def _broken(course: Course, player: int, last: int) -> tuple[str, str]:
    """The gravest rule of the road that a player broke in the last `SINCE_S`, and words for it; empty if none."""
    first = last - course.steps(at.SINCE_S)
    if course.drove[:, player].any():
        for name, (words, rule) in RULES_OF_THE_ROAD.items():
            if any(span.first <= last and span.last >= first for span in rule(course, player)):
                return name, words
    return "", ""


def _reaction(course: Course, begin: int, last: int) -> tuple[str, float]:
    """What the ego did about it, and its strongest braking (m/s^2)."""
    first = max(begin - course.steps(at.BEFORE_S), 1)
    decelerations = -course.quantities.state.acceleration_mps2[first : last + 1, EGO]
    braking_mps2 = max(0.0, float(decelerations.max(initial=0.0)))
    swerved = any(span.last >= first and span.first <= last for span in swerves(course, EGO))
    did = [word for word, done in (("brakes", braking_mps2 >= at.BRAKES_MPS2), ("swerves", swerved)) if done]
    return " and ".join(did) or NO_REACTION, braking_mps2


def _seen(course: Course, other: int, begin: int, last: int) -> BoolArray:
    """[N] whether the ego looked, could see a body and had not lost it, from a step to the end."""
    bodies, steps = course.game.bodies, slice(begin, last + 1)
    away_m = np.hypot(*(each[steps, other] - each[steps, EGO] for each in (bodies.x_m, bodies.y_m)))
    lapsed, hidden = course.quantities.state.lapsed[steps, EGO], course.quantities.hidden[steps, EGO, other]
    lost = course.game.lost_by_ego(other)[steps]
    return np.asarray(~lapsed & ~hidden & ~lost & (away_m <= at.SEEN_M))


def _hidden_until_s(course: Course, other: int, begin: int, last: int) -> float:
    """Time before the end at which a body came into sight, if something hid it at the beginning; else NaN."""
    hidden = course.quantities.hidden[begin : last + 1, EGO, other]
    if not hidden[0]:
        return math.nan
    free = np.flatnonzero(~hidden)
    return round((len(hidden) - 1 - int(free[0])) * course.step_s, 6) if len(free) else 0.0


# --- in words ---


def event_words(event: str) -> str:
    return _WORDS.get(event, event.replace("_", " "))


def causes_in_words(causes: pd.DataFrame) -> Mapping[tuple[str, int, int], str]:
    """Event and response of every failure, such as "drift in -> swerves", by arm, seed and episode."""
    rows = causes.itertuples()
    return {(row.arm, row.seed, row.episode): f"{event_words(row.event)} -> {row.reaction}" for row in rows}


def cause_lines(causes: pd.DataFrame) -> list[str]:
    """The causes in rows of `causes.csv`, alike ones as one line, the most frequent first; empty without rows.

    E.g. "24 of 30: cuts in from the left, 0.4 to 0.9 s before contact; the ego sees it, no reaction (braking up to 0.9
    m/s²)".
    """
    kinds = causes.groupby(["ego_outcome", "deed", "ego_broke"], sort=False)
    groups = sorted((rows for _, rows in kinds), key=lambda rows: -len(rows))
    lines = [f"{len(rows)} of {len(causes)}: {kind_in_words(rows)}" for rows in groups[:MOST_LINES]]
    rest = sum(len(rows) for rows in groups[MOST_LINES:])
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
    return "; ".join([*parts, f"{_sight(rows)}{_reactions(rows)} ({braking})"])


def _sight(rows: pd.DataFrame) -> str:
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
