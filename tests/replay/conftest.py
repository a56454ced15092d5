"""Fixtures of the tests of replays."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.replays import write_merge_net


@pytest.fixture(scope="session")
def merge_net(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The net of `write_merge_net`, with its route file beside it."""
    return write_merge_net(tmp_path_factory.mktemp("net"))
