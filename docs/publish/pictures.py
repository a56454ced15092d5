"""The pictures of the documents: pages in a browser, without a screen.

    python docs/publish/pictures.py [NAME...]

takes those of a shipped scene (drawn by `harness scene show`), of a published report, or of a tutorial after its
steps, whose printed output it writes into the tutorial's page; without a name, all of them. It needs Chromium, Xvfb
and the extra `dev`.
"""

from __future__ import annotations

import argparse
import io
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from desktop import halted_replay
from PIL import Image
from playwright.sync_api import ViewportSize, sync_playwright
from tutorial_steps import carry_out

from harness.replay.gui_settings import WINDOW_PX

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
SCENES = (
    "left_across",
    "priority_crossing",
    "stop_sign",
    "red_light",
    "roundabout",
    "on_ramp",
    "cut_in",
    "cut_out",
    "brake",
    "oncoming_bypass",
    "crossing",
    "zebra",
    "cyclist",
)
CHROMIUM = ("chromium", "chromium-browser", "google-chrome")
COLOURS = 256


class Picture(NamedTuple):
    """What a browser's window shows of a page."""

    file: str
    """Of the picture, below docs/."""
    page: str
    """Where the page is, and after a # the part of it."""
    width: int = 1280
    height: int = 800
    keys: tuple[str, ...] = ()
    """What is pressed on the page before."""


class Desktop(NamedTuple):
    """SUMO-GUI where the replay of a game halts."""

    file: str
    """Of the picture, below docs/."""
    run: str
    """The run, below the folder of the tutorial."""
    arm: str
    episode: int
    width: int = WINDOW_PX[0]
    height: int = WINDOW_PX[1]


PUBLISHED = {
    "report": (Picture("report.png", "reports/paper_merge/report.html"),),
    "reading-a-report": (
        Picture("tutorials/card.png", "reports/paper_merge/report.html#persona-1", 1280, 620),
        Picture("tutorials/player.png", "reports/paper_merge/report.html#game=naive_vs_paper_speedy,11,28", 1280, 760),
    ),
}
"""Pictures of pages in the repository."""
TUTORIALS = {
    "first-campaign": (Picture("tutorials/first-campaign.png", "lab/reports/lab-quick/report.html"),),
    "your-own-ego": (Picture("tutorials/your-own-ego.png", "reports/my_ego/report.html", 1280, 680),),
    "from-a-failure-to-a-regression-test": (
        Picture("tutorials/failure.png", "reports/my_ego/report.html#game=naive_vs_paper_speedy,11,15", 1280, 760),
    ),
    "your-own-person": (
        Picture("tutorials/late_lee.png", "late_lee.html", 1280, 760),
        Picture("tutorials/lee.png", "reports/lee-quick/report.html"),
    ),
    "your-own-junction": (
        Picture("tutorials/conflicts.png", "net.html", 900, 600, keys=("Tab", *"+++++++++")),
        Picture("tutorials/your-own-junction.png", "crossing.html", 900, 600),
    ),
}
"""Pictures of pages that the steps of a tutorial write."""
DESKTOPS = {
    "from-a-failure-to-a-regression-test": (
        Desktop("tutorials/sumo-gui.png", "reports/my_ego", "naive_vs_paper_speedy", 15),
    ),
}
"""Pictures of SUMO-GUI that a tutorial opens."""
CONTINUED = {"from-a-failure-to-a-regression-test": "your-own-ego"}
"""Tutorials that go on in the folder of another."""


def main() -> None:
    """Take every picture."""
    names = [*SCENES, *PUBLISHED, *TUTORIALS]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"one of {', '.join(names)}")
    asked = parser.parse_args().names
    if unknown := [each for each in asked if each not in names]:
        parser.error(f"there are no pictures of {', '.join(unknown)}: choose from {', '.join(names)}")
    browser_file = next((found for name in CHROMIUM if (found := shutil.which(name))), None)
    if browser_file is None:
        sys.exit(f"none of {', '.join(CHROMIUM)} is installed")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_file, args=["--no-sandbox"])
        for name in asked or names:
            for picture, page in pages_of(name, Path(folder)):
                size: ViewportSize = {"width": picture.width, "height": picture.height}
                tab = browser.new_page(viewport=size, reduced_motion="reduce")  # nothing plays by itself
                tab.goto(page)
                tab.wait_for_timeout(500)  # the page opens the game that its address names
                for key in picture.keys:
                    tab.keyboard.press(key)
                write(picture.file, Image.open(io.BytesIO(tab.screenshot())))
                tab.close()
            for desktop in DESKTOPS.get(name, ()):
                place = Path(folder) / CONTINUED.get(name, name)
                write(desktop.file, halted_replay(place, desktop.run, desktop.arm, desktop.episode))
        browser.close()


def pages_of(name: str, folder: Path) -> Iterator[tuple[Picture, str]]:
    """The pictures of a name with the addresses of their pages, which are written into a folder if need be."""
    if name in SCENES:
        pictures: tuple[Picture, ...] = (Picture(f"scenes/{name}.png", f"{name}.html", 900, 560),)
        place = folder
        show = [sys.executable, "-m", "harness.cli.main", "scene", "show", f"networks/{name}"]
        subprocess.run([*show, "--html", folder / f"{name}.html"], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    elif name in PUBLISHED:
        pictures, place = PUBLISHED[name], ROOT
    else:
        first = CONTINUED.get(name, name)
        pictures, place = TUTORIALS[name], folder / first
        if not place.exists():
            place.mkdir()
            carry_out(first, place)
        if name != first:
            carry_out(name, place)
    for picture in pictures:
        file, _, part = picture.page.partition("#")
        yield picture, (place / file).as_uri() + (f"#{part}" if part else "")


def write(file: str, picture: Image.Image) -> None:
    """Write a picture below docs/ with a palette: a page has few colours."""
    few = picture.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
    few.save(DOCS / file, "png", optimize=True)


if __name__ == "__main__":
    main()
