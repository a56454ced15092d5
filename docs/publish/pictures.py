"""The pictures of the documents: the shipped scenes, as `harness scene show --html` shows them in a browser, and the
first screen of the published report.

    python docs/publish/pictures.py [NAME...]

writes docs/scenes/<scene>.png for the scenes that it names, and docs/report.png for `report`; without a name, all of
them. It needs Chromium and the extra `dev`.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import sync_playwright

ROOT = Path(__file__).parents[2]
SCENES = ("left_across", "priority_crossing", "red_light", "roundabout", "crossing", "zebra", "cyclist")
REPORT = "report"
CHROMIUM = ("chromium", "chromium-browser", "google-chrome")


def main() -> None:
    """Take every picture."""
    browser_file = next((found for name in CHROMIUM if (found := shutil.which(name))), None)
    if browser_file is None:
        sys.exit(f"none of {', '.join(CHROMIUM)} is installed")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_file, args=["--no-sandbox"])
        for name in sys.argv[1:] or (*SCENES, REPORT):
            if name == REPORT:
                page, picture, size = ROOT / "reports/paper_merge/report.html", ROOT / "docs/report.png", (1280, 800)
            else:
                page, picture, size = _drawn(name, Path(folder)), ROOT / f"docs/scenes/{name}.png", (900, 560)
            tab = browser.new_page(viewport={"width": size[0], "height": size[1]})
            tab.goto(page.as_uri())
            tab.screenshot(path=picture)
            tab.close()
        browser.close()


def _drawn(scene: str, folder: Path) -> Path:
    page = folder / f"{scene}.html"
    show = [sys.executable, "-m", "harness.cli.main", "scene", "show", f"networks/{scene}", "--html", str(page)]
    subprocess.run(show, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    return page


if __name__ == "__main__":
    main()
