"""The first screen of each published run, in a browser of 1280 by 800 pixels."""

from __future__ import annotations

from pathlib import Path

import pytest

from harness.campaign.results.published_run import published_tables
from harness.campaign.storage.run_folder import RunFolder
from harness.reports.page import render_page
from tests.support.chromium import launched
from tests.support.pages import blank_figures
from tests.support.scripts import script

first_screens = script("publish/first_screens.py")


def below(tmp_path: Path, run: str) -> list[str]:
    page = tmp_path / f"{run}.html"
    with blank_figures():
        tables = published_tables(RunFolder(first_screens.REPORTS / run))
        page.write_text(render_page(tables), encoding="utf-8")
    with launched() as browser:
        tab = browser.new_page(viewport={"width": first_screens.WIDTH, "height": first_screens.HEIGHT})
        tab.goto(page.as_uri())
        assert tab.locator(first_screens.PARTS).count() > (3 if tables.personas else 0)
        return list(first_screens.below_the_screen(tab))


def test_first_screen__of_the_run_with_most_people_and_bounds_has_every_answer(tmp_path: Path) -> None:
    assert below(tmp_path, "merge-robust") == []


@pytest.mark.slow
@pytest.mark.parametrize("run", [each for each in first_screens.published() if each != "merge-robust"])
def test_first_screen__of_a_published_run_has_every_answer(tmp_path: Path, run: str) -> None:
    assert below(tmp_path, run) == []
