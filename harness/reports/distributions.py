"""Figures of single games: pairs from naive to retrained, and how a quantity is spread in each arm."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from markupsafe import Markup
from numpy.typing import NDArray

from harness.evaluation.strategies import NaiveEgo, against_persona
from harness.reports.figures import INK, SERIES, figure_of, svg
from harness.reports.game_links import NO_LINKS, GameLinks
from harness.reports.player_data import FloatArray
from harness.reports.verdict_wording import RETRAINED, Change

if TYPE_CHECKING:
    from matplotlib.axes import Axes

QUANTITIES = {
    "ego_mean_speed_mps": "average speed (m/s)",
    "ego_trailing_distance_m": "trailing distance (m)",
    "ego_min_ttc_s": "least time to collision (s; 20: and more)",
    "ego_max_deceleration_mps2": "hardest braking (m/s²)",
}
PAIRED = ("ego_mean_speed_mps", "ego_min_ttc_s")
LONGEST_TIME_S = 20.0
"""Longer times to collision are drawn at this one: nothing is at stake in them, and they would squeeze the others."""
TIMES = ("ego_min_ttc_s",)
FEWEST_IN_A_BOX = 8
"""Fewer games have no middle half: only the games themselves are drawn."""
MOST_DOTS = 300
"""The most games of an arm that are drawn one by one; of more, only the middle half and the median are drawn."""
MOST_LINES = 300
"""The most pairs that are drawn; of more, this many are chosen, evenly over the episodes."""
_DOT_PT, _FAILED_ALPHA, _WELL_ALPHA = 2.4, 0.95, 0.45


@dataclass(frozen=True, kw_only=True)
class Pairs:
    """One quantity of the same episodes before and after, each [N]; NaN where it was not measured."""

    label: str
    before: FloatArray
    after: FloatArray
    before_failed: NDArray[np.bool_]
    after_failed: NDArray[np.bool_]
    before_links: Sequence[str]
    after_links: Sequence[str]
    """The address of each game on the page, or an empty text."""


@dataclass(frozen=True, kw_only=True)
class Spread:
    """One quantity of every game of each arm [N], and which of them failed."""

    label: str
    arms: Sequence[tuple[str, str, FloatArray, NDArray[np.bool_], Sequence[str]]]
    """Label, series, values, failures and addresses of each arm's games."""


def pairs_of(persona: str, games: pd.DataFrame, change: Change = RETRAINED, links: GameLinks = NO_LINKS) -> list[Pairs]:
    """`PAIRED` of the episodes that the naive ego and the ego of round 2 both played against the persona."""
    arms = (against_persona(ego, persona).name for ego in (NaiveEgo(), change.ego(against=persona)))
    before, after = (games[games["arm"] == arm] for arm in arms)
    both = before.merge(after, on=["seed", "episode"], suffixes=("", "_after"))
    before_failed, after_failed = (_failed(both[column]) for column in ("ego_failed", "ego_failed_after"))
    before_links = links.of(both)
    after_links = links.of(both[["arm_after", "seed", "episode"]].rename(columns={"arm_after": "arm"}))
    return [
        Pairs(
            label=QUANTITIES[column],
            before=_values(both[column], column),
            after=_values(both[f"{column}_after"], column),
            before_failed=before_failed,
            after_failed=after_failed,
            before_links=before_links,
            after_links=after_links,
        )
        for column in PAIRED
    ]


def spreads_of(arms: Sequence[tuple[str, str, str]], games: pd.DataFrame, links: GameLinks = NO_LINKS) -> list[Spread]:
    """`QUANTITIES` in the games of each arm, given as label, series and name."""
    rows_of = {arm: games[games["arm"] == arm] for _, _, arm in arms}
    of_arm = [(label, series, rows_of[arm], links.of(rows_of[arm])) for label, series, arm in arms]
    return [
        Spread(
            label=label,
            arms=[
                (name, series, _values(rows[column], column), _failed(rows["ego_failed"]), addresses)
                for name, series, rows, addresses in of_arm
            ],
        )
        for column, label in QUANTITIES.items()
    ]


def _values(cells: pd.Series, column: str) -> FloatArray:
    values: FloatArray = cells.to_numpy(float)
    return np.minimum(values, LONGEST_TIME_S) if column in TIMES else values


def _failed(column: pd.Series) -> NDArray[np.bool_]:
    failed: NDArray[np.bool_] = column.fillna(0).to_numpy(dtype=bool)
    return failed


def paired_figure(quantities: Sequence[Pairs], name: str, alternative: str, made: str = "retrained") -> Markup:
    """A line per episode, at most `MOST_LINES`, from the game of the naive ego to that of the ego which round 2 `made`;
    a cross is a failure."""
    with figure_of(4.8, 3.5) as figure:
        for axes, every in zip(figure.subplots(1, len(quantities), squeeze=False)[0], quantities, strict=True):
            pairs = _drawn(every)
            both = np.isfinite(pairs.before) & np.isfinite(pairs.after)
            ends = [
                np.stack((np.full(both.sum(), x), y[both]), 1) for x, y in ((0.0, pairs.before), (1.0, pairs.after))
            ]
            _segments(axes, *ends, color=INK, linewidth=0.7, alpha=0.22)
            before = (pairs.before, pairs.before_failed, "persona", pairs.before_links)
            after = (pairs.after, pairs.after_failed, "retrained", pairs.after_links)
            for place, (values, failed, series, links) in enumerate((before, after)):
                _games(axes, np.full(len(values), float(place)), values, failed=failed, series=series, links=links)
            if not both.any():
                axes.annotate("no pair", (0.5, 0.5), xycoords="axes fraction", ha="center", fontsize=9)
            axes.set_xlim(-0.25, 1.25)
            axes.set_xticks([0, 1], ["naive", made])
            axes.tick_params(axis="x", length=0)
            axes.set_ylabel(pairs.label)
        return svg(figure, name, alternative)


def _drawn(pairs: Pairs) -> Pairs:
    count = len(pairs.before)
    if count <= MOST_LINES:
        return pairs
    drawn = np.arange(MOST_LINES) * count // MOST_LINES
    return Pairs(
        label=pairs.label,
        before=pairs.before[drawn],
        after=pairs.after[drawn],
        before_failed=pairs.before_failed[drawn],
        after_failed=pairs.after_failed[drawn],
        before_links=[pairs.before_links[place] for place in drawn.tolist()],
        after_links=[pairs.after_links[place] for place in drawn.tolist()],
    )


def spread_figure(quantities: Sequence[Spread], name: str, alternative: str) -> Markup:
    """For each quantity and arm: every game as a dot, the middle half as a box, the median as a line."""
    with figure_of(13.4, 4.0) as figure:
        for axes, spread in zip(figure.subplots(1, len(quantities), squeeze=False)[0], quantities, strict=True):
            for place, (_, series, values, failed, links) in enumerate(spread.arms):
                measured = np.isfinite(values)
                if not measured.any():
                    axes.annotate(
                        "none", (place, 0), (0, 4), xycoords=("data", "axes fraction"),
                        textcoords="offset points", ha="center", fontsize=8,
                    )  # fmt: skip
                    continue
                low, median, high = np.quantile(values[measured], [0.25, 0.5, 0.75])
                if measured.sum() >= FEWEST_IN_A_BOX:
                    axes.bar(place, high - low, 0.66, bottom=low, color=SERIES[series], alpha=0.22, linewidth=0)
                axes.plot([place - 0.33, place + 0.33], [median, median], color=SERIES[series], linewidth=2)
                if measured.sum() <= MOST_DOTS:
                    _games(axes, place + _beside(len(values)), values, failed=failed, series=series, links=links)
            axes.use_sticky_edges = False
            axes.set_title(spread.label, fontsize=10, loc="left")
            axes.set_xlim(-0.6, len(spread.arms) - 0.4)
            labels = [f"{label}\nn = {np.isfinite(values).sum()}" for label, _, values, _, _ in spread.arms]
            axes.set_xticks(range(len(labels)), labels, fontsize=8)
            axes.tick_params(axis="x", length=0)
            axes.tick_params(axis="y", labelsize=9)
        return svg(figure, name, alternative)


def _games(
    axes: Axes, x: FloatArray, values: FloatArray, *, failed: NDArray[np.bool_], series: str, links: Sequence[str]
) -> None:
    """Games as dots, failed ones as crosses; each leads to its game, if it has an address."""
    measured, linked = np.isfinite(values), np.array(links, dtype=bool)
    unlinked, colour = measured & ~failed & ~linked, SERIES[series]
    dots = np.stack((x, values), 1)[unlinked]
    _segments(axes, dots, dots, color=colour, linewidth=_DOT_PT, alpha=_WELL_ALPHA, zorder=3)
    well = (measured & ~failed & linked, "o", _DOT_PT, _WELL_ALPHA)
    for chosen, marker, size, alpha in (well, (measured & failed, "x", 4.2, _FAILED_ALPHA)):
        if chosen.any():
            axes.scatter(
                x[chosen], values[chosen], size**2, color=colour, marker=marker, alpha=alpha,
                linewidths=1.1 if marker == "x" else 0, zorder=3,
                urls=[links[place] or None for place in np.flatnonzero(chosen).tolist()],
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
