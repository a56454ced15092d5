"""The section on the game: what the findings on equilibria say, in words, small tables and heat maps."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from harness.evaluation.comparison import Verdict
from harness.reports.data_table import Table, table
from harness.reports.game_wording import equilibrium_sentences, gap_verdicts, last_pairs, other_pairs
from harness.reports.heatmaps import MatrixView, views
from harness.reports.wording import Answer, Row, Conclusion, interval, number, p_number, percent, trimmed
from harness.evaluation.tables import typed
from harness.evaluation.game_theory.records import GameFindings

CAPTIONS = {
    "gaps": "A row per best response.",
    "crossplay": "A row per pairing of an ego and a non-ego.",
    "equilibria": "A row per strategy of each solution of each game.",
    "generalisation": "A row per retrained ego and non-ego of a persona it was not trained against.",
}
_CELL_BYTES, _REST_BYTES = 60, 50_000


@dataclass(frozen=True)
class Gap:
    """One best response of a last pair, as a row of the small table."""

    seed: int
    pair: str
    who: str
    payoff: str
    best: str
    gap: str
    share: str
    p_holm: str
    failures: str
    failures_best: str
    verdict: str


@dataclass(frozen=True)
class Stranger:
    """An ego against a non-ego whose persona it was not trained against, over the seeds."""

    ego: str
    met: str
    non_ego: str
    seeds: int
    rate: str
    naive_rate: str
    share: str
    difference: str
    significant: str


@dataclass(frozen=True)
class GameSection:
    """All that the page says of the game."""

    verdicts: Sequence[tuple[str, Conclusion]]
    others: Sequence[tuple[str, str, Answer]]
    """Persona, name and answer of each pair that is not of the last round."""
    gaps: Sequence[Gap]
    views: Sequence[MatrixView]
    solutions: Sequence[tuple[int, str, Sequence[str]]]
    """Of each seed and game, what its solutions say."""
    strangers: Sequence[Stranger]
    tables: dict[str, Table]

    @property
    def bytes(self) -> int:
        """About as many as it takes on the page."""
        cells = sum(len(table.rows) * len(table.headings) for table in self.tables.values())
        return cells * _CELL_BYTES + sum(len(each.figure) for view in self.views for each in view.maps) + _REST_BYTES


def game_section(findings: GameFindings | None) -> GameSection | None:
    """The section of a run's findings; None where it has none."""
    if findings is None:
        return None
    found = {name: typed(getattr(findings, name)) for name in CAPTIONS}
    gaps, crossplay = found["gaps"], found["crossplay"]
    return GameSection(
        gap_verdicts(gaps),
        other_pairs(gaps),
        [_gap(row) for name in dict.fromkeys(gaps["persona"]) for row in _last(gaps[gaps["persona"] == name])],
        views(crossplay),
        equilibrium_sentences(found["equilibria"]),
        _strangers(found["generalisation"]),
        {name: table(name, CAPTIONS[name], frame) for name, frame in found.items()},
    )


def _last(gaps: pd.DataFrame) -> list[Row]:
    return [row for rows in last_pairs(gaps) for row in rows]


def _gap(row: Row) -> Gap:
    gap = number(row["gap"], 2)
    if math.isfinite(row["ci_low"]):
        gap += f" ({number(row['ci_low'], 2)} to {number(row['ci_high'], 2)})"
    return Gap(
        row["seed"],
        f"{row['ego']} against {row['non_ego']}",
        "ego" if row["role"] == "ego" else str(row["persona"]),
        number(row["payoff"], 2),
        number(row["payoff_best_response"], 2),
        gap,
        percent(row["gap_share"]) if not row["gap"] <= 0 else "none found",
        p_number(row["p_holm"]),
        _rate(row, "ego_failure_rate"),
        _rate(row, "ego_failure_rate_best_response"),
        str(row["verdict"]),
    )


def _rate(row: Row, name: str) -> str:
    if not math.isfinite(row[name]):
        return "–"
    return f"{percent(row[name])} ({interval(row[f'{name}_low'], row[f'{name}_high'])})"


def _strangers(generalisation: pd.DataFrame) -> list[Stranger]:
    rows = []
    for (ego, met, non_ego), of in generalisation.groupby(["ego", "met", "non_ego"], sort=False):
        known = of[of["pairs"] > 0]
        yes = int((known["verdict"] == Verdict.SIGNIFICANT.value).sum())
        rate, naive = known["failure_rate"].mean(), known["naive_failure_rate"].mean()
        span = ""
        if len(known) == 1:
            span = f" ({interval(known['failure_rate_low'].iloc[0], known['failure_rate_high'].iloc[0])})"
        elif len(known):
            span = f" ({interval(known['failure_rate'].min(), known['failure_rate'].max())})"
        difference = known["fewer_failures"].mean()
        less = f"{trimmed(abs(difference) * 100, 1)} points {'fewer' if difference > 0 else 'more'}"
        if len(known) == 1 and math.isfinite(known["fewer_failures_low"].iloc[0]):
            low, high = known["fewer_failures_low"].iloc[0] * 100, known["fewer_failures_high"].iloc[0] * 100
            low, high = (low, high) if difference > 0 else (-high, -low)
            less += f" ({trimmed(low, 1)} to {trimmed(high, 1)})"
        rows.append(
            Stranger(
                str(ego),
                str(met),
                str(non_ego),
                len(known),
                f"{percent(rate)}{span}",
                percent(naive),
                percent(rate / naive) if naive else "–",
                "–" if not len(known) else "none" if difference == 0 else less,
                f"{yes} of {len(known)}",
            )
        )
    return rows
