"""The pages in a real browser, judged by axe-core: no violation of its rules, in light and in dark."""

from __future__ import annotations

import pytest

from tests.support.chromium import accessibility_violations, launched, opener, until
from tests.support.game_tables import findings
from tests.support.pages import campaign, recordings, rendered, with_errors

GAME, OTHER = "naive_vs_speedy,1,6", "retrained_vs_speedy,1,6"


@pytest.fixture(scope="module")
def browser():
    with launched() as browser:
        yield browser


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    arguments = campaign(games=20, quick=True)
    arguments = with_errors(arguments, arguments["episodes"]["episode"] == 14)
    path = tmp_path_factory.mktemp("report") / "report.html"
    path.write_text(rendered(**arguments, **recordings(arguments), game=findings()), encoding="utf-8")
    return path


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_report__has_no_violation_with_everything_unfolded(browser, report, scheme):
    with opener(browser, report) as open_page:
        page = open_page(color_scheme=scheme, fragment=f"#game={GAME}&t=3&with={OTHER}")
        page.wait_for_selector(".player[data-ready]")
        page.evaluate("for (const each of document.querySelectorAll('details')) each.open = true;")
        until(page, "() => [...document.querySelectorAll('table.data')].every(table => 'ready' in table.dataset)")
        assert accessibility_violations(page) == []


def test_report__has_no_violation_without_recorded_games(browser, tmp_path):
    path = tmp_path / "report.html"
    path.write_text(rendered(**campaign(personas=["speedy"], games=20)), encoding="utf-8")
    with opener(browser, path) as open_page:
        page = open_page()
        assert accessibility_violations(page) == []


def test_violations__are_seen(browser, tmp_path):
    path = tmp_path / "page.html"
    path.write_text("<!doctype html><html><title>a</title><body><main><h1>a</h1><button></button></main></body></html>")
    with opener(browser, path) as open_page:
        found = "\n".join(accessibility_violations(open_page()))
    assert "html-has-lang" in found
    assert "button-name" in found
