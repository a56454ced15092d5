"""The drawings of the shipped scenes, as `harness scene show --html` shows them in a browser.

    python docs/scenes/drawings.py [SCENE...]

writes docs/scenes/<scene>.png for the scenes that it names, or for every scene in `networks/` but the merges. It needs
Chromium and the extra `dev`.
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
CHROMIUM = ("chromium", "chromium-browser", "google-chrome")


def main() -> None:
    """Draw every scene."""
    browser_file = next((found for name in CHROMIUM if (found := shutil.which(name))), None)
    if browser_file is None:
        sys.exit(f"none of {', '.join(CHROMIUM)} is installed")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_file, args=["--no-sandbox"])
        tab = browser.new_page(viewport={"width": 900, "height": 560})
        for scene in sys.argv[1:] or SCENES:
            page = Path(folder) / f"{scene}.html"
            show = [sys.executable, "-m", "harness.cli.main", "scene", "show", f"networks/{scene}", "--html", str(page)]
            subprocess.run(show, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
            tab.goto(page.as_uri())
            tab.screenshot(path=Path(__file__).with_name(f"{scene}.png"))
        browser.close()


if __name__ == "__main__":
    main()
