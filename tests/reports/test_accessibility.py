"""The pages in a real browser, judged by axe-core: no violation of its rules, in light and in dark."""

from __future__ import annotations

import pytest

from harness.evaluation.tables import table_of
from harness.reports.index_page import IndexedRun, WorstCell, render_index
from harness.reports.learning import learning
from harness.reports.run_tables import RunTables
from harness.reports.running_page import RunningStage, render_running
from tests.support.chromium import accessibility_violations, unfold
from tests.support.game_tables import findings, trait_row
from tests.support.pages import campaign, rendered, starts, with_errors

GAME, OTHER = "naive_vs_speedy,1,6", "retrained_vs_speedy,1,6"


@pytest.fixture(scope="module")
def report(write_report):
    arguments = campaign(games=20, quick=True)
    traits = table_of("attribution", [trait_row("all", 26, 2), trait_row("shoulder_glance", 26, 3, example=4)])
    errored = with_errors(arguments, arguments["episodes"]["episode"] == 14)
    return write_report(errored, game=findings(), attribution=traits, starts=starts(20))


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_report__has_no_violation_with_everything_unfolded(opened, scheme):
    page = opened(color_scheme=scheme, fragment=f"#game={GAME}&t=3&with={OTHER}")
    page.wait_for_selector(".player[data-ready]")
    unfold(page)
    assert accessibility_violations(page) == []


def test_report__has_no_violation_without_recorded_games(opened, tmp_path):
    path = tmp_path / "report.html"
    path.write_text(rendered(**campaign(personas=["speedy"], games=20)), encoding="utf-8")
    assert accessibility_violations(opened(path)) == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_index__of_runs_and_the_page_of_a_running_one_have_no_violation(opened, tmp_path, scheme):
    cell = WorstCell(arm="retrained_speedy_round4_vs_speedy_round3_rejected", failures=3, games=100)
    people = ["careful", "speedy", "late_merger"]
    done = {"ego": "learned", "scene": "priority_crossing", "personas": people, "seeds": [1, 2, 3]}
    done |= {"finished_on": "2026-11-25"}
    runs = [
        IndexedRun(folder=tmp_path / "a", name="a", state="ended", accepted=False, naive=cell, has_page=True, **done),
        IndexedRun(folder=tmp_path / "b", name="b", state="ended", accepted=True, naive=cell, has_page=True, **done),
        IndexedRun(folder=tmp_path / "c", name="c", state="running", running=["naive-seed1"], left_s=90.0),
        IndexedRun(folder=tmp_path / "d", name="d", state="unreadable", problem="it is damaged"),
    ]
    stage = RunningStage(name="naive-seed1", kind="training", since_s=60.0, steps=10, budget=100, left_s=540.0)
    entries = {"naive-seed1": {"kind": "training", "status": "pending", "message": ""}}
    curves = learning(RunTables(**campaign(personas=["speedy"], games=4)))
    pages = {"index": render_index("reports", runs), "running": render_running(runs[2], [stage], entries, curves)}
    for name, text in pages.items():
        path = tmp_path / f"{name}.html"
        path.write_text(text, encoding="utf-8")
        page = opened(path, color_scheme=scheme)
        inside = "each => each.scrollWidth <= each.clientWidth"
        assert all(region.evaluate(inside) for region in page.locator(".scroll:has(#runs)").all())
        assert accessibility_violations(page) == []
