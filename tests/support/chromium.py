"""A real browser for tests of the report: Debian's Chromium, controlled by Playwright.

Without Playwright or Chromium these tests are skipped; with HARNESS_REQUIRE_BROWSER=1 they fail.
"""

from __future__ import annotations

import os
import re
import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

import pytest

CHROMIUM = ("chromium", "chromium-browser", "google-chrome")
ARGUMENTS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
    "--disable-quic",
]


def missing(what: str) -> NoReturn:
    if os.environ.get("HARNESS_REQUIRE_BROWSER") == "1":
        pytest.fail(f"{what}, and HARNESS_REQUIRE_BROWSER=1 requires it")
    pytest.skip(what)


@contextmanager
def launched() -> Iterator[Any]:
    """The browser."""
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        missing("the package playwright is not installed")
    executable = next(filter(None, map(shutil.which, CHROMIUM)), None)
    if executable is None:
        missing("there is no Chromium (on Debian and Ubuntu: apt-get install chromium)")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=executable, args=ARGUMENTS)
        yield browser
        browser.close()


@contextmanager
def opener(browser: Any, report: Path) -> Iterator[Callable[..., Any]]:
    """Open a report in a new window; its list `seen` gets every message, error and request of the page."""
    contexts: list[Any] = []

    def open_page(
        path: Path = report, width: int = 1280, height: int = 900, fragment: str = "", **settings: Any
    ) -> Any:
        context = browser.new_context(viewport={"width": width, "height": height}, **settings)
        contexts.append(context)
        page = context.new_page()
        page.measured = context.new_cdp_session(page)
        page.measured.send("Performance.enable", {"timeDomain": "threadTicks"})
        page.seen = []
        ours = path.as_uri()
        page.on("console", lambda message: page.seen.append(message.text))
        page.on("pageerror", lambda error: page.seen.append(str(error)))
        page.on("dialog", lambda dialog: (page.seen.append(dialog.message), dialog.dismiss()))
        page.on(
            "request",
            lambda request: (
                page.seen.append(request.url)
                if request.url.partition("#")[0] != ours and not request.url.startswith("blob:")
                else None
            ),
        )
        page.goto(ours + fragment)
        return page

    yield open_page
    for context in contexts:
        context.close()


def ready_s(page: Any) -> float:
    """Seconds of processor time of the page's main thread until the games can be played.

    On an idle machine that is the time a reader waits; other programs do not change it, as they do a clock's time.
    """
    page.wait_for_selector(".player[data-ready]", timeout=300_000)
    metrics = page.measured.send("Performance.getMetrics")["metrics"]
    return float(next(each["value"] for each in metrics if each["name"] == "TaskDuration"))


def until(page: Any, expression: str, argument: Any = None, seconds: float = 300.0) -> None:
    """Wait until a JavaScript function is true; Playwright's own waiting violates the page's content policy."""
    end = time.monotonic() + seconds
    while not page.evaluate(expression, argument):
        if time.monotonic() > end:
            pytest.fail(f"not true within {seconds:g} s: {expression}")
        page.wait_for_timeout(20)


def unfold(page: Any) -> None:
    """Open everything that is folded, and wait until the tables have their rows."""
    page.evaluate("for (const each of document.querySelectorAll('details')) each.open = true;")
    until(page, "() => [...document.querySelectorAll('table.data')].every(table => 'ready' in table.dataset)")


COLOURS = """element => {
  const style = getComputedStyle(element), paints = each => !/, 0\\)$/.test(getComputedStyle(each).backgroundColor);
  let ground = element;
  while (ground && !paints(ground)) ground = ground.parentElement;
  return [element instanceof SVGElement ? style.fill : style.color, getComputedStyle(ground).backgroundColor];
}"""
"""The colours of an element's text, and of the first ground behind it that is not transparent."""


def rgb(colour: str) -> list[float]:
    """The parts of a CSS colour without its opacity, 0 to 255."""
    return [float(part) for part in re.findall(r"[\d.]+", colour)[:3]]


def contrast(one: str | Sequence[float], other: str | Sequence[float]) -> float:
    """WCAG's contrast ratio of two colours, of CSS or as their parts."""
    parts = [rgb(each) if isinstance(each, str) else each for each in (one, other)]
    linear = [[p / 3294.6 if p <= 10.01 else ((p / 255 + 0.055) / 1.055) ** 2.4 for p in each] for each in parts]
    dark, bright = sorted(0.2126 * red + 0.7152 * green + 0.0722 * blue for red, green, blue in linear)
    return (bright + 0.05) / (dark + 0.05)


def accessibility_violations(page: Any) -> list[str]:
    """The rules of axe-core that a page violates, each with the first element."""
    try:
        from axe_playwright_python.sync_playwright import Axe
    except ImportError:
        missing("the package axe-playwright-python is not installed")
    violations = Axe().run(page).response["violations"]
    return [f"{each['id']}: {each['help']}: {each['nodes'][0]['html'][:200]}" for each in violations]
