"""The example in the docstring of each public name, run in a folder with what the examples name."""

from __future__ import annotations

import doctest
import shutil
from pathlib import Path

import pytest

import harness
from tests.support.repository import REPOSITORY
from tests.support.shipped import TWO_GAMES

IN_ANOTHER = {"Outcome": "DrivingEnv", "Persona": "read_document", "Step": "ArenaVecEnv"}
"""Names whose use the example of another name shows."""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder: a campaign of two games, a finished run, and documents under their paths."""
    (tmp_path / "two_games.toml").write_text(TWO_GAMES, encoding="utf-8")
    for name in ("personas", "policies", "reports/merge"):
        shutil.copytree(REPOSITORY / name, tmp_path / name)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def examples_of(name: str) -> list[doctest.DocTest]:
    return [each for each in doctest.DocTestFinder().find(getattr(harness, name), name) if each.examples]


@pytest.mark.parametrize("name", sorted(set(harness.__all__) - set(IN_ANOTHER)))
def test_docstring__its_example_gives_what_it_says(name: str, folder: Path) -> None:
    assert examples_of(name), f"harness.{name} has no example"
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE)
    printed: list[str] = []
    for example in examples_of(name):
        runner.run(example, out=printed.append)
    assert not runner.failures, "".join(printed)


@pytest.mark.parametrize(("name", "other"), IN_ANOTHER.items())
def test_docstring__the_example_of_another_name_shows_it(name: str, other: str) -> None:
    sources = "".join(each.source for test in examples_of(other) for each in test.examples)
    assert getattr(harness, name).__doc__
    assert name in sources or f"{name.lower()}(" in sources
