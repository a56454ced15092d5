"""Fixtures that more than one test file uses."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def repository() -> Path:
    """The top level of the repository: networks/, personas/ and campaigns/ lie in it."""
    return Path(__file__).resolve().parent.parent
