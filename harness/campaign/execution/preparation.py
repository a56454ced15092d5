"""What a stage waits for before its own work starts: loops that are compiled, nets that are merged.

The code that prepares something logs it to `harness.preparation` (`logging`), at INFO, with `done` and `total` of its
parts in `extra`: it knows no campaign. Here the records become events of the stage that waits.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeAlias

OnPreparation: TypeAlias = Callable[[str, int, int], None]
"""Called with what is prepared, and how many of its parts are done and how many there are; 0 of 0: not known."""

_LOGGER = logging.getLogger("harness.preparation")


class _Forwarder(logging.Handler):
    def __init__(self, on_preparation: OnPreparation) -> None:
        super().__init__(logging.INFO)
        self._on_preparation = on_preparation

    def emit(self, record: logging.LogRecord) -> None:
        self._on_preparation(record.getMessage(), getattr(record, "done", 0), getattr(record, "total", 0))


@contextmanager
def preparations_reported(on_preparation: OnPreparation) -> Iterator[None]:
    """Report what this process prepares during the block."""
    forwarder, level = _Forwarder(on_preparation), _LOGGER.level
    _LOGGER.addHandler(forwarder)
    _LOGGER.setLevel(logging.INFO)
    try:
        yield
    finally:
        _LOGGER.removeHandler(forwarder)
        _LOGGER.setLevel(level)
