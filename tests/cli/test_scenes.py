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

from harness.cli.app import app
from harness.errors import UsageError
from tests.support.repository import REPOSITORY
from tests.support.scenes import CROSSING_EDGES, CROSSING_NODES

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


def lanes_in(lines: list[str]) -> list[str]:
    """The rows of the table of lanes, without its head."""
    return lines[1 : lines.index("") if "" in lines else None]


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


def test_scene__an_attribute_that_sumo_ignores_is_a_warning_of_each_command(tmp_path: Path, lines_of: Run) -> None:
    folder = shutil.copytree(MERGE, tmp_path / "merge")
    net, routes = folder / "merge.net.xml", folder / "merge.rou.xml"
    net.write_text(net.read_text().replace("<junction ", '<junction kind="x" '))
    routes.write_text(routes.read_text().replace("<vehicle ", '<vehicle departSpd="3" '))
    about_net = [line for line in lines_of("scene", "show", net) if line.startswith("warning: ")]
    assert [line.split(" (")[0] for line in about_net] == [
        f"warning: {net}: junction finish: SUMO ignores the attribute 'kind', 3 times"
    ]
    slip = "SUMO ignores the attribute 'departSpd', 2 times (did you mean 'departSpeed'?)"
    both = [*about_net, f"warning: {routes}: vehicle ego: {slip}"]
    for command in (("scene", "show"), ("check",)):
        assert [line for line in lines_of(*command, folder) if line.startswith("warning: ")] == both
    new = lines_of("scene", "new", "a", "--from", net, "--list")
    assert [line for line in new if line.startswith("warning: ")] == about_net


def test_show__says_how_many_lanes_are_left_out(generate_net: Callable[..., Path], lines_of: Run) -> None:
    net = generate_net("--grid", "--grid.number", "3")
    lines = lines_of("scene", "show", net, "--rows", "5")
    lanes = [line for line in lanes_in(lines) if not line.startswith(" ")]  # a lane may lead to several edges
    assert len(lanes) == 5
    assert lines[-2].startswith("19 more lanes are not listed")
    assert re.match(r"\d+ more conflicts are not listed", lines[-1])


def test_show__near_an_edge_lists_it_first(generate_net: Callable[..., Path], lines_of: Run) -> None:
    net = generate_net("--grid", "--grid.number", "3", "--grid.length", "200")
    lines = lines_of("scene", "show", net, "--near", "A0A1", "--within", "30")
    names = [line.split()[0] for line in lanes_in(lines)]
    assert names[0] == "A0A1_0"
    assert {"A1A0_0", "A1A2_0", "A1B1_0"} <= set(names)
    assert "C1C2_0" not in names


def test_show__an_edge_that_does_not_exist_is_refused_by_name(lines_of: Run) -> None:
    with pytest.raises(UsageError, match=r"no edge 'aproach'.*did you mean 'approach'"):
        lines_of("scene", "show", MERGE, "--near", "aproach")


def crossing_of_two_roads(build_net: Callable[..., Path], *options: str) -> Path:
    return build_net(CROSSING_NODES, CROSSING_EDGES, "", "--no-turnarounds", *options)


def conflicts_in(lines: list[str]) -> set[tuple[str, ...]]:
    """The rows of the table of conflicts, without their numbers."""
    rows = [re.split(r"  +", line) for line in lines[lines.index("") + 2 :]]
    assert [row[0] for row in rows] == [str(k + 1) for k in range(len(rows))]
    return {tuple(row[1:]) for row in rows}


# Two one-way roads with a lane each: eastward w, c, e with priority; northward s, c, n. Cars may turn from one into the
# other, so where each of them ends another way merges, and eastward and northward cars cross.
@pytest.mark.parametrize("options", [(), ("--lefthand",)])
def test_show__lists_the_conflicts_with_the_side_that_has_priority(
    options: tuple[str, ...], build_net: Callable[..., Path], lines_of: Run
) -> None:
    assert conflicts_in(lines_of("scene", "show", crossing_of_two_roads(build_net, *options))) == {
        ("c", "crossing", "wc_0 to ce_0", "sc_0 to cn_0", "the first"),
        ("c", "merging", "wc_0 to ce_0", "sc_0 to ce_0", "the first"),
        ("c", "merging", "wc_0 to cn_0", "sc_0 to cn_0", "the first"),
    }


@pytest.mark.parametrize(
    ("kind", "priority"), [("traffic_light", "signals, then the first"), ("allway_stop", "first to arrive")]
)
def test_show__conflicts_at_signals_and_stops(
    kind: str, priority: str, build_net: Callable[..., Path], lines_of: Run
) -> None:
    nodes = CROSSING_NODES.replace('y="0" type="priority"/><node id="e"', f'y="0" type="{kind}"/><node id="e"')
    net = build_net(nodes, CROSSING_EDGES, "", "--no-turnarounds")
    crossing = [row for row in conflicts_in(lines_of("scene", "show", net)) if row[1] == "crossing"]
    assert [row[-1] for row in crossing] == [priority]


@pytest.mark.parametrize(("options", "y_m"), [((), -1.6), (("--lefthand",), 1.6)])
def test_show__draws_the_number_of_a_conflict_where_the_lanes_cross(
    options: tuple[str, ...], y_m: float, tmp_path: Path, build_net: Callable[..., Path], lines_of: Run
) -> None:
    page = tmp_path / "crossing.html"
    lines_of("scene", "show", crossing_of_two_roads(build_net, *options), "--html", page)
    text = page.read_text(encoding="utf-8")
    marks = re.findall(
        r'<circle class="conflict" cx="([-.\d]+)" cy="([-.\d]+)".*?<title>conflict (\d+): (.*?)</title>', text
    )
    (crossing,) = [mark for mark in marks if " crosses " in mark[3]]
    # the nodes are in lines x = 100 and y = 100; lanes of 3.2 m are on the right or on the left of them
    assert (float(crossing[0]), -float(crossing[1])) == pytest.approx((100.0 - y_m, 100.0 + y_m), abs=0.2)
    assert crossing[3] == "wc_0 to ce_0 crosses sc_0 to cn_0; priority: the first"
    numbers = re.findall(r'<text class="number" x="([-.\d]+)" y="([-.\d]+)">(\d+)</text>', text)
    assert numbers == [mark[:3] for mark in marks]


def test_show__writes_a_page_with_the_players_of_the_scene(tmp_path: Path, lines_of: Run) -> None:
    page = tmp_path / "merge.html"
    assert str(page) in lines_of("scene", "show", MERGE, "--html", page)[-1]
    text = page.read_text(encoding="utf-8")
    assert "approach_0: 100.0 m, 13.89 m/s, all; from start to taper" in text
    assert "route of ego: approach exit" in text
    assert "goal of non_ego" in text
    assert text.count("start of ego") == 60
    assert not re.search(r"(src|href)=", text)
    assert "<title>merge: net</title>" in text


def test_show__the_page_of_a_scene_opens_on_its_routes(tmp_path: Path, lines_of: Run) -> None:
    page = tmp_path / "merge.html"
    lines_of("scene", "show", MERGE, "--html", page)
    text = page.read_text(encoding="utf-8")
    (left, _, width, _), *_ = (
        [float(each) for each in view.split()] for view in re.findall(r'id="net" viewBox="([^"]+)"', text)
    )
    x_m = {
        kind: [
            float(x)
            for points in re.findall(rf'class="{kind}[^"]*" points="([^"]+)"', text)
            for x in re.findall(r"([-.\d]+),", points)
        ]
        for kind in ("(?:route|goal)", "lane")
    }
    ways, lanes = x_m.values()
    assert (left, left + width) == pytest.approx((min(ways) - 15.0, max(ways) + 15.0))
    assert max(lanes) > left + width, "the road goes on behind the goals"


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
