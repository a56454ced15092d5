"""The log of a run: `harness.log` in its folder, a line for each thing that happened, in UTC. Commands append to it.

What is logged goes to the logger `harness.run` of `logging`, which a program that calls the library can read as well.
"""

from __future__ import annotations

import logging
import platform
import threading
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from harness.errors import HarnessError, UsageError, plain
from harness.version import __version__

LOG = "harness.log"
LOGGER = logging.getLogger("harness.run")
LOGGER.setLevel(logging.INFO)
_LINE = "%(asctime)s %(levelname)-7s %(message)s"
_TIME = "%Y-%m-%dT%H:%M:%SZ"


class RunLogFormatter(logging.Formatter):
    """Time, level and message. Further lines of a message are indented, and unprintable characters are escaped."""

    converter = staticmethod(time.gmtime)

    def __init__(self) -> None:
        super().__init__(_LINE, _TIME)

    def format(self, record: logging.LogRecord) -> str:
        return "\n    ".join(plain(line) for line in super().format(record).splitlines())


class _LogFile(logging.FileHandler):
    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802 - named by logging
        """A full disk ends the log. The command reports it where it writes its own files."""


@contextmanager
def logged_to(handler: logging.Handler, logger: logging.Logger, level: int) -> Iterator[None]:
    """Give a handler what is logged during the block, at this level and above."""
    before = logger.level
    logger.addHandler(handler)
    logger.setLevel(level)
    try:
        yield
    finally:
        logger.removeHandler(handler)
        logger.setLevel(before)


@contextmanager
def run_log(folder: Path) -> Iterator[None]:
    """Append what this thread logs during the block to the log of a run folder, and how the block ended.

    Raises UsageError if the name is taken by something that is no file.
    """
    file = folder / LOG
    if file.is_symlink() or (file.exists() and not file.is_file()):
        raise UsageError.of(file, "", "is not a file", "remove it: the log of the run has this name")
    handler, thread, started = _LogFile(file, encoding="utf-8"), threading.get_ident(), time.monotonic()
    handler.setFormatter(RunLogFormatter())
    handler.addFilter(lambda record: record.thread == thread)
    with closing(handler), logged_to(handler, LOGGER, LOGGER.level):
        LOGGER.info("harness %s on Python %s, %s", __version__, platform.python_version(), platform.platform())
        try:
            yield
        except BaseException as error:
            is_a_bug = isinstance(error, Exception) and not isinstance(error, HarnessError | OSError)
            LOGGER.error("ended by %s: %s", type(error).__name__, error, exc_info=is_a_bug)
            raise
        LOGGER.info("ended after %.0f s", time.monotonic() - started)
