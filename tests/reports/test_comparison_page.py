"""The comparison of runs as a page and on the terminal: the failures over the runs, and the games that changed."""

from __future__ import annotations

import io
import os
import re
from dataclasses import replace

import pytest
from rich.console import Console

from harness.evaluation.comparisons.run_comparison import changed_games, differences_of, failure_rates
from harness.reports import comparison_terminal as terminal
from harness.reports.comparison_page import (
    ComparedRun,
    Comparison,
    Transition,
    compared_rows,
)
from harness.reports.history_figures import histories
from harness.reports.numbers import signed
from tests.support.chromium import accessibility_violations
from tests.support.pages import Page, campaign, plain
from tests.support.repository import REPOSITORY
from tests.support.tiny import harness

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


def test_headline__of_games_with_different_starts_says_that_nothing_is_compared(comparison):
    transition = comparison.transitions[0]
    assert transition.headline.startswith("Worse: ")
    assert "no pairs, no tests" in replace(transition, same_starts=False).headline


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


def lines_of(table, width=80):
    written = io.StringIO()
    Console(file=written, width=width).print(table)
    return [line.rstrip() for line in plain(written.getvalue()).splitlines()]


def test_terminal__has_the_failures_of_each_run_in_columns(comparison):
    heading, ego, nobody, _, speedy, later, last = lines_of(terminal.history_table(comparison, 90), 90)
    assert list(terminal.run_lines(comparison)) == ["1  one", "2  two", "3  three"]
    assert heading.split() == ["ego,", "person", "1", "95", "%", "2", "95", "%", "3", "95", "%"]
    assert (ego, later) == ("naive ego", "retrained ego")
    assert nobody.startswith("  nobody ")
    assert speedy.split("  ")[1] == "speedy"
    counts = ("18 of 60", "6 of 60", "12 of 60")
    ends = [speedy.index(text) + len(text) for text in counts]
    assert ends == [heading.index(f" {run} ") + 2 for run in "123"]  # numbers are aligned at their right ends
    assert "18.8–43.2 %" in speedy
    assert last.startswith("  speedy")
    assert all(len(line) <= 90 for line in lines_of(terminal.history_table(comparison, 90), 90))


def test_terminal__leaves_out_intervals_where_they_have_no_room(comparison):
    lines = lines_of(terminal.history_table(comparison, 80))
    assert all(len(line) <= 80 for line in lines)
    assert len(lines) == 7  # none is broken in two
    assert not any("–43.2" in line for line in lines)


def test_terminal__has_what_became_worse_or_better_by_arm_and_the_games_that_changed(comparison):
    better, worse = comparison.transitions
    heading, arm, failures, *_ = lines_of(terminal.difference_table(better.rows))
    assert heading.split() == ["arm,", "figure", "seed", "before", "after"]
    assert arm == "naive_vs_speedy"
    assert failures.split() == ["failures", "1", "18", "of", "60", "6", "of", "60", "better"]
    assert lines_of(terminal.change_table(better)) == ["arm              fixed", "naive_vs_speedy     12"]
    assert lines_of(terminal.change_table(worse)) == ["arm              came back", "naive_vs_speedy          6"]


@pytest.mark.slow
@pytest.mark.parametrize("runs", [("zebra", "crossing"), ("merge-seeds", "merge-robust", "merge-arms-race")], ids=len)
def test_compare__of_published_runs_fits_80_columns(runs, tmp_path):
    folders = [str(REPOSITORY / "reports" / name) for name in runs]
    done = harness("compare", *folders, "--out", tmp_path / "page.html", env={**os.environ, "COLUMNS": "80"})
    assert done.returncode == 0, done.stderr
    tables = [line for line in done.stdout.splitlines() if str(REPOSITORY) not in line and str(tmp_path) not in line]
    assert [line for line in tables if len(line) > 80] == []
    start = tables.index("Failures")
    rows = tables[start + 1 : tables.index("", start)]
    counts = [[found.end(2) for found in re.finditer(r" (\d+) of (\d+)\b", row)] for row in rows if " of " in row]
    assert len(counts) > 8
    assert {len(each) for each in counts} <= {1, 2, 3}
    ends = {end for each in counts for end in each}
    assert len(ends) == len(runs)  # one below the other
    assert not re.search(r"e-\d\d", done.stdout)


def test_signed__an_error_of_rounding_is_0():
    assert signed(-1e-12, 1) == "0"
    assert signed(-1e-5, 1) == "−1e-05"


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_page__has_no_violation_and_fits_a_narrow_screen(opened, scheme):
    page = opened(color_scheme=scheme, width=400)
    assert accessibility_violations(page) == []
    assert page.evaluate("document.documentElement.scrollWidth") <= 400
