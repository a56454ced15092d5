"""What the tests of pages share: a browser, and reports to open in it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.support.chromium import launched, opener
from tests.support.pages import recordings, rendered


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with launched() as browser:
        yield browser


@pytest.fixture(scope="module")
def write_report(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Writes the report of a made-up campaign with recorded games."""

    def write(arguments: dict[str, Any], **more: Any) -> Path:
        path = tmp_path_factory.mktemp("report") / "report.html"
        path.write_text(rendered(**{**arguments, **recordings(arguments), **more}), encoding="utf-8")
        return path

    return write


@pytest.fixture
def opened(browser: Any, report: Path) -> Iterator[Callable[..., Any]]:
    """Opens the report of the module, the fixture `report`."""
    with opener(browser, report) as open_page:
        yield open_page
