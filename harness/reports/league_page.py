"""The page of a league: the failures of one ego in all scenes, against all people, worst first."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import TYPE_CHECKING, Any

import pandas as pd

from harness.evaluation.comparisons.tied_ranks import with_shield
from harness.evaluation.league_columns import SUMO_DRIVER, UNTRAINED
from harness.reports.failure_table import ORDINARY, FailureCell
from harness.reports.numbers import NO_SPACE, interval, number, percent
from harness.reports.page_template import page_of
from harness.reports.run_tables import failures, failures_of, played
from harness.reports.severity_wording import RISK_TONES, risk_tone
from harness.reports.text_table import add_text_row, text_table

if TYPE_CHECKING:
    from rich.table import Table

HEADINGS = (
    *("scene", "person", "failures", "95 %", "preventable", "MAIS3+ per 100 games"),
    *("harm to others", "mean speed", "hard braking"),
)
_MUCH = 0.1
"""A failure rate above this is red on the terminal."""


def render_league(ego: str, table: pd.DataFrame, addresses: Sequence[str], failed: Sequence[str]) -> str:
    """The page as HTML. `table` is the table `league`, `addresses` lead to the worst game of each of its rows, `failed`
    says what could not be played."""
    rows = table.to_dict("records")
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    shields = sorted({row["shield"] for row in rows})
    met: dict[tuple[str, str], dict[str, list[FailureCell]]] = {}
    for row, address in zip(rows, addresses, strict=True):
        people = met.setdefault((row["scene"], row["shield"]), {})
        people.setdefault(row["person"], []).append(_cell(row, address))
    return page_of(
        "league",
        ego=ego,
        scenes=len(scenes),
        games=int(table["episodes"].sum() - table["errors"].sum()),
        columns=[person_in_words(each) for each in UNTRAINED],
        lines=[
            (with_shield(*line), [met[line].get(each, []) for each in UNTRAINED], _people(met[line]))
            for line in product(scenes, shields)
            if line in met
        ],
        headings=HEADINGS,
        tones=RISK_TONES,
        rows=[(address, list(_texts(row))) for row, address in zip(rows, addresses, strict=True)],
        failed=failed,
        not_answered=not_answered(table),
    )


def _people(met: Mapping[str, list[FailureCell]]) -> dict[str, list[FailureCell]]:
    """The cells of the people among those that the ego meets in a scene, by person."""
    return {person: cells for person, cells in met.items() if person not in UNTRAINED}


def not_answered(table: pd.DataFrame) -> list[tuple[str, str]]:
    """Each scene with a reason for which its games say nothing, once."""
    without = table[table["reason"].astype(bool)]
    return list(dict.fromkeys(zip(without["scene"], without["reason"], strict=True)))


def league_terminal(table: pd.DataFrame) -> Table:
    shown = text_table(HEADINGS[:5])
    for row in table.head(12).to_dict("records"):
        style = "dim" if row["reason"] else "red" if row["failure_rate"] > _MUCH else None
        scene, person, _, span, preventable, *_ = _texts(row)
        add_text_row(shown, scene, person, failures_of(row), span, preventable, style=style)
    return shown


def ranks_terminal(ranks: pd.DataFrame) -> Table:
    shown = text_table(("rank", "ego", "failures", "95 %", "told apart from"))
    for row in ranks.to_dict("records"):
        span = interval(row["failure_rate_low"], row["failure_rate_high"])
        rate = f"{percent(row['failure_rate'])} of {row['games']}"
        ego, others = with_shield(row["ego"], row["shield"]), row["told_apart"].replace(" + ", ", ")
        add_text_row(shown, str(row["rank"]), ego, rate, span, others or "nobody")
    return shown


def sentence_of(row: Mapping[Any, Any]) -> str:
    """What a row of the table says, in a sentence."""
    low, high = row["failure_rate_low"], row["failure_rate_high"]
    who = f"against {person_in_words(row['person'])} in {row['scene']}"
    rate = f"{percent(row['failure_rate'])} (95 %: {interval(low, high)})"
    fails = f"{with_shield(row['ego'], row['shield'])} fails in {failures_of(row)} games {who}: {rate}."
    return f"{fails} Not answered: {row['reason']}." if row["reason"] else fails


def person_in_words(person: str) -> str:
    """A cell of the column `person` for people."""
    return ORDINARY if person == SUMO_DRIVER else person


def _cell(row: Mapping[Any, Any], address: str) -> FailureCell:
    injured = row["serious_injuries"] * played(row)
    risk = injured / row["collisions"] if injured > 0.0 and row["collisions"] > 0 else math.nan
    copes = played(row) and not failures(row) and not row["reason"]
    return FailureCell(
        rate=percent(row["failure_rate"]),
        counts=failures_of(row),
        spans=(),
        tone="none" if copes else risk_tone(math.nan if row["reason"] else risk),
        game=address,
    )


def _texts(row: Mapping[Any, Any]) -> Iterator[str]:
    yield with_shield(row["scene"], row["shield"])
    yield person_in_words(row["person"]) + ("" if row["person"] in UNTRAINED else f", seed {row['seed']}")
    yield f"{percent(row['failure_rate'])} ({failures_of(row)})"
    yield interval(row["failure_rate_low"], row["failure_rate_high"])
    yield percent(row["preventable_rate"])
    yield number(100.0 * row["serious_injuries"], 1)
    yield percent(row["harm_to_others_rate"])
    yield f"{number(row['mean_speed_mps'], 1)}{NO_SPACE}m/s"
    yield percent(row["hard_brake_rate"])
