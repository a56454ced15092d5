"""The tests that `make test-fast` leaves out."""

from __future__ import annotations

from tests.support.repository import REPOSITORY

SLOW_TESTS = REPOSITORY / "tests" / "slow_tests.txt"
"""One test (`file::function`) or test file on a line; `#` begins a comment."""


def slow_tests() -> set[str]:
    """The lines of SLOW_TESTS without comments."""
    lines = SLOW_TESTS.read_text(encoding="utf-8").splitlines()
    return {line.partition("#")[0].strip() for line in lines} - {""}
