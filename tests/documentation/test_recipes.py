"""The recipes of CONTRIBUTING.md, carried out as they are written there, each on a copy of the project.

A `diff` block changes the file that is named above it, an `sh` block is run, and any other block is a new file.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.support.repository import REPOSITORY
from tests.support.tiny import sumo_run

PAGE = (REPOSITORY / "CONTRIBUTING.md").read_text(encoding="utf-8").partition("\n## Recipes\n")[2].partition("\n## ")[0]
RECIPES = dict(re.findall(r"^### ([^\n]+)\n(.*?)(?=^### |\Z)", PAGE, re.DOTALL | re.MULTILINE))
BLOCK = re.compile(
    r"(?:^`(?P<file>[^`\n]+)`[^\n]*\n\n)?^```(?P<language>\w+)\n(?P<text>.*?)^```", re.DOTALL | re.MULTILINE
)
RUN = "reports/mine"  # stands for a run of the reader's
COPIED = (
    "harness",
    "tests",
    "docs",
    "networks",
    "perception",
    "personas",
    "policies",
    "campaigns",
    "egos",
    "pyproject.toml",
)


class Block(NamedTuple):
    """One fenced block of a recipe. `file` is empty where nothing is named above it."""

    file: str
    language: str
    text: str


def blocks_of(recipe: str) -> list[Block]:
    return [Block(each["file"] or "", each["language"], each["text"]) for each in BLOCK.finditer(recipe)]


def changed(text: str, diff: str) -> str:
    """A file's text after a diff without line numbers. The lines that stay or go are consecutive, in one place only."""
    lines = diff.splitlines(keepends=True)
    before = "".join(line[1:] or line for line in lines if line[0] != "+")
    after = "".join(line[1:] or line for line in lines if line[0] != "-")
    assert text.count(before) == 1, f"these lines are there {text.count(before)} times:\n{before}"
    return text.replace(before, after)


@pytest.mark.slow
@pytest.mark.parametrize("name", RECIPES)
def test_recipe__works_as_it_is_written(name: str, tmp_path: Path) -> None:
    for each in COPIED:
        copy = shutil.copytree if (REPOSITORY / each).is_dir() else shutil.copyfile
        copy(REPOSITORY / each, tmp_path / each)
    (tmp_path / ".venv").symlink_to(sys.prefix)
    if RUN in RECIPES[name]:
        shutil.copytree(sumo_run(), tmp_path / RUN)
    # machine code is of no use to a copy that is thrown away
    environment = os.environ | {"PYTHONPATH": str(tmp_path), "NUMBA_DISABLE_JIT": "1"}
    blocks = blocks_of(RECIPES[name])
    for block in blocks:
        file = tmp_path / block.file
        if block.language == "sh":
            done = subprocess.run(
                ["bash", "-e", "-c", block.text], cwd=tmp_path, env=environment, capture_output=True, text=True
            )
            assert done.returncode == 0, done.stdout + done.stderr
        elif block.language == "diff":
            file.write_text(changed(file.read_text(encoding="utf-8"), block.text), encoding="utf-8")
        else:
            assert block.file, block
            assert not file.exists(), block
            file.parent.mkdir(exist_ok=True)
            file.write_text(block.text, encoding="utf-8")
    assert blocks[-1].language == "sh"
    python = [block.file for block in blocks if block.file.endswith(".py")]
    for command in ("check", "format --check") if python else ():
        ruff = [Path(sys.prefix) / "bin" / "ruff", *command.split(), *python]
        done = subprocess.run(ruff, cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout


def test_page__has_a_recipe_for_each_kind_of_extension() -> None:
    recipes = {"A payoff term", "A metric", "A persona", "A scene", "A figure of the report", "A driver kind"}
    assert set(RECIPES) == recipes


def test_diff__changes_one_place_only() -> None:
    assert changed("a\nb\nc\n", " a\n-b\n+d\n c\n") == "a\nd\nc\n"
    with pytest.raises(AssertionError, match="2 times"):
        changed("a\nb\na\n", " a\n+c\n")
