"""Published runs have pages: the one that is published with a run, or one from its tables."""

from __future__ import annotations

import csv
import os
import shutil
import urllib.error
from pathlib import Path

import pytest

from harness.campaign.results.published_run import PublishedReport, published_tables
from harness.campaign.results.run_index import indexed_run
from harness.campaign.results.served_runs import ServedRuns, served
from harness.campaign.storage.run_folder import RunFolder
from harness.errors import UsageError
from harness.evaluation.tables import read_csv
from harness.reports.page import GAMES_BYTES
from tests.support.chromium import launched
from tests.support.pages import Page, blank_figures
from tests.support.repository import REPOSITORY
from tests.support.serving import read, serving

REPORTS = REPOSITORY / "reports"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a run of which two tables are packed and no page is published, and one that has its page."""
    for name in ("cyclist", "merge"):
        shutil.copytree(REPORTS / name, tmp_path / name)
    assert not (tmp_path / "cyclist" / "report.html").exists()
    assert (tmp_path / "cyclist" / "episodes.csv.gz").is_file()
    return tmp_path


@pytest.mark.slow
def test_serve__a_run_that_is_published_as_tables_has_a_page_in_the_browser(folder: Path) -> None:
    before = sorted(folder.rglob("*"))
    with serving(ServedRuns(folder).answer) as server, launched() as browser:
        tab, wrong = browser.new_page(), list[str]()
        tab.on("pageerror", lambda error: wrong.append(str(error)))
        tab.goto(f"http://127.0.0.1:{server.server_port}/")
        tab.get_by_role("link", name="cyclist", exact=True).click()
        tab.wait_for_selector("#failure-table")
        assert tab.locator("#failure-table th", has_text="e_scooter").count() == 1
        assert "harness campaign cyclist.toml plays them again" in tab.locator("#from-tables").inner_text()
        assert tab.locator("#starts svg a, #figures svg").count() > 4
        tab.evaluate("document.querySelectorAll('details').forEach(each => { each.open = true; })")
        games = read_csv(folder / "cyclist" / "episodes.csv")
        tab.locator("#tables .dt-info", has_text=f"of {len(games):,}").wait_for()
        assert wrong == []
        with pytest.raises(urllib.error.HTTPError, match="404"):
            read(f"http://127.0.0.1:{server.server_port}/cyclist/games/naive_alone,21,0.json")
    assert sorted(folder.rglob("*")) == before  # the page is in memory


def test_serve__the_page_that_is_published_with_a_run_is_sent_as_it_is(folder: Path) -> None:
    answer = served(folder / "merge").answer("/")
    assert answer is not None
    assert answer[1] == (REPORTS / "merge" / "report.html").read_bytes()
    assert served(folder / "merge").answer("/manifest.json") is None


def test_serve__the_page_of_one_published_run_is_made_from_its_tables(folder: Path) -> None:
    with blank_figures():
        answer = served(folder / "cyclist").answer("/")
    assert answer is not None
    page = Page(answer[1].decode())
    assert page.cells("summary")[1:] == _cells(folder / "cyclist" / "summary.csv")
    assert "What led to failures" in page.text  # from causes.csv: manoeuvres.csv is not published


def _cells(table: Path) -> list[list[str]]:
    with table.open(encoding="utf-8", newline="") as file:
        return list(csv.reader(file))[1:]


def test_index__every_published_run_has_a_page() -> None:
    runs = [indexed_run(file.parent) for file in REPORTS.glob("*/manifest.json")]
    assert len(runs) > 10
    assert all(run.has_page for run in runs)


def test_page__a_damaged_table_is_named(folder: Path) -> None:
    (folder / "cyclist" / "episodes.csv.gz").write_bytes(b"x")
    with pytest.raises(UsageError, match=r"episodes\.csv: (is not a table|can't be read)"):
        PublishedReport(RunFolder(folder / "cyclist"))


def test_page__a_link_to_elsewhere_is_not_sent(folder: Path, tmp_path: Path) -> None:
    (folder / "merge" / "report.html").unlink()
    (tmp_path / "other.html").write_text("secret")
    os.symlink(tmp_path / "other.html", folder / "merge" / "report.html")
    with pytest.raises(UsageError, match="is a link that leads out"):
        PublishedReport(RunFolder(folder / "merge"))


@pytest.mark.slow
def test_page__of_a_run_of_three_seeds_has_at_most_3_mb() -> None:
    """The published run of three seeds with the most arms. Its page in the run folder has recorded games and figures of
    paths more."""
    paths_bytes = 250_000
    tables = published_tables(RunFolder(REPORTS / "crossing"))
    assert len(tables.seeds) == 3
    assert len(tables.starts)
    report = PublishedReport(RunFolder(REPORTS / "crossing")).answer("/")
    assert report is not None
    assert len(report[1]) + GAMES_BYTES + paths_bytes < 3_000_000
