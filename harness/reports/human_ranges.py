"""How players drive beside what people do: the table `realism` in words, and a plot for each of its figures."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd
from markupsafe import Markup

from harness.evaluation.column import NUMBER, SHARE, Column
from harness.evaluation.columns import TABLES
from harness.evaluation.realism import CRASHES, NOT_COMPARABLE, OUTSIDE
from harness.reports.figures import GRID, INK, SERIES, figure_of, svg
from harness.reports.numbers import MISSING, number, percent, short

_WORDS = {
    "free_over_limit_mps": "speed over the limit on a free road",
    "latest_red_s_at_most_2": "passes on red within 2 s of its onset",
}
_CRASHES = Column(CRASHES, NUMBER, "Crashes alone on the road.", label="crashes per million km, alone")
_ROW_IN, _AXES_IN, _WIDTH_IN = 0.22, 0.7, 4.0


@dataclass(frozen=True, kw_only=True)
class HumanRow:
    """A comparable row of `realism` in words."""

    player: str
    figure: str
    games: int
    value: str
    spread: str
    people: str
    realistic: str

    @property
    def is_outside(self) -> bool:
        """Whether the player does what people do not."""
        return self.realistic == OUTSIDE


def comparable(realism: pd.DataFrame) -> pd.DataFrame:
    """The rows that could be compared."""
    return realism[realism["realistic"] != NOT_COMPARABLE]


def human_rows(realism: pd.DataFrame) -> list[HumanRow]:
    """The comparable rows in words, player by player."""
    return [
        HumanRow(
            player=row["player"],
            figure=title_of(row["figure"]),
            games=row["games"],
            value=_text(row["figure"], row["value"]),
            spread=f"{_text(row['figure'], row['low'])} to {_text(row['figure'], row['high'])}",
            people=_range(row["figure"], row["people_low"], row["people_high"]),
            realistic=row["realistic"],
        )
        for row in comparable(realism).to_dict("records")
    ]


def headline(realism: pd.DataFrame) -> str:
    """What the table says, in a sentence."""
    rows = comparable(realism)
    outside = rows[rows["realistic"] == OUTSIDE]
    if rows.empty:
        return "No figure could be compared with those of people."
    if outside.empty:
        return f"Every player is inside the range of people in each of the {len(rows)} figures that can be compared."
    names = ", ".join(f"{player} ({count})" for player, count in outside["player"].value_counts(sort=False).items())
    return f"Outside the range of people in {len(outside)} of {len(rows)} figures: {names}."


def plots(realism: pd.DataFrame) -> list[tuple[Markup, str]]:
    """A plot for each figure that could be compared: the range of people, and each player's middle 90 % of games. With
    the source of the range."""
    rows = comparable(realism)
    groups = rows[rows["figure"] != CRASHES].groupby("figure", sort=False)
    return [
        (_plot(str(name), group, place), str(group["source"].iloc[0])) for place, (name, group) in enumerate(groups, 1)
    ]


def title_of(figure: str) -> str:
    """A figure in words, with its unit."""
    column = _column(figure)
    words = _WORDS.get(figure, column.words)
    return f"{words} ({column.unit})" if column.unit and not _is_share(figure) else words


def _column(figure: str) -> Column:
    metric = figure.partition("_at_most_")[0]
    return _CRASHES if figure == CRASHES else TABLES["conduct"][metric]


def _is_share(figure: str) -> bool:
    return "_at_most_" in figure or _column(figure).unit == SHARE


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
            colour = SERIES["persona" if row["realistic"] == OUTSIDE else "alone"]
            if not _is_share(figure):
                axes.plot([row["low"], row["high"]], [at, at], color=colour, linewidth=2.0)
            axes.plot([row["value"]], [at], "o", color=colour, markersize=5)
        axes.set_xlim(left, right)
        axes.set_ylim(len(rows) - 0.5, -0.5)
        axes.set_yticks(range(len(rows)), rows["player"])
        axes.grid(visible=False)
        axes.set_xlabel(title_of(figure))
        axes.xaxis.set_major_formatter(lambda value, _: percent(value) if _is_share(figure) else short(value))
        axes.tick_params(axis="y", color=INK)
        return svg(drawing, f"people{place}", f"{title_of(figure)}. {'; '.join(_spoken(rows))}")


def _spoken(rows: pd.DataFrame) -> Iterator[str]:
    for row in human_rows(rows):
        yield f"{row.player}: {row.value}, people {row.people}: {row.realistic}"
