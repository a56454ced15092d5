"""Replays in the real SUMO: it plays the recording, to the millimetre."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest
from defusedxml import ElementTree

from harness.replay import names_in_pictures
from harness.replay.contacts import contacts
from harness.replay.gui_settings import choose_view
from harness.replay.vehicles import types_of_vehicles
from harness.road.scene.open_scene import open_scene
from tests.support.replays import (
    GAMES,
    RAILS,
    SIZES,
    STEP_S,
    assert_plays,
    busy_game,
    clean_game,
    collision_game,
    drive,
    game,
    play,
    rail_game,
    straight,
    write,
)
from tests.support.repository import REPOSITORY


@pytest.mark.parametrize("name", GAMES)
def test_replay__every_frame_is_the_trace(name: str, merge_net: Path, tmp_path: Path) -> None:
    trace = GAMES[name]()
    assert_plays(write(trace, merge_net, tmp_path / name), trace, {name: size[0] for name, size in SIZES.items()})


def test_replay__ends_with_the_game(merge_net: Path, tmp_path: Path) -> None:
    trace = clean_game()
    played, _ = play(write(trace, merge_net, tmp_path / "replay"))
    # the last picture stays for one more step: see `test_gui__asks_no_question_at_the_end`
    assert played["label_s"].max() == pytest.approx(trace["time_s"].max() + 2 * STEP_S)
    assert played[played["player"] == "ego"]["label_s"].max() == pytest.approx(153 * STEP_S + STEP_S)


def test_replay__plays_where_it_is_moved_to(merge_net: Path, tmp_path: Path) -> None:
    folder = write(collision_game(), merge_net, tmp_path / "a" / "replay")
    elsewhere = (tmp_path / "b c").resolve()
    elsewhere.mkdir()
    moved = folder.rename(elsewhere / "replay")
    assert not play(moved)[0].empty
    for file in moved.glob("scene.[!n]*"):
        assert str(tmp_path) not in file.read_text()


def test_replay__twice_gives_the_same_bytes(merge_net: Path, tmp_path: Path) -> None:
    shuffled = rail_game().sample(frac=1.0, random_state=3)
    first = write(rail_game(), merge_net, tmp_path / "first")
    second = write(shuffled, merge_net, tmp_path / "second")
    names = sorted(file.name for file in first.iterdir())
    assert names == ["episode.fcd.xml", "scene.add.xml", "scene.net.xml", "scene.sumocfg", "view.xml"]
    assert [file.read_bytes() for file in sorted(first.iterdir())] == [
        file.read_bytes() for file in sorted(second.iterdir())
    ]


def test_replay__that_fails_leaves_what_was_there(merge_net: Path, tmp_path: Path) -> None:
    folder = write(clean_game(), merge_net, tmp_path / "replays" / "game")
    before = (folder / "episode.fcd.xml").read_bytes()
    broken = clean_game().assign(heading_rad="north")
    with pytest.raises((TypeError, ValueError)):
        write(broken, merge_net, folder)
    assert [path.name for path in folder.parent.iterdir()] == ["game"]
    assert (folder / "episode.fcd.xml").read_bytes() == before
    write(collision_game(), merge_net, folder)
    assert (folder / "episode.fcd.xml").read_bytes() != before


def test_replay__is_of_one_game(merge_net: Path, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="one game"):
        write(pd.concat([clean_game(), clean_game().assign(episode=1)]), merge_net, tmp_path / "replay")
    with pytest.raises(ValueError, match="one game"):
        write(clean_game().iloc[:0], merge_net, tmp_path / "replay")


def test_title__calls_the_players_by_their_names(merge_net: Path, tmp_path: Path) -> None:
    names = names_in_pictures("red_light_runner")
    folder = write(clean_game(), merge_net, tmp_path / "replay", title="naive", names=names)
    title = ElementTree.parse(folder / "scene.add.xml").getroot().find("poi[@id='title']")
    assert title.get("type") == "naive   blue: ego, orange: red light runner"
    assert names_in_pictures("") == {}


def test_scenery__types_that_occur_in_the_colours_of_the_game(merge_net: Path, tmp_path: Path) -> None:
    folder = write(game(busy_game(), drive("non_ego", straight(20, -4.8, 9, 60))), merge_net, tmp_path / "replay")
    root = ElementTree.parse(folder / "scene.add.xml").getroot()
    types = {element.get("id"): element for element in root.iter("vType")}
    assert sorted(types) == ["DEFAULT_VEHTYPE", "car", "city_bus", "ego", "non_ego", "van"]
    red, _, blue = (int(part) for part in types["ego"].get("color").split(","))
    assert blue > 200 > red
    red, green, blue = (int(part) for part in types["non_ego"].get("color").split(","))
    assert red > green > blue
    assert types["van"].get("color") == "120,60,160"
    assert (types["ego"].get("length"), types["ego"].get("guiShape")) == ("4.6", "passenger/sedan")
    assert (types["city_bus"].get("length"), types["city_bus"].get("guiShape")) == ("12", "bus")
    assert len([poly for poly in root.iter("poly") if poly.get("id").startswith("rail")]) == len(RAILS)


def test_contacts__are_found_where_and_when_the_bodies_touch(merge_net: Path, tmp_path: Path) -> None:
    routes = merge_net.with_name("merge.rou.xml").read_text(encoding="utf-8")
    (crash,) = contacts(collision_game(), types_of_vehicles(collision_game(), routes), RAILS)
    assert crash.time_s == pytest.approx(3.2)
    assert crash.label == "collision at 3.2 s"
    assert 78.0 < crash.x_m < 82.0
    assert -3.0 < crash.y_m < -1.5

    (scrape,) = contacts(rail_game(), types_of_vehicles(rail_game(), routes), RAILS)
    assert scrape.label == "rail at 3.0 s"
    assert scrape.y_m == pytest.approx(0.0)
    assert contacts(clean_game(), types_of_vehicles(clean_game(), routes), RAILS) == []
    assert contacts(busy_game(), types_of_vehicles(busy_game(), routes), RAILS) == []


@pytest.mark.parametrize(("make", "times"), [(collision_game, ["3.300", "4.400"]), (clean_game, ["17.000"])])
def test_view__halts_at_the_contact_and_at_the_end(
    make: Callable[[], pd.DataFrame], times: list[str], merge_net: Path, tmp_path: Path
) -> None:
    folder = write(make(), merge_net, tmp_path / "replay")
    root = ElementTree.parse(folder / "view.xml").getroot()
    assert [halt.get("time") for halt in root.iter("breakpoint")] == times


def test_view__holds_the_players_or_else_the_contact() -> None:
    routes_away = drive("ego", straight(0.0, 0.0, 50.0, 200))
    near = drive("non_ego", [(900.0, 5.0, 0.0, 0.0)] * 200)
    view = choose_view(game(routes_away, near), [])
    assert abs(view.x_m - 900.0) < 5.0
    assert view.width_m == pytest.approx(220.0)

    view = choose_view(drive("ego", straight(10.0, -1.6, 10.0, 20)), [])
    assert view.x_m == pytest.approx(0.5 * (10.0 + 29.0))
    assert view.width_m < 80.0


def test_types__a_walker_and_a_cyclist_look_like_what_they_are() -> None:
    expected = {"crossing": ("pedestrian", 0.5, 0.5), "cyclist": ("bicycle", 1.8, 0.65)}
    for name, looks in expected.items():
        scene = open_scene(REPOSITORY / "networks" / name)
        kinds = [scene.vehicle(player).vehicle_type for player in range(2)]
        trace = pd.DataFrame({"player": ["ego", "non_ego"], "vehicle_type": kinds})
        drawn = types_of_vehicles(trace, scene.routes.types_xml)["non_ego"]
        assert (drawn.shape, drawn.length_m, drawn.width_m) == looks
