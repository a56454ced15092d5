"""`harness scene show` and `harness check` on a scene: the lanes of a net, its page, and the check of one scene."""

from __future__ import annotations

import gzip
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from harness.cli.main import app
from harness.errors import UsageError
from tests.support.repository import REPOSITORY

MERGE = REPOSITORY / "tests" / "data" / "merge"
Run = Callable[..., list[str]]


@pytest.fixture
def lines_of(monkeypatch: pytest.MonkeyPatch) -> Run:
    """Runs a command that succeeds, on a wide terminal, and gives its lines. A UsageError is raised."""
    monkeypatch.setenv("COLUMNS", "200")

    def run(*arguments: Any) -> list[str]:
        result = CliRunner().invoke(app, [str(each) for each in arguments])
        if result.exception is not None:
            raise result.exception
        return [line.rstrip() for line in result.output.splitlines()]

    return run


def net_file(folder: Path) -> Path:
    return next(folder.glob("*.net.xml"))


def test_show__lists_the_lanes_of_a_net_and_of_its_scene(lines_of: Run) -> None:
    lines = lines_of("scene", "show", net_file(MERGE))
    assert lines[0].split() == ["lane", "length", "m", "limit", "m/s", "width", "m", "for", "from", "to", "leads", "to"]
    assert lines[1].split() == ["approach_0", "100.0", "13.89", "3.2", "all", "start", "taper"]
    assert [line.split()[0] for line in lines[1:]] == ["approach_0", "approach_1", "exit_0"]
    assert lines_of("scene", "show", MERGE) == lines
    assert lines_of("scene", "show", MERGE / "scene.toml") == lines


def test_show__of_a_compressed_net(tmp_path: Path, lines_of: Run) -> None:
    packed = tmp_path / "merge.net.xml.gz"
    packed.write_bytes(gzip.compress(net_file(MERGE).read_bytes()))
    assert lines_of("scene", "show", packed) == lines_of("scene", "show", net_file(MERGE))


def test_show__says_how_many_lanes_are_left_out(generate_net: Callable[..., Path], lines_of: Run) -> None:
    net = generate_net("--grid", "--grid.number", "3")
    lines = lines_of("scene", "show", net, "--rows", "5")
    lanes = [line for line in lines[1:-1] if not line.startswith(" ")]  # a lane may lead to several edges
    assert len(lanes) == 5
    assert lines[-1].startswith("19 more lanes are not listed")


def test_show__near_an_edge_lists_it_first(generate_net: Callable[..., Path], lines_of: Run) -> None:
    net = generate_net("--grid", "--grid.number", "3", "--grid.length", "200")
    names = [line.split()[0] for line in lines_of("scene", "show", net, "--near", "A0A1", "--within", "30")[1:]]
    assert names[0] == "A0A1_0"
    assert {"A1A0_0", "A1A2_0", "A1B1_0"} <= set(names)
    assert "C1C2_0" not in names


def test_show__an_edge_that_does_not_exist_is_refused_by_name(lines_of: Run) -> None:
    with pytest.raises(UsageError, match=r"no edge 'aproach'.*did you mean 'approach'"):
        lines_of("scene", "show", MERGE, "--near", "aproach")


def test_show__writes_a_page_with_the_players_of_the_scene(tmp_path: Path, lines_of: Run) -> None:
    page = tmp_path / "merge.html"
    assert str(page) in lines_of("scene", "show", MERGE, "--html", page)[-1]
    text = page.read_text(encoding="utf-8")
    assert "approach_0: 100.0 m, 13.89 m/s, all; from start to taper" in text
    assert "route of ego: approach exit" in text
    assert "goal of non_ego" in text
    assert text.count("start of ego") == 60
    assert not re.search(r"(src|href)=", text)


def test_check__of_a_scene_names_its_players(lines_of: Run) -> None:
    lines = lines_of("check", MERGE)
    assert lines == [
        f"{MERGE} is in order.",
        "ego: vehicle ego, 2 edges, goal 45 m along exit",
        "non_ego: vehicle non_ego, 2 edges, goal 45 m along exit",
        "without background traffic",
    ]
    assert lines_of("check", MERGE / "scene.toml") == lines


def test_check__of_a_scene_reports_its_mistakes(tmp_path: Path, lines_of: Run) -> None:
    scene = shutil.copytree(MERGE, tmp_path / "merge")
    document = scene / "scene.toml"
    document.write_text(document.read_text(encoding="utf-8").replace("exit", "exti"), encoding="utf-8")
    with pytest.raises(UsageError, match=r"scene\.toml: goal\.edge: the net has no edge 'exti'.*'exit'"):
        lines_of("check", scene)
