"""The section on starts: from which the ego fails, comes too close or reaches its goal, as points of a plane."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup

from harness.evaluation.start_space import NEIGHBOURS, SCORES, best_pair, endings, explained_share
from harness.evaluation.strategies import against_persona
from harness.evaluation.worst_first import worst_first
from harness.game.arrays import FloatArray
from harness.game.roles import MOST_PEOPLE, NON_EGO, roles_of
from harness.reports.failure_table import ORDINARY
from harness.reports.figures import INK, TONES, figure_of, svg
from harness.reports.focus import focus_of
from harness.reports.game_links import GameLinks
from harness.reports.numbers import percent, trimmed
from harness.reports.run_tables import RunTables
from harness.reports.severity_wording import RISK_TONES, risk_tone

MOST_STARTS = 300
"""Of an arm that are drawn. Of more, the worst are the half of these, and the others lie evenly over the episodes."""
_OF_PERSON = {
    "ahead_m": "{} ahead of the ego (m)",
    "after_s": "{} after the ego where the ways join (s)",
    "position_m": "{} along its way (m)",
    "faster_mps": "{} faster than the ego (m/s)",
    "speed_mps": "speed of {} (m/s)",
}
_OTHERS = {
    "ego_position_m": "ego along its way (m)",
    "ego_speed_mps": "speed of the ego (m/s)",
    "friction": "friction",
    "visibility_m": "visibility (m)",
    "speed_limit_share": "factor on the speed limits",
    "signal_place": "place in the cycles of the signals",
}
_COLOURS = {"small": "severity-small", "medium": "severity-medium", "severe": "severity-severe", "unknown": "open"}
_FINE = {"marker": "o", "s": 14, "color": TONES["mended"], "linewidths": 0, "alpha": 0.75}
_NEAR = {"marker": "o", "s": 22, "facecolors": "none", "edgecolors": TONES["ink"], "linewidths": 1.1}
_STYLES: Mapping[str, Mapping[str, Any]] = {"fine": _FINE, "near_miss": _NEAR} | {
    tone: {"marker": "X", "s": 46, "color": TONES[colour], "linewidths": 0} for tone, colour in _COLOURS.items()
}
"""How points are drawn: a failure by the key of `RISK_TONES`, another game by its ending."""
_KIND_WORDS = {
    "fine": "without failure or near miss",
    "near_miss": "near miss",
    "small": f"failure: serious injury at most {RISK_TONES['small']}",
    "medium": f"failure: serious injury at most {RISK_TONES['medium']}",
    "severe": f"failure: serious injury {RISK_TONES['severe']}",
    "unknown": f"failure: {RISK_TONES['unknown']}",
}


@dataclass(frozen=True, kw_only=True)
class _ShownArm:
    name: str
    label: str
    who: str
    """The other road user in labels; empty: the ego is alone."""


def start_section(tables: RunTables, links: GameLinks) -> list[dict[str, Any]]:
    """What the template shows: a view for each arm, that of the first screen first. Empty where no game was played, or
    where starts differ in fewer than two quantities."""
    views: list[dict[str, Any]] = []
    axes: dict[bool, list[str]] = {}  # the same in all arms with a person, so that their pictures can be compared
    for arm in _arms(tables):
        games = tables.games_of(arm.name)
        starts = tables.starts.loc[:, [arm.who != "" or not name.startswith("non_ego") for name in tables.starts]]
        if games.empty or len(starts.columns) < 2:
            continue
        scores = endings(games).map(SCORES).astype(float).groupby(games["episode"]).mean()
        starts = starts.loc[scores.index]
        if (arm.who != "") not in axes:
            axes[arm.who != ""] = list(best_pair(starts, scores.to_numpy()))
        shown = starts[axes[arm.who != ""]]
        views.append(_view(arm, tables, links, shown, scores.to_numpy(), f"starts{len(views)}"))
    return views


def _arms(tables: RunTables) -> list[_ShownArm]:
    """Each persona's arms with the naive ego and the last one; the arm that matters most is the first."""
    found: dict[str, _ShownArm] = {}
    for persona in tables.personas:
        egos = {
            tables.arms_of("RQ1", persona)[1]: tables.naive,
            against_persona(tables.last_ego(persona), persona).name: f"{tables.change.made} ego",
        }
        found |= {arm: _ShownArm(name=arm, label=f"{ego} against {persona}", who=persona) for arm, ego in egos.items()}
    focus = focus_of(tables)
    if focus is not None and focus.arm not in found:
        who = focus.persona or (ORDINARY if focus.is_ordinary else "")
        label = f"{focus.ego} against {who}" if who else f"{focus.ego} alone"
        found[focus.arm] = _ShownArm(name=focus.arm, label=label, who=who)
    return sorted(found.values(), key=lambda arm: focus is None or arm.name != focus.arm)


def _view(
    arm: _ShownArm, tables: RunTables, links: GameLinks, starts: pd.DataFrame, scores: FloatArray, name: str
) -> dict[str, Any]:
    """An arm's picture on the two axes `starts` [N, 2], one of its episodes a row."""
    worst = worst_first(tables.games_of(arm.name)).drop_duplicates("episode")
    drawn = _drawn(worst)
    labels = [_words(axis, arm, tables) for axis in starts]
    failed = starts.loc[worst.loc[worst["ego_failed"] == 1, "episode"]]
    told = explained_share(starts.to_numpy(float), scores)
    sentences = [_where(failed, starts, labels)]
    if told > 0.0:
        sentences.append(f"The {NEIGHBOURS} nearest starts tell {percent(told)} of the variance of how a game ends.")
    else:
        sentences.append("Nearby starts do not tell how a game ends.")
    if len(drawn) < len(worst):
        sentences.append(f"{len(drawn)} of {len(worst):,} starts are drawn, the worst among them.")
    kinds = _kinds(drawn)
    boundaries = _boundaries(arm, tables, list(starts))
    alternative = f"Starts of the {arm.label}: {'; '.join(labels)}. {sentences[0]}"
    points = starts.loc[drawn["episode"]].to_numpy(float)
    return {
        "label": arm.label,
        "figure": _figure(points, links.of(drawn), kinds, boundaries, labels, name, alternative),
        "sentences": sentences,
        "kinds": [(kind, _KIND_WORDS[kind]) for kind in _STYLES if (kinds == kind).any()],
        "boundaries": len(boundaries),
    }


def _words(axis: str, arm: _ShownArm, tables: RunTables) -> str:
    """The label of an axis. Of several people, each has its number, or its persona in a crowd."""
    if axis in _OTHERS:
        return _OTHERS[axis]
    people = roles_of(1 + MOST_PEOPLE)[NON_EGO:]
    role = next(each for each in reversed(people) if axis.startswith(f"{each}_"))
    several = any(each.startswith(f"{people[1]}_") for each in tables.starts)
    crowd = tables.crowds.get(arm.who, [f"person {place}" for place in range(1, 1 + MOST_PEOPLE)])
    who = crowd[people.index(role)] if several else arm.who
    return _OF_PERSON[axis.removeprefix(f"{role}_")].format(who)


def _where(failed: pd.DataFrame, starts: pd.DataFrame, labels: Sequence[str]) -> str:
    if failed.empty:
        return f"None of {len(starts):,} starts fails."
    ranges = [
        f"{label} {_range(failed[axis])} (all starts: {_range(starts[axis])})"
        for axis, label in zip(starts, labels, strict=True)
    ]
    return f"{len(failed):,} of {len(starts):,} starts fail: {'; '.join(ranges)}."


def _range(values: pd.Series) -> str:
    low, high = trimmed(values.min(), 1), trimmed(values.max(), 1)
    return low if low == high else f"{low} to {high}"


def _drawn(worst: pd.DataFrame) -> pd.DataFrame:
    """The games that are drawn, of the worst of each start, worst first."""
    if len(worst) > MOST_STARTS:
        left = MOST_STARTS // 2
        first, others = worst[: MOST_STARTS - left], worst[MOST_STARTS - left :].sort_values("episode")
        worst = pd.concat([first, others.iloc[np.arange(left) * len(others) // left]])
    return worst.sort_values("episode")


def _kinds(games: pd.DataFrame) -> pd.Series:
    """The key of `_STYLES` of each game."""
    tones = games["mais3_risk_high"].map(risk_tone)
    return endings(games).where(games["ego_failed"] != 1, tones)


def _boundaries(arm: _ShownArm, tables: RunTables, axes: list[str]) -> list[FloatArray]:
    """The boundaries of an arm on two axes, each [2 or 3, 2]. What they do not change is as the episode has it."""
    found = []
    for each in tables.boundaries:
        if each.arm == arm.name and each.episode in tables.starts.index and len(each.starts) > 1:
            drawn = tables.starts.loc[each.episode]
            points = each.starts.reindex(columns=axes).fillna({axis: drawn[axis] for axis in axes})
            found.append(points.to_numpy(float))
    return found


def _figure(
    points: FloatArray,
    addresses: Sequence[str],
    kinds: pd.Series,
    boundaries: Sequence[FloatArray],
    labels: Sequence[str],
    name: str,
    alternative: str,
) -> Markup:
    """A point for each game [N, 2], which leads to its address [N], if it has one; a line for each boundary [3, 2] from
    a failure over the mildest one, a square, to a start without one."""
    with figure_of(5.6, 4.0) as figure:
        axes = figure.subplots()
        axes.grid(True, axis="both")
        for kind, style in _STYLES.items():
            at = np.flatnonzero(kinds == kind)
            if len(at):
                axes.scatter(*points[at].T, urls=[addresses[each] or None for each in at], zorder=3, **style)
        for boundary in boundaries:
            axes.plot(*boundary.T, color=INK, linewidth=1.0, zorder=2)
            axes.plot(*boundary[1], "s", color=INK, markersize=5, markerfacecolor="none", zorder=4)
        axes.set_xlabel(labels[0])
        axes.set_ylabel(labels[1])
        return svg(figure, name, alternative)
