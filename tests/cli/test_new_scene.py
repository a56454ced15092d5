"""`harness scene new`: from a map to scenes and campaigns that are in order, or one line and nothing written."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sumo
from typer.testing import CliRunner

from harness.campaign.preflight import open_campaign
from harness.cli.app import app
from harness.cli.scene_writing import write_scenes
from harness.errors import UsageError
from harness.game.initial_state import draw_initial_state
from harness.maps.candidates import CandidateKind
from harness.maps.game_plans import GamePlan
from harness.maps.open_map import OpenMap, open_map
from harness.road.scene.open_scene import OpenScene, open_scene
from tests.support.esmini import require_esmini
from tests.support.repository import REPOSITORY

MAPS = REPOSITORY / "tests" / "data" / "maps"
TOWN, JUNCTION = MAPS / "town.osm", MAPS / "t_junction.xodr"
REAL_TOWN = Path(sumo.SUMO_HOME) / "tools" / "game" / "DRT" / "osm.net.xml"  # Berlin-Adlershof, of OpenStreetMap
Run = Callable[..., list[str]]


@pytest.fixture
def new(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Runs `harness scene new` in an empty folder `out` on a wide terminal, and gives its lines."""
    monkeypatch.setenv("COLUMNS", "200")
    (tmp_path / "out").mkdir()

    def run(*arguments: Any) -> list[str]:
        given = ["scene", "new", *map(str, arguments), "--out", str(tmp_path / "out")]
        result = CliRunner().invoke(app, given)
        if result.exception is not None:
            raise result.exception
        return result.output.splitlines()

    return run


@pytest.fixture(scope="module")
def town(tmp_path_factory: pytest.TempPathFactory) -> OpenMap:
    return open_map(TOWN, tmp_path_factory.mktemp("town"), left_hand=False)


def files_in(folder: Path) -> list[str]:
    return sorted(str(each.relative_to(folder)) for each in folder.rglob("*") if each.is_file())


def numbers_of(lines: list[str], kind: str) -> list[int]:
    """The numbers of the conflicts of a kind in the table."""
    return [int(found[1]) for line in lines if (found := re.match(rf"(\d+) +\d+ +{kind} ", line))]


def arrivals_apart_s(scene: OpenScene, games: int) -> list[float]:
    """Seconds from the ego's arrival to the person's at the place where they meet, if both keep their speeds."""
    routes = scene.world.road.routes
    apart = []
    for k in range(games):
        state = draw_initial_state(scene.usual_starts, "meet", k)
        lines = [
            np.stack((routes.x_m, routes.y_m), axis=1)[routes.first_row[p] : routes.last_row[p] + 1] for p in (0, 1)
        ]
        starts = [int(np.argmin(np.hypot(*(lines[p] - np.array([state.x_m[p], state.y_m[p]])).T))) for p in (0, 1)]
        ahead = [lines[p][starts[p] : starts[p] + 400] for p in (0, 1)]
        gaps = np.hypot(*(ahead[0][:, None] - ahead[1][None]).transpose(2, 0, 1))
        first = int(np.flatnonzero(gaps.min(axis=1) < 1.6)[0])
        times = [0.5 * first / state.speed_mps[0], 0.5 * int(gaps[first].argmin()) / state.speed_mps[1]]
        apart.append(times[1] - times[0])
    return apart


def test_new__from_openstreetmap_to_a_campaign_that_is_in_order(tmp_path: Path, new: Run) -> None:
    lines = new("town", "--from", TOWN)
    out = tmp_path / "out"
    names = ["scene.toml", "town.net.xml", "town.rou.xml"]
    assert files_in(out) == ["campaigns/town.toml", *(f"networks/town/{name}" for name in names)]
    assert lines[-1] == f"Next: harness campaign {out / 'campaigns' / 'town.toml'} --quick"
    campaign = open_campaign(out / "campaigns" / "town.toml")
    assert campaign.scene.folder == out / "networks" / "town"
    assert [persona.name for persona in campaign.personas] == ["impatient"]


def test_new__from_opendrive_the_players_meet(tmp_path: Path, new: Run) -> None:
    lines = new("t", "--from", JUNCTION)
    assert numbers_of(lines, "turn across") == [1]
    scene = open_scene(tmp_path / "out" / "networks" / "t")
    apart = arrivals_apart_s(scene, games=40)
    assert max(map(abs, apart)) < 1.5 + 0.5  # the place is a zone of some metres
    assert min(apart) < -0.5 < 0.5 < max(apart)


def test_write__scenes_of_other_kinds_are_in_order(town: OpenMap, tmp_path: Path) -> None:
    kinds = {"turn": CandidateKind.MERGE, "ramp": CandidateKind.LANE_END}
    chosen = {name: next(plan for plan in town.plans if plan.candidate.kind is kind) for name, kind in kinds.items()}
    assert write_scenes(town, {name: [plan] for name, plan in chosen.items()}, tmp_path) == (chosen, [])
    scenes = {name: open_scene(tmp_path / "networks" / name) for name in kinds}
    assert [scene.document.players[1].on_foot for scene in scenes.values()] == [False, False]


def test_write__the_time_limit_names_the_red_that_it_waits_for(town: OpenMap, tmp_path: Path) -> None:
    lit = next(plan for plan in town.plans if plan.candidate.with_signals)
    assert lit.longest_red_s(town.reds_s) == 23.0
    assert lit.longest_red_s({}) == 0.0
    write_scenes(town, {"lit": [lit]}, tmp_path)
    limit = f"time_limit_s = {lit.time_limit_s(town.reds_s)}"
    line = f"{limit}    # a traffic light on the way is red for up to 23 s\n"
    assert line in (tmp_path / "networks" / "lit" / "scene.toml").read_text(encoding="utf-8")


def test_write__a_zebra_crossing_of_a_map_the_ego_must_yield(town: OpenMap, tmp_path: Path) -> None:
    zebra = next(plan for plan in town.plans if plan.candidate.kind is CandidateKind.ZEBRA)
    assert write_scenes(town, {"zebra": [zebra]}, tmp_path) == ({"zebra": zebra}, [])
    scene = open_scene(tmp_path / "networks" / "zebra")
    table = scene.world.right_of_way.conflicts
    assert table.yields[table.player == 0].any()
    assert not table.yields[table.player == 1].any()
    assert len(scene.stripes) > 3


def test_new__of_no_number_makes_the_first_that_is_listed(tmp_path: Path, new: Run) -> None:
    lines = new("t", "--from", TOWN, "--kind", "turn across")
    first = numbers_of(lines, "turn across")[0]
    assert f"conflict {first}" in (tmp_path / "out" / "networks" / "t" / "scene.toml").read_text(encoding="utf-8")


def test_write__of_several_plans_the_first_that_is_in_order(town: OpenMap, tmp_path: Path) -> None:
    good = town.plans[0]
    bad = replace(good, number=7, ego=replace(good.ego, range=(1e4, 1e4 + 1.0)))
    written, problems = write_scenes(town, {"t": [bad, good]}, tmp_path)
    assert written == {"t": good}
    assert {problem.file for problem in problems} == {"conflict 7"}


def ring_of(opened: OpenMap) -> GamePlan:
    """The first conflict at a roundabout."""
    return next(plan for plan in opened.plans if plan.candidate.kind is CandidateKind.ROUNDABOUT)


def test_write__a_roundabout_of_openstreetmap_can_be_driven(town: OpenMap, tmp_path: Path) -> None:
    assert write_scenes(town, {"ring": [ring_of(town)]}, tmp_path) == ({"ring": ring_of(town)}, [])


# the corner from an arm into the drawn ring has a radius of 4 m: a car needs more than a lane of the usual width there
def test_write__a_route_that_can_not_be_driven_makes_no_scene(tmp_path: Path) -> None:
    narrow = tmp_path / "narrow.osm"
    ring = '<tag k="junction" v="roundabout"/>'
    narrow.write_text(TOWN.read_text(encoding="utf-8").replace(ring, f'{ring}<tag k="width" v="3.2"/>'))
    opened = open_map(narrow, tmp_path, left_hand=False)
    with pytest.raises(UsageError, match="ego: alone, a rule-based driver reaches the goal from 0 of 50 starts"):
        write_scenes(opened, {"ring": [ring_of(opened)]}, tmp_path)
    assert not (tmp_path / "networks").exists()


@pytest.mark.skipif(not REAL_TOWN.is_file(), reason="SUMO's wheel does not ship this net")
def test_new__from_the_net_of_a_real_town(tmp_path: Path, new: Run) -> None:
    lines = new("adlershof", "--from", REAL_TOWN, "--kind", "turn across")
    assert len(numbers_of(lines, "turn across")) == 40  # as many as are listed unless more are asked for
    campaign = open_campaign(tmp_path / "out" / "campaigns" / "adlershof.toml")
    assert campaign.scene.net_file.stat().st_size < REAL_TOWN.stat().st_size / 2  # the part near the players' routes


@pytest.mark.esmini
@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("straight_500m", "following"),
        ("fabriksgatan", "crossing"),
        ("e6mini", "following"),
        ("multi_intersections", "turn across"),
    ],
)
def test_new__from_the_maps_that_esmini_ships(tmp_path: Path, new: Run, name: str, kind: str) -> None:
    map_file = require_esmini().parent.parent / "resources" / "xodr" / f"{name}.xodr"
    assert numbers_of(new(name, "--from", map_file), kind)
    open_campaign(tmp_path / "out" / "campaigns" / f"{name}.toml")


def test_new__of_all_makes_a_scene_of_each_that_is_listed(tmp_path: Path, new: Run) -> None:
    lines = new("t", "--from", JUNCTION, "--all", "--kind", "merge")
    numbers = numbers_of(lines, "merge")
    assert len(numbers) == 3
    folders = sorted(each.name for each in (tmp_path / "out" / "networks").iterdir())
    assert folders == [f"t_{number}" for number in numbers]


def test_new__a_scene_keeps_the_traffic_of_the_map(tmp_path: Path, new: Run) -> None:
    routes = tmp_path / "own.rou.xml"
    routes.write_text('<routes><flow id="cars" begin="3600.5" period="4" from="-1" to="-2"/></routes>')
    options = ("--from", JUNCTION, "--routes", routes)
    new("t", *options)
    new("whole", *options, "--whole-net")
    scenes = {name: open_scene(tmp_path / "out" / "networks" / name) for name in ("t", "whole")}
    for scene in scenes.values():
        assert scene.document.game_window_s[0] == 3600.0 + scene.document.warm_up_s
        assert len(scene.departures(1)) > 5
    routes.write_text('<routes><trip id="x" depart="0" from="no" to="-1"/></routes>')
    with pytest.raises(UsageError, match=r"own\.rou\.xml: x: the net has no edge 'no' \(name the route file"):
        new("bad", *options)


def test_new__a_list_writes_nothing_but_the_page(tmp_path: Path, new: Run) -> None:
    page = tmp_path / "map.html"
    new("t", "--from", JUNCTION, "--list", "--html", page)
    assert files_in(tmp_path / "out") == []
    text = page.read_text(encoding="utf-8")
    assert re.findall(r'<text class="number"[^>]*>(\d+)</text>', text) == ["1", "2", "3", "4", "5", "6"]
    assert "conflict 1: turn across" in text


def test_near__an_edge_the_conflicts_keep_their_numbers(town: OpenMap) -> None:
    ring = town.near("104#0", 1.0)
    assert {plan.candidate.kind for plan in ring} == {CandidateKind.ROUNDABOUT}
    assert ring == [town.plans[plan.number - 1] for plan in ring]


BAD = {
    "a number that does not exist": (["t", "--conflict", 99], r"--conflict: 99: there is no conflict.*1 to 6"),
    "the number 0": (["t", "--conflict", 0], r"there is no conflict of this number"),
    "a kind that does not exist": (["t", "--kind", "zebra"], r"is no kind of conflict of this map.*turn across"),
    "an edge that does not exist": (["t", "--near", "-11"], r"no edge '-11'.*did you mean '-1'"),
    "a name with markup": (["<b>[red]t"], r"can't be the name of a scene"),
    "a name that leads elsewhere": (["../t"], r"can't be the name of a scene"),
    "one and all": (["t", "--conflict", 1, "--all"], r"exclude each other"),
}


@pytest.mark.parametrize("arguments", BAD.values(), ids=BAD)
def test_new__what_is_wrong_is_one_line_and_writes_nothing(
    arguments: tuple[list[Any], str], tmp_path: Path, new: Run
) -> None:
    given, message = arguments
    with pytest.raises(UsageError, match=message) as error:
        new(*given, "--from", JUNCTION)
    assert len(str(error.value).splitlines()) == 1
    assert list((tmp_path / "out").iterdir()) == []


def test_new__nothing_that_is_there_is_touched(tmp_path: Path, new: Run) -> None:
    campaign = tmp_path / "out" / "campaigns" / "t.toml"
    campaign.parent.mkdir()
    campaign.write_text("mine")
    with pytest.raises(UsageError, match="is there already, and nothing is overwritten"):
        new("t", "--from", JUNCTION)
    assert files_in(tmp_path / "out") == ["campaigns/t.toml"]
    assert campaign.read_text() == "mine"


def test_new__names_on_a_map_can_be_anything(tmp_path: Path, new: Run) -> None:
    text = TOWN.read_text(encoding="utf-8").replace("Bahnhofstraße", "&lt;script&gt;[red]&quot;\\")
    (tmp_path / "odd [b].osm").write_text(text, encoding="utf-8")
    page = tmp_path / "map.html"
    lines = new("t", "--from", tmp_path / "odd [b].osm", "--html", page)
    assert any('<script>[red]"\\' in line for line in lines)
    assert "<script>[red]" not in page.read_text(encoding="utf-8")
    assert open_scene(tmp_path / "out" / "networks" / "t").document.name == "t"


def test_new__a_folder_without_room_keeps_nothing(tmp_path: Path, new: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(source: Path, target: Path) -> Path:
        target.mkdir()
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(shutil, "copytree", full)
    with pytest.raises(UsageError, match="can't be written: No space left"):
        new("t", "--from", JUNCTION)
    assert files_in(tmp_path / "out") == []
    assert list((tmp_path / "out" / "networks").iterdir()) == []
