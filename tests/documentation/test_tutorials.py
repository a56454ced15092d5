"""The documents in the tutorials are valid, and the commands exist with the options that they are given."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import pytest
import typer
from jsonschema import Draft202012Validator

from harness.cli.app import app
from harness.config.toml_reading import tomllib
from tests.support.repository import REPOSITORY

TUTORIALS = sorted((REPOSITORY / "docs" / "tutorials").glob("*.md"))
each_tutorial = pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)


def blocks(page: Path, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)


@each_tutorial
def test_tutorial__its_documents_are_valid(page: Path) -> None:
    for block in blocks(page, "toml"):
        document = tomllib.loads(block)
        kind = "driver" if "kind" in document else "scene" if "net" in document else "campaign"
        schema = json.loads((REPOSITORY / "docs" / "schemas" / f"{kind}.schema.json").read_text(encoding="utf-8"))
        assert [error.message for error in Draft202012Validator(schema).iter_errors(document)] == []


@each_tutorial
def test_tutorial__its_commands_exist(page: Path) -> None:
    for line in "".join(blocks(page, "sh")).replace("\\\n", "").splitlines():
        words = shlex.split(line, comments=True)
        if words[:1] != ["harness"]:
            continue
        command, words = typer.main.get_command(app), words[1:]
        while words and words[0] in getattr(command, "commands", {}):
            command, words = command.commands[words[0]], words[1:]
        assert not getattr(command, "commands", {}), line
        known = {name for each in command.params for name in each.opts}
        assert {word for word in words if word.startswith("-")} <= known, line
