"""How players drive beside what people do: the table `realism` in words, and a plot for each of its figures."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup

from harness.evaluation.column import NUMBER, SHARE, Column
from harness.evaluation.columns import TABLES
from harness.evaluation.realism import CRASH_ODDS, CRASHES, DECLARED, NOT_COMPARABLE, OUTSIDE
from harness.reports.figures import GRID, INK, SERIES, figure_of, svg
from harness.reports.numbers import MISSING, SURE, number, percent, short

_WORDS = {
    "free_over_limit_mps": "speed over the limit on a free road",
    "latest_red_s_at_most_2": "passes on red within 2 s of its onset",
}
_OF_ARMS = {
    CRASHES: Column(CRASHES, NUMBER, "Crashes alone on the road.", label="crashes per million km, alone"),
    CRASH_ODDS: Column(
        CRASH_ODDS, NUMBER, "Odds of a crash alone.", label="crash odds against the same person attentive"
    ),
}
_ROW_IN, _AXES_IN, _WIDTH_IN = 0.22, 0.7, 4.0


@dataclass(frozen=True, kw_only=True)
class HumanRow:
    """A comparable row of `realism` in words."""

    player: str
    """With its training seed where the table has several."""
    figure: str
    games: int
    value: str
    measured: str
    """The value, with the middle 90 % of the games or its 95 % interval where it has one."""
    people: str
    realistic: str
    """With the reason that a persona declares."""

    @property
    def is_outside(self) -> bool:
        """Whether the player does what people do not, and its persona does not declare it."""
        return self.realistic == OUTSIDE


def comparable(realism: pd.DataFrame) -> pd.DataFrame:
    return realism[realism["realistic"] != NOT_COMPARABLE]


def unlike_people(realism: pd.DataFrame, persona: str, seed: int) -> str:
    """How a person differs from people, as a clause: each figure that is outside and not declared, with its value and
    the range of people. Empty if there is none."""
    found = "; ".join(map(_clause, _of_person(realism, persona, seed, OUTSIDE)))
    return f"the {persona} driver is outside the range of people: {found}" if found else ""


def declared_unlike(realism: pd.DataFrame, persona: str, seed: int) -> str:
    """The names of the figures that are outside as its persona declares, as a sentence. Empty if there is none."""
    found = "; ".join(_words(row["figure"]) for row in _of_person(realism, persona, seed, DECLARED))
    return f"The {persona} driver is unlike people, as its persona declares: {found}." if found else ""


def crashes_alone(realism: pd.DataFrame, persona: str, seed: int) -> str:
    """How often a person crashes alone on the road, with the 95 % interval, as a clause; empty if it was not played."""
    own = (realism["player"] == persona) & (realism["seed"] == seed) & (realism["figure"] == CRASHES)
    per_km = realism.loc[own, ["value", "low", "high"]].dropna() / 1e6
    if per_km.empty:
        return ""
    value, low, high = map(short, per_km.iloc[0].round(3))
    return f"{value} crashes per km ({SURE}: {low}–{high})"


def _of_person(realism: pd.DataFrame, persona: str, seed: int, verdict: str) -> list[Mapping[Any, Any]]:
    own = (realism["player"] == persona) & (realism["seed"] == seed)
    return realism[own & (realism["realistic"] == verdict)].to_dict("records")


def _clause(row: Mapping[Any, Any]) -> str:
    figure = row["figure"]
    unit = "" if _is_share(figure) or not _column(figure).unit else f" {_column(figure).unit}"
    people = _range(figure, row["people_low"], row["people_high"])
    return f"{_words(figure)} {_value(row)}{unit}, people {people}{unit}"


def human_rows(realism: pd.DataFrame) -> list[HumanRow]:
    return list(map(_in_words, _named(comparable(realism), realism).to_dict("records")))


def _named(rows: pd.DataFrame, realism: pd.DataFrame) -> pd.DataFrame:
    """Rows of a table whose players have their training seed in their name where the table has several."""
    if realism["seed"].nunique() < 2:
        return rows
    return rows.assign(player=rows["player"] + ", seed " + rows["seed"].astype(str))


def _in_words(row: Mapping[Any, Any]) -> HumanRow:
    figure, realistic, value = row["figure"], row["realistic"], _value(row)
    spread = f" ({_text(figure, row['low'])} to {_text(figure, row['high'])})" if np.isfinite(row["low"]) else ""
    return HumanRow(
        player=row["player"],
        figure=title_of(figure),
        games=row["games"],
        value=value,
        measured=f"{value}{spread}",
        people=_range(figure, row["people_low"], row["people_high"]),
        realistic=f"{realistic}: {row['reason']}" if realistic == DECLARED else realistic,
    )


def headline(realism: pd.DataFrame) -> str:
    """What the table says, in a sentence."""
    rows = _named(comparable(realism), realism)
    if rows.empty:
        return "No figure could be compared with those of people."
    outside, declared = (rows[rows["realistic"] == verdict] for verdict in (OUTSIDE, DECLARED))
    if outside.empty and declared.empty:
        return f"Every player is inside the range of people in each of the {len(rows)} figures that can be compared."
    found = f"Outside the range of people in {len(outside)} of {len(rows)} figures"
    if not outside.empty:
        found += f": {_counted(outside)}"
    return f"{found}." if declared.empty else f"{found}; in {len(declared)} more as declared: {_counted(declared)}."


def _counted(rows: pd.DataFrame) -> str:
    return ", ".join(f"{player} ({count})" for player, count in rows["player"].value_counts(sort=False).items())


def plots(realism: pd.DataFrame) -> list[tuple[Markup, str]]:
    """A plot for each figure that could be compared: the range of people, and each player's middle 90 % of games. With
    the source of the range."""
    rows = _named(comparable(realism), realism)
    groups = rows[~rows["figure"].isin([*_OF_ARMS])].groupby("figure", sort=False)
    return [
        (_plot(str(name), group, place), str(group["source"].iloc[0])) for place, (name, group) in enumerate(groups, 1)
    ]


def title_of(figure: str) -> str:
    """A figure in words, with its unit."""
    unit = _column(figure).unit
    return f"{_words(figure)} ({unit})" if unit and not _is_share(figure) else _words(figure)


def _words(figure: str) -> str:
    return _WORDS.get(figure, _column(figure).words)


def _column(figure: str) -> Column:
    metric = figure.partition("_at_most_")[0]
    return _OF_ARMS.get(figure) or TABLES["conduct"][metric]


def _is_share(figure: str) -> bool:
    return "_at_most_" in figure or _column(figure).unit == SHARE


def _value(row: Mapping[Any, Any]) -> str:
    """The value; of an infinite odds ratio the low end of its interval."""
    value, low = row["value"], row["low"]
    if np.isnan(value) and not np.isnan(low):
        return f"at least {_text(row['figure'], low)}"
    return _text(row["figure"], value)


def _text(figure: str, value: float) -> str:
    if _is_share(figure):
        return percent(value)
    return number(value, 0) if abs(value) >= 1000.0 else short(float(f"{value:.3g}")) if np.isfinite(value) else MISSING


def _range(figure: str, low: float, high: float) -> str:
    if np.isnan(low):
        return f"at most {_text(figure, high)}"
    return f"at least {_text(figure, low)}" if np.isnan(high) else f"{_text(figure, low)} to {_text(figure, high)}"


def _plot(figure: str, rows: pd.DataFrame, place: int) -> Markup:
    with figure_of(_WIDTH_IN, _AXES_IN + _ROW_IN * len(rows)) as drawing:
        axes = drawing.subplots()
        shown = rows[["value"]] if _is_share(figure) else rows[["low", "value", "high"]]
        ends = [*shown.to_numpy().ravel(), *rows["people_low"].dropna(), *rows["people_high"].dropna()]
        margin = 0.06 * (max(ends) - min(ends)) or 1.0
        left, right = min(ends) - margin, max(ends) + margin
        low, high = rows["people_low"].fillna(left).iloc[0], rows["people_high"].fillna(right).iloc[0]
        axes.axvspan(low, high, color=GRID, zorder=0)
        for at, row in enumerate(rows.to_dict("records")):
            colour = SERIES["persona" if row["realistic"] in (OUTSIDE, DECLARED) else "alone"]
            if not _is_share(figure):
                axes.plot([row["low"], row["high"]], [at, at], color=colour, linewidth=2.0)
            axes.plot([row["value"]], [at], "o", color=colour, markersize=5)
        axes.set_xlim(left, right)
        axes.set_ylim(len(rows) - 0.5, -0.5)
        axes.set_yticks(range(len(rows)), rows["player"])
        axes.grid(visible=False)
        drawing.supxlabel(title_of(figure), size="medium")  # may be wider than the axes
        axes.xaxis.set_major_formatter(lambda value, _: percent(value) if _is_share(figure) else short(value))
        axes.tick_params(axis="y", color=INK)
        return svg(drawing, f"people{place}", f"{title_of(figure)}. {'; '.join(_spoken(rows))}")


def _spoken(rows: pd.DataFrame) -> Iterator[str]:
    for row in map(_in_words, rows.to_dict("records")):
        yield f"{row.player}: {row.value}, people {row.people}: {row.realistic}"
