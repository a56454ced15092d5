"""The tables of the report in a real browser: sorted, filtered, and downloaded as the CSV files that they are."""

from __future__ import annotations

import pytest

from harness.evaluation.tables import write_csv
from tests.support.chromium import unfold, until
from tests.support.pages import campaign, with_errors

SORTED = "([place, way]) => document.querySelectorAll('#episodes thead th')[place].ariaSort === way"
"""Whether the games are sorted by a column. The table sorts after the click has been dispatched."""


@pytest.fixture(scope="module")
def arguments():
    found = campaign(personas=["speedy"])
    rows = found["episodes"]
    found = with_errors(found, (rows["arm"] == "naive_vs_speedy") & (rows["episode"] == 40))
    found["episodes"].loc[found["episodes"]["error"] != "", "error"] = 'it said "no", twice,\nand died'
    return found


@pytest.fixture(scope="module")
def report(arguments, write_report):
    return write_report(arguments)


@pytest.fixture
def page(opened):
    page = opened()
    page.wait_for_selector(".player[data-ready]")
    unfold(page)
    return page


def downloaded(page, name):
    """What the button above a table gives."""
    with page.expect_download() as download:
        page.locator(f".filters:has(+ .holds-table #{name}) button").click()
    assert download.value.suggested_filename == f"{name}.csv"
    return download.value.path().read_bytes()


@pytest.mark.parametrize("name", ["episodes", "summary", "comparisons", "training"])
def test_table__downloads_as_its_csv_file(page, arguments, tmp_path, name):
    page.locator(f"#{name} thead .dt-column-order").nth(2).click()  # sorting does not change what is downloaded
    write_csv(arguments[name], tmp_path / "table.csv")
    assert downloaded(page, name) == (tmp_path / "table.csv").read_bytes()
    assert page.seen == []


def test_table__downloads_the_rows_that_the_filter_shows(page, arguments):
    page.locator("[data-filter=text]").fill("naive_vs_sumo")
    _, *rows = downloaded(page, "episodes").decode().splitlines()
    assert len(rows) == (arguments["episodes"]["arm"] == "naive_vs_sumo").sum()
    assert {row.split(",")[0] for row in rows} == {"naive_vs_sumo"}


def test_table__of_causes_downloads_too(page):
    first, *rows = downloaded(page, "pairs").decode().splitlines()
    assert first.startswith("cause,response,failures,naive_vs_sumo,naive_vs_speedy")
    assert any(row.startswith("cut-in,swerves,") for row in rows)


def column(page, place):
    """The exact texts of a column in all rows that the filter leaves, in the order of the table."""
    return page.evaluate(
        "place => new DataTable.Api('#episodes').rows({order: 'applied', search: 'applied'}).data().toArray()"
        ".map(row => row[place])",
        place,
    )


def test_table__sorts_numbers_by_size_with_what_is_empty_last(page, arguments):
    place = list(arguments["episodes"].columns).index("ego_min_ttc_s")
    for way in ("ascending", "descending"):
        page.locator("#episodes thead th").nth(place).locator(".dt-column-order").click()
        until(page, SORTED, [place, way])
        values = [float(value) for value in column(page, place) if value]
        assert values == sorted(values, reverse=way == "descending")
        assert column(page, place)[-1] == ""


def test_table__filters_by_arm_outcome_and_text(page, arguments):
    episodes = arguments["episodes"]
    page.locator("[data-filter=arm]").select_option(label="naive_vs_speedy")
    page.locator("[data-filter=ego_outcome]").select_option(label="collision")
    expected = episodes[(episodes["arm"] == "naive_vs_speedy") & (episodes["ego_outcome"] == "collision")]
    assert column(page, 3) == [str(episode) for episode in expected["episode"]]
    assert (
        page.locator(".filters:has(+ .holds-table #episodes) output").inner_text()
        == f"{len(expected)} of {len(episodes)} games"
    )
    page.locator("[data-filter=ego_outcome]").select_option(label="all")
    page.locator("[data-filter=text]").fill("twice died")
    assert column(page, 3) == ["40"]


def test_table__a_row_opens_its_game_if_it_was_played(page):
    page.locator("[data-filter=arm]").select_option(label="naive_vs_speedy")
    page.locator("#episodes tbody a").nth(3).click()
    until(page, "() => document.querySelector('.player').dataset.game === 'naive_vs_speedy,1,3'")
    page.locator("[data-filter=text]").fill("twice died")
    assert page.locator("#episodes tbody tr").count() == 1
    assert page.locator("#episodes tbody a").count() == 0
