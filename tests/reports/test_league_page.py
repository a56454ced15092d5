"""The page of a league: a cell for each pairing, and its colour."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from harness.evaluation.tables import table_of
from harness.reports.league_page import league_terminal, render_league, sentence_of
from tests.support.chromium import opener

ROW: dict[str, Any] = {
    **{"ego": "mine", "shield": "", "scene": "merge", "person": "speedy", "seed": 1, "arm": "naive_vs_speedy"},
    **{"episodes": 10, "errors": 0, "failure_rate": 0.2, "collisions": 1, "rails": 1, "timeouts": 0},
    **{"serious_injuries": 0.005, "reason": ""},
}
UNPLAYED = {"errors": 10, **dict.fromkeys(("failure_rate", "collisions", "rails", "timeouts", "serious_injuries"))}


def tones_of(page: str) -> list[str]:
    """The colours of the cells of the matrix."""
    return re.findall(r'class="tone-(\w+)"><a ', page)


@pytest.mark.parametrize(
    ("changed", "tone"),
    [
        ({}, "medium"),  # 0.005 * 10 serious injuries in one collision: 5 %
        ({"failure_rate": 0.0, "collisions": 0, "rails": 0, "serious_injuries": 0.0}, "none"),
        ({"collisions": 0, "rails": 2, "serious_injuries": 0.0}, "unknown"),
        ({"reason": "speedy fails alone"}, "unknown"),
        ({"reason": "speedy fails alone", "failure_rate": 0.0, "collisions": 0, "rails": 0}, "unknown"),
        (UNPLAYED, "unknown"),
    ],
)
def test_page__a_cell_is_green_only_where_the_ego_copes(changed: dict[str, Any], tone: str) -> None:
    page = render_league("mine", table_of("league", [ROW | changed]), ["merge/report.html"], [])
    assert tones_of(page) == [tone]


def test_page__of_an_arm_of_which_no_game_was_played() -> None:
    table = table_of("league", [ROW | UNPLAYED])
    page = render_league("mine", table, ["merge/report.html"], [])
    assert "– (0 of 0)" in page
    assert "default-src 'none'" in page  # it loads nothing
    assert league_terminal(table).row_count == 1
    (row,) = table.to_dict("records")
    assert sentence_of(row) == "mine fails in 0 of 0 games against speedy in merge: – (95 %: –)."


def test_page__fits_its_window_and_keeps_the_caption_in_sight_where_it_does_not(browser: Any, tmp_path: Path) -> None:
    people = [ROW | {"person": each} for each in ("paper_distracted", "sumo", "nobody")]
    file = tmp_path / "league.html"
    file.write_text(render_league("mine", table_of("league", people), ["merge/report.html"] * 3, []))
    with opener(browser, file) as open_page:
        pairings = "document.getElementById('pairings')"
        assert open_page(width=1280).evaluate(f"{pairings}.offsetWidth <= {pairings}.parentElement.clientWidth")
        page = open_page(width=600)
        page.evaluate(f"{pairings}.parentElement.scrollLeft = 100")
        left, right = page.evaluate(f"(({{left, right}}) => [left, right])({pairings}.caption.getBoundingClientRect())")
        assert 0 <= left < right <= 600
