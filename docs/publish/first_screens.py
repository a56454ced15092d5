"""The first screens of the published runs, as a browser shows them in light and in dark.

    python docs/publish/first_screens.py FOLDER [RUN...]

makes the page of each run in reports/ from its published tables, without recorded games and with blank figures, and
takes FOLDER/RUN-light.png and FOLDER/RUN-dark.png of 1280 by 800 pixels. It names what of a first screen lies below,
and ends with 1 if there is any. It needs Chromium and the extra `dev`.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from argparse import ArgumentParser, RawDescriptionHelpFormatter
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

from matplotlib.figure import Figure
from playwright.sync_api import Page, sync_playwright

from harness.campaign.results.published_run import published_tables
from harness.campaign.storage.run_folder import RunFolder
from harness.reports.page import render_page

ROOT = Path(__file__).parents[2]
REPORTS = ROOT / "reports"
CHROMIUM = ("chromium", "chromium-browser", "google-chrome")
WIDTH, HEIGHT = 1280, 800
PARTS = "#acceptance, #failure-table, #first dl > div:not(.on-paper)"
"""What must be on the first screen: the bounds, the table, and each question with its answer."""
SCHEMES: tuple[Literal["light", "dark"], ...] = ("light", "dark")


def main(folder: Path, runs: list[str]) -> None:
    """Take the pictures. Raises SystemExit with 1 if anything lies below the first screen."""
    folder.mkdir(parents=True, exist_ok=True)
    Figure.savefig = lambda figure, file, **_: file.write('<svg viewBox="0 0 1 1"></svg>')  # type: ignore[method-assign]
    browser_file = next(found for name in CHROMIUM if (found := shutil.which(name)))
    below = []
    with tempfile.TemporaryDirectory() as pages, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_file, args=["--no-sandbox"])
        for run in runs or published():
            file = Path(pages) / f"{run}.html"
            file.write_text(render_page(published_tables(RunFolder(REPORTS / run))), encoding="utf-8")
            for scheme in SCHEMES:
                tab = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT}, color_scheme=scheme)
                tab.goto(file.as_uri())
                below += [f"{run}, {scheme}: {part}" for part in below_the_screen(tab)]
                tab.screenshot(path=folder / f"{run}-{scheme}.png")
                tab.close()
        browser.close()
    print("\n".join(below) or "every table and answer is on the first screen")
    sys.exit(1 if below else 0)


def published() -> list[str]:
    """The names of the published runs."""
    return sorted(file.parent.name for file in REPORTS.glob("*/manifest.json"))


def below_the_screen(page: Page) -> Iterator[str]:
    """The beginning of each part of a report that is not wholly on the first screen, with its lower edge (px)."""
    for part in page.locator(PARTS).all():
        box = part.bounding_box()
        end = HEIGHT + 1 if box is None else box["y"] + box["height"]
        if end > HEIGHT:
            yield f"{' '.join(part.inner_text().split())[:50]} ({end:.0f})"


if __name__ == "__main__":
    parser = ArgumentParser(description=__doc__, formatter_class=RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="where the pictures go")
    parser.add_argument("runs", nargs="*", metavar="RUN", help="the name of a published run; without one: all of them")
    arguments = parser.parse_args()
    if unknown := sorted({*arguments.runs} - {*published()}):
        parser.error(f"not published: {', '.join(unknown)}; there are {', '.join(published())}")
    main(arguments.folder, arguments.runs)
