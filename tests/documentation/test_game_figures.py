"""The script behind docs/game-on-the-merge.md: its tables, and that the page shows them."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from harness.evaluation.gap_verdict import GapVerdict
from harness.evaluation.tables import write_csv
from tests.support.game_tables import findings
from tests.support.repository import REPOSITORY
from tests.support.scripts import script

PUBLISHED = REPOSITORY / "reports" / "merge-arms-race"

figures = script("game/figures.py")


def test_failures__a_cell_is_the_mean_over_seeds_and_a_dash_without_games() -> None:
    rates = [("naive", "anna", 0.2), ("naive", "anna", 0.4), ("naive", "bert", 0.0), ("robust", "anna", 0.1)]
    table = pd.DataFrame(rates, columns=["ego", "non_ego", "failure_rate"])
    assert figures.failures_table(table).splitlines() == [
        "| ego | `anna` | `bert` |",
        "| --- | ---: | ---: |",
        "| `naive` | 30.0% | 0.0% |",
        "| `robust` | 10.0% | – |",
    ]


@pytest.mark.parametrize(
    ("table", "source", "name"),
    [
        ("gaps_table", PUBLISHED / "gaps.csv", "gaps"),
        ("failures_table", PUBLISHED / "crossplay.csv", "crossplay"),
        ("generalisation_table", PUBLISHED / "generalisation.csv", "generalisation"),
    ],
)
def test_page__shows_the_output_of_the_script(table: str, source: Path, name: str) -> None:
    page = (REPOSITORY / "docs" / "game-on-the-merge.md").read_text(encoding="utf-8")
    assert getattr(figures, table)(figures.read(source, name)) in page


def test_responses__a_line_is_over_all_pairs_of_a_persona() -> None:
    columns = ["persona", "role", "verdict", "gap_share", "ego_failure_rate", "ego_failure_rate_best_response"]
    rows = [
        ("anna", "ego", GapVerdict.DISTINGUISHABLE, 0.3, 0.1, 0.0),
        ("anna", "non_ego", GapVerdict.LACKS_POWER, 0.0, 0.1, 0.1),
        ("anna", "ego", GapVerdict.DISTINGUISHABLE, 0.1, 0.2, 0.2),
        ("anna", "non_ego", GapVerdict.NONE_FOUND, 0.0, 0.2, 0.3),
    ]
    assert figures.responses_table(pd.DataFrame(rows, columns=columns)).splitlines()[2:] == [
        "| `anna` | 15.0% | 20.0% | in 0 of 2 pairs | in 2 of 2 pairs, up to 30% |"
    ]


def test_gaps__of_a_run_of_now_are_those_of_its_table(tmp_path: Path) -> None:
    found = findings(games=20).gaps
    write_csv(found, tmp_path / "gaps.csv")
    lines = figures.gaps_table(figures.read(tmp_path, "gaps")).splitlines()
    assert len(lines) == 2 + len(found)
    ego = found[(found["persona"] == "distracted") & (found["role"] == "ego")].iloc[0]
    payoffs = f"{ego['payoff']:.2f} → {ego['payoff_best_response']:.2f}"
    assert f"| `retrained_distracted` against `distracted`: ego | 1 | {payoffs} |" in lines[2]
