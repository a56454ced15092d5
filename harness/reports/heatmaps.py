"""Cross-play as heat maps: a cell for each ego and non-ego, with its number, shaded by the number's size."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from harness.evaluation.game_theory.empirical_game import SolutionKind
from harness.evaluation.worst_first import worst_first
from harness.game.arrays import FloatArray
from harness.reports.figures import GAME, INK, SERIES, figure_of, svg
from harness.reports.game_links import GameLinks
from harness.reports.numbers import MISSING, number, trimmed
from harness.reports.run_tables import Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WorstGames = Mapping[tuple[str, int | None], str]
"""The address of the worst game of each arm and seed, and under the seed None of each arm."""

Pairs = Collection[tuple[str, str]]
"""An ego and a non-ego each."""

IN_EQUILIBRIUM = "Framed: what an equilibrium of each persona’s game plays, the first of its table."
LEAST_SHARE = 0.0005
"""A strategy with a smaller share is not played."""
OPENS_A_GAME = "A cell opens the worst of its games."
PALEST, DARKEST = 0.04, 0.5
"""Opacity of the least and the greatest value: text on them is legible on a dark and on a light page."""
COLUMN_IN, ROW_IN, LETTER_IN = 0.8, 0.46, 0.085


@dataclass(frozen=True, kw_only=True)
class _Quantity:
    """A column of `crossplay`, with its colour and words."""

    name: str
    series: str
    title: str
    caption: str
    per_cent: bool = False

    def text(self, value: float) -> str:
        """A value as it stands in its cell."""
        if not np.isfinite(value):
            return MISSING
        return f"{trimmed(value * 100, 1)} %" if self.per_cent else number(value, 1)

    def span(self, cell: Row) -> str:
        """The interval of a cell; empty where it has none."""
        low, high = cell[f"{self.name}_low"], cell[f"{self.name}_high"]
        if not (np.isfinite(low) and np.isfinite(high)):
            return ""
        if self.per_cent:
            return f"{trimmed(low * 100, 0)}–{trimmed(high * 100, 0)}"
        return f"{number(low, 1)} to {number(high, 1)}"


QUANTITIES = (
    _Quantity(
        name="failure_rate",
        series="persona",
        title="Failure rate of the ego (%)",
        caption="Darker: fails more.",
        per_cent=True,
    ),
    _Quantity(name="ego_payoff", series="alone", title="Payoff of the ego", caption="Darker: earns more."),
    _Quantity(
        name="non_ego_payoff",
        series="retrained",
        title="Payoff of the non-ego",
        caption=(
            "Darker: earns more than other strategies of the same persona; payoffs of two personas are not comparable."
        ),
    ),
)


def views(crossplay: pd.DataFrame, equilibria: pd.DataFrame, links: GameLinks) -> list[dict[str, Any]]:
    """The heat maps of `crossplay`: of its seed, or of the mean over its seeds first and then of each. A cell leads to
    the worst of its games; those of a seed that are played in an equilibrium have a frame. Each view has its `label`
    and its `maps`, a dictionary for each quantity."""
    worst = _worst_games(links)
    seeds = list(dict.fromkeys(crossplay["seed"]))
    shown: list[tuple[str, pd.DataFrame, Pairs]] = [
        (f"seed {seed}", crossplay[crossplay["seed"] == seed], _in_equilibrium(equilibria, int(seed))) for seed in seeds
    ]
    if len(seeds) > 1:
        shown.insert(0, (f"mean over {len(seeds)} seeds", _mean(crossplay), ()))
    return [
        {"label": label, "maps": [_map(quantity, rows, label, place, worst, framed) for quantity in QUANTITIES]}
        for place, (label, rows, framed) in enumerate(shown)
    ]


def _in_equilibrium(equilibria: pd.DataFrame, seed: int) -> Pairs:
    """The pairs that the first equilibrium of each persona's game plays, in the order of the table."""
    solved = equilibria[(equilibria["seed"] == seed) & (equilibria["solution"] == SolutionKind.NASH.value)]
    played = solved[(solved["number"] == 1) & (solved["share"] >= LEAST_SHARE)]
    pairs: list[tuple[str, str]] = []
    for _, rows in played.groupby("game", sort=False):
        egos, non_egos = (rows.loc[rows["role"] == role, "player"] for role in ("ego", "non_ego"))
        pairs += product(egos, non_egos)
    return pairs


def _worst_games(links: GameLinks) -> WorstGames:
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
    quantity: _Quantity, crossplay: pd.DataFrame, label: str, place: int, worst: WorstGames, framed: Pairs
) -> dict[str, Any]:
    """One heat map: its title, caption, figure and width; `place` makes its ids unique. Each persona's strategies are
    side by side."""
    personas = dict(zip(crossplay["non_ego"], crossplay["persona"], strict=True))
    order = list(dict.fromkeys(personas.values()))
    egos = list(dict.fromkeys(crossplay["ego"]))
    non_egos = sorted(personas, key=lambda each: order.index(personas[each]))
    table = crossplay.pivot(index="ego", columns="non_ego", values=quantity.name)
    table = table.reindex(index=egos, columns=non_egos)
    title = f"{quantity.title}, {label}"
    numbers = [
        f"{ego} against {non_ego} {quantity.text(table.loc[ego, non_ego])}" for ego in egos for non_ego in non_egos
    ]
    longest = max(map(len, egos)), max(map(len, non_egos))
    width_in = LETTER_IN * longest[0] + COLUMN_IN * len(non_egos) + 0.1 * min(longest[1], 12) * 0.5
    height_in = ROW_IN * len(egos) + 0.35 + LETTER_IN * longest[1] * 0.55
    shades = _shades(quantity, table.to_numpy(float), [personas[each] for each in non_egos])
    with figure_of(width_in, height_in) as figure:
        axes = _axes(figure, egos, non_egos)
        _draw_cells(axes, quantity, crossplay, pd.DataFrame(shades, egos, non_egos), worst)
        _draw_frames(axes, egos, non_egos, framed)
        for drawing in (*axes.texts, *axes.patches):
            drawing.set_in_layout(False)  # they are within the axes; to measure them again is slow
        name = f"heat-{quantity.name.replace('_', '-')}-{place}"
        played = "; ".join(f"{ego} against {non_ego}" for ego, non_ego in framed)
        solution = f". In equilibrium: {played}" if played else ""
        element = svg(figure, name, f"{title}: {'; '.join(numbers)}{solution}")
    spread = f"95 % interval ({'Clopper-Pearson' if quantity.per_cent else 't'})"
    if label.startswith("mean"):
        spread = "least to most of the seeds that played it"
    unpaid = " SUMO’s own driver has no payoff." if quantity.name == "non_ego_payoff" and "" in order else ""
    caption = f"{quantity.caption}{unpaid} Below each mean: {spread}."
    caption = " ".join([caption, *([IN_EQUILIBRIUM] if framed else []), *([OPENS_A_GAME] if GAME in element else [])])
    return {"title": title, "caption": caption, "figure": element, "width_in": round(width_in, 2)}


def _axes(figure: Figure, egos: list[str], non_egos: list[str]) -> Axes:
    axes = figure.subplots()
    axes.grid(False)
    for spine in axes.spines.values():
        spine.set_visible(False)
    axes.set(xlim=(0, len(non_egos)), ylim=(len(egos), 0))
    axes.xaxis.tick_top()
    axes.set_xticks(
        [column + 0.5 for column in range(len(non_egos))], non_egos, rotation=30, ha="left", rotation_mode="anchor"
    )
    axes.set_yticks([row + 0.5 for row in range(len(egos))], egos)
    axes.tick_params(length=0)
    return axes


def _draw_cells(
    axes: Axes, quantity: _Quantity, crossplay: pd.DataFrame, shades: pd.DataFrame, worst: WorstGames
) -> None:
    """Shade each cell by its value, and write the value and its interval in it."""
    cells = {(cell["ego"], cell["non_ego"]): cell for cell in crossplay.to_dict("records")}
    for row, ego in enumerate(shades.index):
        for column, non_ego in enumerate(shades.columns):
            cell = cells.get((ego, non_ego))
            if cell is None or not np.isfinite(cell[quantity.name]):
                axes.text(column + 0.5, row + 0.5, MISSING, ha="center", va="center")
                continue
            (bar,) = axes.bar(
                column + 0.5, 0.92, 0.95, bottom=row + 0.04, linewidth=0,
                color=SERIES[quantity.series], alpha=PALEST + (DARKEST - PALEST) * shades.iloc[row, column],
            )  # fmt: skip
            bar.set_url(worst.get((cell["arm"], cell.get("seed"))) or None)
            axes.text(column + 0.5, row + 0.46, quantity.text(cell[quantity.name]), ha="center", color=INK)
            axes.text(column + 0.5, row + 0.82, quantity.span(cell), ha="center", fontsize=8, color=INK)


def _draw_frames(axes: Axes, egos: list[str], non_egos: list[str], framed: Pairs) -> None:
    from matplotlib.patches import Rectangle

    for ego, non_ego in framed:
        corner = (non_egos.index(non_ego) + 0.025, egos.index(ego) + 0.04)
        axes.add_patch(Rectangle(corner, 0.95, 0.92, fill=False, edgecolor=INK, linewidth=1.6))


def _shades(quantity: _Quantity, values: FloatArray, personas: list[str]) -> FloatArray:
    """How dark each cell is, from 0 to 1; NaN stays. Payoffs of non-egos are compared within a persona."""
    if quantity.per_cent:
        most = np.nanmax(values, initial=0.0)
        return values / most if most > 0 else values
    shades = np.full(values.shape, np.nan)
    groups = np.array(personas if quantity.name == "non_ego_payoff" else [""] * len(personas))
    for group in set(groups.tolist()):
        part = values[:, groups == group]
        low, high = (np.nan, np.nan) if np.isnan(part).all() else (np.nanmin(part), np.nanmax(part))
        shades[:, groups == group] = (
            (part - low) / (high - low) if high > low else np.where(np.isnan(part), np.nan, 0.5)
        )
    return shades
