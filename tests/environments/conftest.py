"""Fixtures of the tests of environments."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import libsumo
import pytest

Open = Callable[..., Any]


@pytest.fixture
def opened() -> Iterator[Open]:
    """Makes environments, and closes them."""
    environments = []

    def opened(make: Open, *arguments: Any, **named: Any) -> Any:
        environments.append(make(*arguments, **named))
        return environments[-1]

    yield opened
    for each in environments:
        each.close()
    assert not libsumo.isLoaded()
