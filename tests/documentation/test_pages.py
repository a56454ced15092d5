"""The pages of the documentation: every file and test that they name exists."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from tests.support.repository import REPOSITORY

PAGES = sorted(
    [*REPOSITORY.glob("*.md"), *(REPOSITORY / "docs").rglob("*.md"), *(REPOSITORY / ".github").rglob("*.md")]
)
NAMED_FILE = re.compile(r"\b(?:tests|harness|benchmarks)/[\w/.-]*\w+\.(?:py|toml|json|jinja)\b")
NAMED_TEST = re.compile(r"\b(tests/[\w/]+\.py)::(test_\w+)")
HISTORY = {"CHANGELOG.md"}  # it names files as they were called at the time
each_page = pytest.mark.parametrize(
    "page",
    [page for page in PAGES if page.name not in HISTORY],
    ids=lambda page: page.relative_to(REPOSITORY).as_posix(),
)


def named_files(text: str) -> set[str]:
    """The paths of the repository's Python code, tests and benchmarks in a text."""
    return set(NAMED_FILE.findall(text))


def named_tests(text: str) -> set[tuple[str, str]]:
    """Files and functions of the tests in a text that are named as `file::function`."""
    return set(NAMED_TEST.findall(text))


def functions_in(path: Path) -> set[str]:
    """The names of the test functions of a file."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}


@each_page
def test_page__every_named_file_exists(page: Path) -> None:
    named = named_files(page.read_text(encoding="utf-8"))
    assert [name for name in sorted(named) if not (REPOSITORY / name).is_file()] == []


@each_page
def test_page__every_named_test_exists(page: Path) -> None:
    named = named_tests(page.read_text(encoding="utf-8"))
    missing = [
        f"{file}::{test}"
        for file, test in sorted(named)
        if not (REPOSITORY / file).is_file() or test not in functions_in(REPOSITORY / file)
    ]
    assert missing == []


def test_page__names_are_found_in_text() -> None:
    text = "`tests/game/test_payoff.py::test_terms` and (harness/game/payoff.py), `benchmarks/results.json`."
    assert named_files(text) == {"tests/game/test_payoff.py", "harness/game/payoff.py", "benchmarks/results.json"}
    assert named_tests(text) == {("tests/game/test_payoff.py", "test_terms")}
