"""The report in a real browser: what is on the page before anything is played."""

from __future__ import annotations

import numpy as np
import pytest

from harness.reports.failing_paths import FailingPath
from harness.reports.page import render_page
from harness.reports.run_tables import RunTables
from tests.support.chromium import COLOURS, contrast, unfold
from tests.support.game_tables import findings
from tests.support.pages import campaign, cannot_drive, with_errors
from tests.support.recorded import SCENE


@pytest.fixture(scope="module")
def report(write_report):
    arguments = campaign(quick=True)
    rows = arguments["episodes"]
    arguments = with_errors(arguments, (rows["arm"] == "naive_vs_distracted") & (rows["episode"] == 40))
    return write_report(arguments, game=findings(seeds=(1, 2)))


def test_report__opens_from_a_file_without_an_error_or_a_request(opened):
    page = opened()
    assert page.title() == "merge: report"
    unfold(page)
    assert page.seen == []


def test_report__the_table_and_the_answers_are_on_the_first_screen(opened):
    page = opened()
    questions = ("Does it pass?", "Why does it fail?", "Does retraining help, and what does it cost?", "What now?")
    for found in (page.locator("#failure-table"), *map(page.get_by_text, questions)):
        box = found.first.bounding_box()
        assert box["y"] + box["height"] < 800
    assert page.get_by_text("Quick run").is_visible()
    row = page.locator("#failure-table tr", has=page.get_by_role("rowheader", name="speedy"))
    assert row.get_by_text("18 of 60").is_visible()
    assert row.get_by_role("link", name="30 %").get_attribute("href").startswith("#game=naive_vs_speedy")
    assert page.get_by_text("The speedy driver makes the naive ego fail in 18 of 60 games").is_visible()
    assert page.get_by_role("link", name="Watch it here").first.get_attribute("href").startswith("#game=")


@pytest.mark.parametrize("width", [400, 320, 1280])
def test_report__does_not_scroll_sideways_and_nothing_lies_on_another(opened, width):
    page = opened(width=width)
    unfold(page)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    overlaps = page.evaluate(
        """() => {
          const boxes = [...document.querySelectorAll("#game > details > *, #game .maps figure")]
            .filter(each => each.checkVisibility() && !each.classList.contains("views"))
            .map(each => each.getBoundingClientRect());
          return boxes.flatMap((a, n) => boxes.slice(n + 1).filter(b =>
            a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 1 && b.top < a.bottom - 1)).length;
        }"""
    )
    assert overlaps == 0


@pytest.mark.parametrize("width", [400, 1280])
def test_report__a_person_that_cannot_drive_is_on_the_first_screen(width, opened, write_report):
    page = opened(write_report(cannot_drive(campaign(personas=["speedy"]))), width=width)
    banner = page.locator("#not_learned")
    assert banner.is_visible()
    assert banner.bounding_box()["y"] < 900
    assert contrast(*banner.evaluate(COLOURS)) >= 4.5
    assert page.get_by_text("failures? Not answered: the person can't drive this scene").is_visible()
    banner.get_by_role("link", name="learning curves").click()
    assert page.evaluate("location.hash") == "#learning"
    learning = page.locator("#learning")
    assert learning.get_by_text("did not learn: goal in 0 of 60 games alone").last.is_visible()
    assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_report__the_first_page_on_paper_has_the_worst_games_and_is_one_page_of_a4(opened, tmp_path):
    players = {"ego": np.array([[60.0, -1.6], [90.0, -1.6]]), "non_ego": np.array([[60.0, -4.8], [90.0, -2.6]])}
    paths = [
        FailingPath(
            arm="naive_vs_speedy", persona="speedy", players=players, contact_m=(90.0, -2.0), seed=1, episode=each
        )
        for each in range(4)
    ]
    arguments = campaign(personas=["speedy", "distracted", "texting"])
    html = render_page(RunTables(**arguments), (), SCENE, paths)
    path = tmp_path / "report.html"
    path.write_text(html, encoding="utf-8")
    page = opened(path, width=703)  # pixels: 210 mm without margins of 12 mm
    assert page.locator(".worst").is_hidden()
    page.emulate_media(media="print")
    assert page.locator(".worst svg").count() == 3
    first, header = page.locator("#first").bounding_box(), page.locator("header").bounding_box()
    assert first["y"] + first["height"] - header["y"] < 1032  # pixels: 297 mm without margins


def test_report__no_column_and_no_fold_is_cut_on_paper(opened):
    page = opened(width=700)
    page.emulate_media(media="print")
    unfolded = "[...document.querySelectorAll('details.evidence')].map(each => each.getBoundingClientRect().height)"
    assert min(page.evaluate(unfolded)) > 60  # pixels; a heading alone is lower
    cut = """[...document.querySelectorAll('body *')].filter(each => each.getClientRects().length
        && !each.closest('canvas, svg, .player, option')
        && getComputedStyle(each).overflowX !== 'visible'
        && (each.scrollWidth > each.clientWidth + 1 || each.scrollHeight > each.clientHeight + 1))
        .map(each => each.outerHTML.slice(0, 80))"""
    assert page.evaluate(cut) == []
    assert page.locator(".clip:visible").count() == 0  # a drawing that plays is blank on paper
    assert page.evaluate("document.documentElement.scrollWidth") <= 700
