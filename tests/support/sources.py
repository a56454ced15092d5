"""The package's source files, parsed."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

from tests.support.repository import REPOSITORY

PACKAGE = REPOSITORY / "harness"
SOURCES = sorted(PACKAGE.rglob("*.py"))


def label(path: Path) -> str:
    """A file's path from the top level of the repository."""
    return path.relative_to(REPOSITORY).as_posix()


@cache
def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"), str(path))
