"""The figures of a persona's card, with a column for each arm: rates, speeds, and the single games behind them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from markupsafe import Markup

from harness.game.arrays import FloatArray
from harness.reports.figures import INK, SERIES, figure_of, svg
from harness.reports.numbers import trimmed
from harness.reports.run_tables import Row

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

NOT_PLAYED = "not played"
QUANTITIES = {
    "ego_mean_speed_mps": "average speed (m/s)",
    "ego_trailing_distance_m": "trailing distance (m)",
    "ego_min_ttc_s": "least time to collision (s; 20: more)",
    "ego_max_deceleration_mps2": "hardest braking (m/s²)",
    "ego_delta_v_mps": "delta-v of collisions (m/s)",
}
PAIRED = ("ego_mean_speed_mps", "ego_min_ttc_s")
LONGEST_TIME_S = 20.0
"""Longer times to collision are drawn at this one: nothing is at stake in them, and they would squeeze the others."""
FEWEST_IN_A_BOX = 8
"""Fewer games have no middle half: only the games themselves are drawn."""
MOST_DOTS = 300
"""The most games of an arm that are drawn one by one; of more, only the middle half and the median are drawn."""
MOST_LINES = 300
"""The most pairs that are drawn; of more, this many are chosen, evenly over the episodes."""
_WIDTH = 0.62
_DOT_PT, _FAILED_ALPHA, _WELL_ALPHA = 2.4, 0.95, 0.45


@dataclass(frozen=True, kw_only=True)
class ArmColumn:
    label: str
    series: str
    """A key of `SERIES`."""
    arm: str
    rates: Mapping[int, Row]
    """The arm's rows of `summary`, by seed."""
    games: pd.DataFrame
    """The arm's games that could be played, with the `address` of each on the page: empty where it has none."""
    worst: str
    """The address of its worst game that the page contains; empty: none."""


def rate_figure(columns: Sequence[ArmColumn], name: str, alternative: str) -> Markup:
    """The failure rate per arm: a bar for the mean over seeds, and each seed's value with its interval."""
    with figure_of(4.8, 3.3) as figure:
        axes = _arms(figure, columns)
        for place, column in enumerate(columns):
            rates = [row["failure_rate"] for row in column.rates.values()]
            if rates:
                mean = sum(rates) / len(rates)
                _link(axes.bar(place, mean, _WIDTH, color=SERIES[column.series], alpha=0.35, linewidth=0), column.worst)
        tops = [row["failure_rate_high"] for column in columns for row in column.rates.values()]
        axes.set_ylim(0, max([0.05, *tops]) * 1.14)
        axes.set_ylabel("failure rate (%)")
        axes.yaxis.set_major_formatter(lambda share, _: f"{share * 100:.3g}")
        _points(axes, columns, "failure_rate{}", lambda share: f"{trimmed(share * 100, 1)} %")
        return svg(figure, name, alternative)


def speed_figure(columns: Sequence[ArmColumn], name: str, alternative: str) -> Markup:
    """Average speed per arm: a pale bar from quartile to quartile of the games, the mean and its interval."""
    with figure_of(4.8, 3.3) as figure:
        axes = _arms(figure, columns)
        axes.use_sticky_edges = False  # the pale bars do not start at the axis
        for place, column in enumerate(columns):
            for x, seed in zip(_places(place, len(column.rates)), column.rates, strict=True):
                speeds = column.games.loc[column.games["seed"] == seed, "ego_mean_speed_mps"].dropna()
                low, high = speeds.quantile([0.25, 0.75])
                bar = axes.bar(
                    x, high - low, _WIDTH / len(column.rates), bottom=low,
                    color=SERIES[column.series], alpha=0.3, linewidth=0,
                )  # fmt: skip
                _link(bar, column.worst)
        axes.set_ylabel("average speed of the ego (m/s)")
        _points(axes, columns, "mean_speed{}_mps", lambda speed: f"{speed:.1f}")
        axes.margins(y=0.14)
        return svg(figure, name, alternative)


def pairs_of(before: ArmColumn, after: ArmColumn) -> pd.DataFrame:
    """The games of the same seed and episode in both arms, a row each; columns of the second one end in `_after`."""
    return before.games.merge(after.games, on=["seed", "episode"], suffixes=("", "_after"))


def paired_figure(pairs: pd.DataFrame, name: str, alternative: str, made: str) -> Markup:
    """A line per row of `pairs_of`, at most `MOST_LINES`, from the game of the naive ego to that of the ego which round
    2 `made`; a cross is a failure."""
    if len(pairs) > MOST_LINES:
        pairs = pairs.iloc[np.arange(MOST_LINES) * len(pairs) // MOST_LINES]
    with figure_of(4.8, 3.5) as figure:
        for axes, quantity in zip(figure.subplots(1, len(PAIRED), squeeze=False)[0], PAIRED, strict=True):
            before, after = (_values(pairs, quantity + end) for end in ("", "_after"))
            both = np.isfinite(before) & np.isfinite(after)
            ends = [np.stack((np.full(both.sum(), x), y[both]), 1) for x, y in ((0.0, before), (1.0, after))]
            _segments(axes, *ends, color=INK, linewidth=0.7, alpha=0.22)
            _games(axes, np.zeros(len(pairs)), pairs, quantity, "persona")
            _games(axes, np.ones(len(pairs)), pairs, quantity, "retrained", end="_after")
            if not both.any():
                axes.annotate("no pair", (0.5, 0.5), xycoords="axes fraction", ha="center", fontsize=9)
            axes.set_xlim(-0.25, 1.25)
            axes.set_xticks([0, 1], ["naive", made])
            axes.tick_params(axis="x", length=0)
            axes.set_ylabel(QUANTITIES[quantity])
        return svg(figure, name, alternative)


def spread_figure(columns: Sequence[ArmColumn], name: str, alternative: str) -> Markup:
    """For each quantity and arm: every game as a dot, the middle half as a box, the median as a line."""
    with figure_of(15.4, 4.0) as figure:
        all_axes = figure.subplots(1, len(QUANTITIES), squeeze=False)[0]
        for axes, (quantity, title) in zip(all_axes, QUANTITIES.items(), strict=True):
            labels = []
            for place, column in enumerate(columns):
                values, colour = _values(column.games, quantity), SERIES[column.series]
                measured = values[np.isfinite(values)]
                labels.append(f"{column.label}\nn = {len(measured)}")
                if not len(measured):
                    _note(axes, "none", place, 4, size_pt=8)
                    continue
                low, median, high = np.quantile(measured, [0.25, 0.5, 0.75])
                if len(measured) >= FEWEST_IN_A_BOX:
                    axes.bar(place, high - low, 0.66, bottom=low, color=colour, alpha=0.22, linewidth=0)
                axes.plot([place - 0.33, place + 0.33], [median, median], color=colour, linewidth=2)
                if len(measured) <= MOST_DOTS:
                    _games(axes, place + _beside(len(values)), column.games, quantity, column.series)
            axes.use_sticky_edges = False
            axes.set_title(title, fontsize=9, loc="left")
            axes.set_xlim(-0.6, len(columns) - 0.4)
            axes.set_xticks(range(len(labels)), labels, fontsize=8)
            axes.tick_params(axis="x", length=0)
            axes.tick_params(axis="y", labelsize=9)
        return svg(figure, name, alternative)


def _arms(figure: Figure, columns: Sequence[ArmColumn]) -> Axes:
    axes = figure.subplots()
    axes.set_xticks(range(len(columns)), [""] * len(columns))
    for place, column in enumerate(columns):  # only a text of one line has the same middle in any font
        for line, words in enumerate(column.label.split("\n")):
            _note(axes, words, place, -14 - 12 * line, size_pt=10)
    axes.set_xlim(-0.55, len(columns) - 0.45)
    axes.tick_params(axis="x", length=0)
    return axes


def _note(axes: Axes, words: str, place: int, above_pt: int, *, size_pt: int) -> None:
    """Words at an arm's place, so far above the axis."""
    at, offset, coordinates = (place, 0), (0, above_pt), ("data", "axes fraction")
    axes.annotate(words, at, offset, coordinates, "offset points", ha="center", fontsize=size_pt)


def _places(place: int, seeds: int) -> FloatArray:
    """The places of an arm's seeds, side by side around its middle."""
    return place + _WIDTH * ((np.arange(seeds) + 0.5) / seeds - 0.5)


def _points(axes: Axes, columns: Sequence[ArmColumn], names: str, text: Callable[[float], str]) -> None:
    """Each seed's value with its interval: columns of `summary`, whose `names` have a place for `_low` and `_high`."""
    for place, column in enumerate(columns):
        for x, row in zip(_places(place, len(column.rates)), column.rates.values(), strict=True):
            value, low, high = (row[names.format(end)] for end in ("", "_low", "_high"))
            colour, top = SERIES[column.series], value
            if math.isfinite(low) and math.isfinite(high):
                reach = [[value - low], [high - value]]
                axes.errorbar(x, value, yerr=reach, color=colour, linewidth=1.8, capsize=4, capthick=1.8)
                top = high
            _link(axes.plot(x, value, "o", color=colour, markersize=6, clip_on=False, zorder=4), column.worst)
            if len(column.rates) <= 2:
                axes.annotate(text(value), (x, top), (0, 4), textcoords="offset points", ha="center", fontsize=9)
        if not column.rates:
            _note(axes, NOT_PLAYED, place, 6, size_pt=9)


def _link(artists: Iterable[Artist], address: str) -> None:
    for artist in artists:
        artist.set_url(address or None)


def _values(games: pd.DataFrame, quantity: str) -> FloatArray:
    values: FloatArray = games[quantity].to_numpy(float)
    return np.minimum(values, LONGEST_TIME_S) if quantity.startswith("ego_min_ttc_s") else values


def _games(axes: Axes, x: FloatArray, games: pd.DataFrame, quantity: str, series: str, *, end: str = "") -> None:
    """Games as dots, failed ones as crosses; each leads to its game, if it has an address. `end` is that of the names
    of columns."""
    values, colour = _values(games, quantity + end), SERIES[series]
    failed = games[f"ego_failed{end}"].fillna(0).to_numpy(dtype=bool)
    addresses = games[f"address{end}"].to_numpy(dtype=object)
    measured, linked = np.isfinite(values), addresses != ""
    dots = np.stack((x, values), 1)[measured & ~failed & ~linked]
    _segments(axes, dots, dots, color=colour, linewidth=_DOT_PT, alpha=_WELL_ALPHA, zorder=3)
    well = (measured & ~failed & linked, "o", _DOT_PT, _WELL_ALPHA)
    for chosen, marker, size, alpha in (well, (measured & failed, "x", 4.2, _FAILED_ALPHA)):
        if chosen.any():
            axes.scatter(
                x[chosen], values[chosen], size**2, color=colour, marker=marker, alpha=alpha,
                linewidths=1.1 if marker == "x" else 0, zorder=3,
                urls=[address or None for address in addresses[chosen]],
            )  # fmt: skip


def _segments(axes: Axes, starts: FloatArray, ends: FloatArray, **style: Any) -> None:
    """Lines from `starts` [N, 2] to `ends` [N, 2] as one path, which takes few bytes; of no length they are dots."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    path = Path(np.stack((starts, ends), 1).reshape(-1, 2), [Path.MOVETO, Path.LINETO] * len(starts))
    path.should_simplify = False  # simplified, dots would go
    axes.add_patch(PathPatch(path, fill=False, capstyle="round", **style))
    axes.autoscale_view()


def _beside(games: int) -> FloatArray:
    """Offsets that keep the dots of an arm apart: multiples of the golden section, which form no rows."""
    return (np.arange(games) * 0.6180339887498949 % 1.0 - 0.5) * 0.5
