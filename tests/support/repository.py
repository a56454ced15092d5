"""Where the repository is."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[2]
"""The top level: `harness/`, `networks/`, `personas/` and `campaigns/` are in it."""

SLOW_TESTS = REPOSITORY / "tests" / "slow_tests.txt"
"""One test (`file::function`) or test file on a line; `#` begins a comment."""


def slow_tests() -> set[str]:
    """The lines of SLOW_TESTS without comments."""
    lines = SLOW_TESTS.read_text(encoding="utf-8").splitlines()
    return {line.partition("#")[0].strip() for line in lines} - {""}


PACKAGE = REPOSITORY / "harness"
SOURCES = sorted(PACKAGE.rglob("*.py"))


def label(path: Path) -> str:
    """A file's path from the top level of the repository."""
    return path.relative_to(REPOSITORY).as_posix()


@cache
def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"), str(path))
