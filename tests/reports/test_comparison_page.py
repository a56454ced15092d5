"""The comparison of runs as a page and on the terminal: the failures over the runs, and the games that changed."""

from __future__ import annotations

import io
import re

import pytest
from rich.console import Console

from harness.evaluation.comparisons.run_comparison import changed_games, differences_of, failure_rates
from harness.reports.comparison_page import (
    ComparedRun,
    Comparison,
    Transition,
    change_sentences,
    compared_rows,
    history_table,
)
from harness.reports.history_figures import histories
from tests.support.chromium import accessibility_violations
from tests.support.pages import Page, campaign, plain

SHARES = {"one": 0.3, "two": 0.1, "three": 0.2}  # of the 60 games of the naive ego; the first ones fail


@pytest.fixture(scope="module")
def comparison():
    made = [campaign(personas=["speedy"], failing={"naive": share, "sumo": 0.0}) for share in SHARES.values()]
    games = [each["episodes"] for each in made]
    runs = [
        ComparedRun(name=f"reports/{label}", label=label, address=f"../{label}/report.html", manifest=each["manifest"])
        for label, each in zip(SHARES, made, strict=True)
    ]
    changes = changed_games(games, [1] * 3)
    transitions = [
        Transition(
            before=runs[place],
            after=runs[place + 1],
            same_starts=True,
            significance=0.01,
            rows=compared_rows(differences_of(*games[place : place + 2], same_starts=True), 0.01),
            changes=changes[place],
        )
        for place in range(2)
    ]
    found = histories([each["arms"] for each in made], [failure_rates(each) for each in games])
    return Comparison(runs=runs, transitions=transitions, histories=found)


@pytest.fixture(scope="module")
def report(comparison, tmp_path_factory):
    path = tmp_path_factory.mktemp("comparison") / "compare.html"
    path.write_text(comparison.page(), encoding="utf-8")
    return path


def test_histories__are_of_each_ego_against_each_person_in_every_run(comparison):
    rows = {(each.ego, each.person): [each.text(run) for run in range(3)] for each in comparison.histories}
    assert list(rows) == [
        ("naive ego", "nobody"),
        ("naive ego", "SUMO’s driver"),
        ("naive ego", "speedy"),
        ("retrained ego", "speedy"),
    ]
    assert list(map(plain, rows["naive ego", "speedy"])) == [
        "18 of 60 (18.8–43.2 %)",
        "6 of 60 (3.8–20.5 %)",
        "12 of 60 (10.8–32.3 %)",
    ]


def test_page__shows_the_rates_of_each_run_and_says_them(comparison):
    page = comparison.page()
    (naive, retrained) = re.findall(r'<svg [^>]*aria-label="(Failures in each run[^"]*)"', page)
    assert "speedy 18 of 60" in plain(naive)
    assert "nobody" not in retrained
    headings = [cell["text"] for cell in Page(page).tables["histories"][0]]
    assert headings == ["ego", "against", *SHARES]


def test_page__links_the_games_that_changed_in_the_reports_of_both_runs(comparison):
    page = comparison.page()
    changes = {(each["change"], each["count"]) for transition in comparison.transitions for each in _listed(transition)}
    assert changes == {("fixed", 12), ("came back", 6)}  # 18 failures become 6, and then 12
    for label in ("one", "two"):
        assert f'<a href="../{label}/report.html#game=naive_vs_speedy,1,17">' in page
    assert '<a href="../three/report.html#game=naive_vs_speedy,1,11">11</a>' in page


def _listed(transition):
    counts = transition.counts
    return [{"change": change, "count": count} for arm in counts.values() for change, count in arm.items() if count]


def test_terminal__has_a_column_for_each_run_and_the_counts_of_changes(comparison):
    written = io.StringIO()
    Console(file=written, width=120).print(history_table(comparison))
    heading, *rows = plain(written.getvalue()).splitlines()
    assert heading.split() == ["ego", "against", "one", "two", "three"]
    places = [rows[2].index(text) for text in ("18 of 60", "6 of 60 ", "12 of 60")]
    assert places == [heading.index(label) for label in SHARES]
    assert [list(change_sentences(each)) for each in comparison.transitions] == [
        ["naive_vs_speedy: 12 fixed"],
        ["naive_vs_speedy: 6 came back"],
    ]


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_page__has_no_violation_and_fits_a_narrow_screen(opened, scheme):
    page = opened(color_scheme=scheme, width=400)
    assert accessibility_violations(page) == []
    assert page.evaluate("document.documentElement.scrollWidth") <= 400
