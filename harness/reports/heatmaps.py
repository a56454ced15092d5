"""Cross-play as heat maps: a cell for each ego and non-ego, with its number, shaded by the number's size."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import pandas as pd
from markupsafe import Markup

from harness.evaluation.game_theory.crossplay import Matrices, matrices
from harness.evaluation.worst_first import worst_first
from harness.reports.figures import GAME, INK, SERIES, figure_of, svg
from harness.reports.game_links import NO_LINKS, GameLinks
from harness.reports.game_wording import HEAT_TITLES, heat_caption
from harness.reports.numbers import MISSING, number, trimmed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Floats = npt.NDArray[np.float64]

OPENS_A_GAME = "A cell opens the worst of its games."
PALEST, DARKEST = 0.04, 0.5
"""Opacity of the least and the greatest value: text on them is legible on a dark and on a light page."""
COLUMN_IN, ROW_IN, LETTER_IN = 0.8, 0.46, 0.085


@dataclass(frozen=True, kw_only=True)
class HeatMap:
    """One figure of a view."""

    title: str
    caption: str
    figure: Markup
    width_in: float

    @property
    def wide(self) -> bool:
        """Whether it takes the whole width of the page."""
        return self.width_in > 5.5


@dataclass(frozen=True, kw_only=True)
class MatrixView:
    """The heat maps of one training seed, or of the mean over all."""

    label: str
    maps: Sequence[HeatMap]


@dataclass(frozen=True, kw_only=True)
class _Quantity:
    """A column of `crossplay`, with its colour."""

    name: str
    series: str
    per_cent: bool


QUANTITIES = (
    _Quantity(name="failure_rate", series="persona", per_cent=True),
    _Quantity(name="ego_payoff", series="alone", per_cent=False),
    _Quantity(name="non_ego_payoff", series="retrained", per_cent=False),
)


def views(crossplay: pd.DataFrame, links: GameLinks = NO_LINKS) -> list[MatrixView]:
    """The heat maps of `crossplay`: of its seed, or of the mean over its seeds first and then of each. A cell leads to
    the worst of its games."""
    worst = _worst_games(links)
    seeds = list(dict.fromkeys(crossplay["seed"]))
    shown = [(f"seed {seed}", crossplay[crossplay["seed"] == seed]) for seed in seeds]
    if len(seeds) > 1:
        shown.insert(0, (f"mean over {len(seeds)} seeds", _mean(crossplay)))
    return [
        MatrixView(
            label=label, maps=[_map(quantity, rows, label=label, place=place, worst=worst) for quantity in QUANTITIES]
        )
        for place, (label, rows) in enumerate(shown)
    ]


def _worst_games(links: GameLinks) -> dict[tuple[str, int | None], str]:
    """The address of the worst game of each arm and seed, and under the seed None of each arm."""
    worst: dict[tuple[str, int | None], str] = {}
    games = worst_first(links.episodes) if links.embedded else links.episodes[:0]
    for game, address in zip(games.itertuples(), links.of(games), strict=True):
        for seed in (int(game.seed), None):
            worst.setdefault((game.arm, seed), address)
    return worst


def _mean(crossplay: pd.DataFrame) -> pd.DataFrame:
    """Each cell's mean over the seeds that have it, with the least and the most in place of an interval."""
    cells = crossplay.groupby(["ego", "non_ego", "persona", "arm"], sort=False)
    means = {quantity.name: cells[quantity.name].mean() for quantity in QUANTITIES}
    means |= {f"{quantity.name}_low": cells[quantity.name].min() for quantity in QUANTITIES}
    means |= {f"{quantity.name}_high": cells[quantity.name].max() for quantity in QUANTITIES}
    return pd.DataFrame(means).reset_index()


def _map(
    quantity: _Quantity,
    crossplay: pd.DataFrame,
    *,
    label: str,
    place: int,
    worst: Mapping[tuple[str, int | None], str],
) -> HeatMap:
    """One heat map; `place` makes its ids unique. `worst` has the game that a cell of an arm and seed links to."""
    table = _by_persona(matrices(crossplay))
    cells = {(row["ego"], row["non_ego"]): row for row in crossplay.to_dict("records")}
    values = {
        "failure_rate": table.failure_rates,
        "ego_payoff": table.ego_payoffs,
        "non_ego_payoff": table.non_ego_payoffs,
    }[quantity.name]
    title = f"{HEAT_TITLES[quantity.name]}, {label}"
    numbers = [
        f"{ego} against {non_ego} {_text(quantity, values[row, column])}"
        for row, ego in enumerate(table.egos)
        for column, non_ego in enumerate(table.non_egos)
    ]
    longest = max(map(len, table.egos)), max(map(len, table.non_egos))
    width_in = LETTER_IN * longest[0] + COLUMN_IN * len(table.non_egos) + 0.1 * min(longest[1], 12) * 0.5
    height_in = ROW_IN * len(table.egos) + 0.35 + LETTER_IN * longest[1] * 0.55
    with figure_of(width_in, height_in) as figure:
        axes = _axes(figure, table)
        _draw_cells(axes, quantity, table, values, cells=cells, worst=worst)
        for drawing in (*axes.texts, *axes.patches):
            drawing.set_in_layout(False)  # they are within the axes; to measure them again is slow
        name = f"heat-{quantity.name.replace('_', '-')}-{place}"
        element = svg(figure, name, f"{title}: {'; '.join(numbers)}")
    caption = heat_caption(
        quantity.name,
        is_rate=quantity.per_cent,
        is_mean=label.startswith("mean"),
        unpaid=quantity.name == "non_ego_payoff" and "" in table.personas,
    )
    caption = f"{caption} {OPENS_A_GAME}" if GAME in element else caption
    return HeatMap(title=title, caption=caption, figure=element, width_in=round(width_in, 2))


def _axes(figure: Figure, table: Matrices) -> Axes:
    """Axes with a row for each ego and a column for each non-ego."""
    axes = figure.subplots()
    axes.grid(False)
    for spine in axes.spines.values():
        spine.set_visible(False)
    axes.set(xlim=(0, len(table.non_egos)), ylim=(len(table.egos), 0))
    axes.xaxis.tick_top()
    axes.set_xticks(
        [column + 0.5 for column in range(len(table.non_egos))], table.non_egos,
        rotation=30, ha="left", rotation_mode="anchor",
    )  # fmt: skip
    axes.set_yticks([row + 0.5 for row in range(len(table.egos))], table.egos)
    axes.tick_params(length=0)
    return axes


def _draw_cells(
    axes: Axes,
    quantity: _Quantity,
    table: Matrices,
    values: Floats,
    *,
    cells: Mapping[tuple[str, str], Mapping[str, Any]],
    worst: Mapping[tuple[str, int | None], str],
) -> None:
    """Shade each cell by its value, and write the value and its interval in it."""
    shades = _shades(quantity, table, values)
    for row, ego in enumerate(table.egos):
        for column, non_ego in enumerate(table.non_egos):
            if not np.isfinite(values[row, column]):
                axes.text(column + 0.5, row + 0.5, MISSING, ha="center", va="center")
                continue
            (bar,) = axes.bar(
                column + 0.5, 0.92, 0.95, bottom=row + 0.04, linewidth=0,
                color=SERIES[quantity.series], alpha=PALEST + (DARKEST - PALEST) * shades[row, column],
            )  # fmt: skip
            cell = cells[ego, non_ego]
            bar.set_url(worst.get((cell["arm"], cell.get("seed"))) or None)
            axes.text(column + 0.5, row + 0.46, _text(quantity, values[row, column]), ha="center", color=INK)
            axes.text(column + 0.5, row + 0.82, _span(quantity, cell), ha="center", fontsize=8, color=INK)


def _by_persona(table: Matrices) -> Matrices:
    """Each persona's strategies side by side."""
    places = sorted(range(len(table.non_egos)), key=lambda place: table.personas.index(table.personas[place]))
    return table.among(range(len(table.egos)), places)


def _shades(quantity: _Quantity, table: Matrices, values: Floats) -> Floats:
    """How dark each cell is, from 0 to 1; NaN stays."""
    if quantity.per_cent:
        most = np.nanmax(values, initial=0.0)
        return values / most if most > 0 else values
    shades = np.full(values.shape, np.nan)
    groups = table.personas if quantity.name == "non_ego_payoff" else [""] * len(table.non_egos)
    for group in set(groups):
        columns = [place for place, each in enumerate(groups) if each == group]
        part = values[:, columns]
        low, high = (np.nan, np.nan) if np.isnan(part).all() else (np.nanmin(part), np.nanmax(part))
        shades[:, columns] = (part - low) / (high - low) if high > low else np.where(np.isnan(part), np.nan, 0.5)
    return shades


def _text(quantity: _Quantity, value: float) -> str:
    if not np.isfinite(value):
        return MISSING
    return f"{trimmed(value * 100, 1)} %" if quantity.per_cent else number(value, 1)


def _span(quantity: _Quantity, cell: Mapping[str, Any]) -> str:
    low, high = cell[f"{quantity.name}_low"], cell[f"{quantity.name}_high"]
    if not (np.isfinite(low) and np.isfinite(high)):
        return ""
    if quantity.per_cent:
        return f"{trimmed(low * 100, 0)}–{trimmed(high * 100, 0)}"
    return f"{number(low, 1)} to {number(high, 1)}"
