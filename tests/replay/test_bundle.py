"""Replays in the real SUMO: it plays the recording, to the millimetre."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from defusedxml import ElementTree

from harness.evaluation.worst_first import worst_first
from harness.replay import choose_games, names_in_pictures
from harness.replay.contacts import contacts
from harness.replay.gui_settings import choose_view
from harness.replay.selection import MOST_FAILURES_PER_ARM
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
    routes = merge_net.with_name("merge.rou.xml")
    (crash,) = contacts(collision_game(), types_of_vehicles(collision_game(), [routes]), RAILS)
    assert crash.time_s == pytest.approx(3.2)
    assert crash.label == "collision at 3.2 s"
    assert 78.0 < crash.x_m < 82.0
    assert -3.0 < crash.y_m < -1.5

    (scrape,) = contacts(rail_game(), types_of_vehicles(rail_game(), [routes]), RAILS)
    assert scrape.label == "rail at 3.0 s"
    assert scrape.y_m == pytest.approx(0.0)
    assert contacts(clean_game(), types_of_vehicles(clean_game(), [routes]), RAILS) == []
    assert contacts(busy_game(), types_of_vehicles(busy_game(), [routes]), RAILS) == []


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


def episodes() -> pd.DataFrame:
    columns = ["arm", "seed", "episode", "ego_outcome", "ego_failed", "ego_min_ttc_s", "non_ego_outcome"]
    rows = [
        ("naive_vs_x", 1, 0, "goal", 0.0, 2.0, "goal"),
        ("naive_vs_x", 1, 1, "goal", 0.0, np.nan, "goal"),
        ("naive_vs_x", 1, 2, "goal", 0.0, 0.4, "rail"),
        ("naive_vs_x", 1, 3, "timeout", 1.0, 0.1, "goal"),
        ("naive_vs_x", 1, 4, "collision", 1.0, 0.9, "collision"),
        ("naive_vs_x", 1, 5, "error", np.nan, np.nan, np.nan),
        ("naive_vs_x", 1, 6, "rail", 1.0, 3.0, "goal"),
        ("naive_vs_x", 2, 0, "collision", 1.0, 0.2, "collision"),
        ("naive_vs_x", 2, 1, "goal", 0.0, 1.0, "collision"),
        ("x_alone", 1, 0, np.nan, np.nan, np.nan, "rail"),
        ("x_alone", 1, 1, "", np.nan, np.nan, "goal"),
        ("x_alone", 1, 2, "", np.nan, np.nan, "error"),
        ("naive_alone", 1, 0, "goal", 0.0, np.nan, ""),
    ]
    table = pd.DataFrame(rows, columns=columns)
    judged = table["ego_outcome"].where(table["ego_outcome"] != "").fillna(table["non_ego_outcome"])
    table["severity"] = judged.map({"collision": 300.0, "rail": 200.0, "timeout": 100.0})
    table.loc[4, "severity"] = 305.0
    return table


def key(frame: pd.DataFrame) -> list[tuple[str, int, int]]:
    return list(frame[["arm", "seed", "episode"]].itertuples(index=False, name=None))


def test_choose_games__every_failure_and_the_first_two_others() -> None:
    assert key(choose_games(episodes())) == [
        *[("naive_vs_x", 1, k) for k in (0, 1, 3, 4, 6)],
        *[("naive_vs_x", 2, k) for k in (0, 1)],
        ("x_alone", 1, 0),
        ("x_alone", 1, 1),
        ("naive_alone", 1, 0),
    ]


def test_choose_games__of_very_many_failures_the_worst_of_each_arm_and_seed() -> None:
    row = {"arm": "naive_vs_x", "ego_outcome": "rail", "ego_failed": 1.0, "non_ego_outcome": "goal", "severity": 200.0}
    rails = [{**row, "seed": seed, "episode": k, "ego_min_ttc_s": k / 100} for seed in (1, 2) for k in range(150)]
    crashes = [{**row, "seed": 1, "episode": 150 + k, "ego_outcome": "collision", "severity": 300.0} for k in range(30)]
    chosen = choose_games(pd.DataFrame([*rails, *crashes]))
    first = [("naive_vs_x", 1, k) for k in (*range(MOST_FAILURES_PER_ARM - 30), *range(150, 180))]
    assert sorted(key(chosen)) == [*first, *[("naive_vs_x", 2, k) for k in range(MOST_FAILURES_PER_ARM)]]


def test_worst_first__by_severity_then_time_to_collision_then_name() -> None:
    expected = [
        ("naive_vs_x", 1, 4),  # collisions, the harder one first
        ("naive_vs_x", 2, 0),
        ("naive_vs_x", 1, 6),  # rails
        ("x_alone", 1, 0),
        ("naive_vs_x", 1, 3),  # timeouts
        ("naive_vs_x", 1, 2),  # the rest, by time to collision
        ("naive_vs_x", 2, 1),
        ("naive_vs_x", 1, 0),
        ("naive_alone", 1, 0),  # not measured, by name
        ("naive_vs_x", 1, 1),
        ("x_alone", 1, 1),
        ("naive_vs_x", 1, 5),  # can't be shown
        ("x_alone", 1, 2),
    ]
    assert key(worst_first(episodes())) == expected
    assert key(worst_first(episodes().sample(frac=1.0, random_state=5))) == expected
    assert list(worst_first(episodes()).columns) == list(episodes().columns)


def test_types__a_walker_and_a_cyclist_look_like_what_they_are() -> None:
    expected = {"crossing": ("pedestrian", 0.5, 0.5), "cyclist": ("bicycle", 1.8, 0.65)}
    for name, looks in expected.items():
        scene = open_scene(REPOSITORY / "networks" / name)
        kinds = [scene.vehicle(player).vehicle_type for player in range(2)]
        trace = pd.DataFrame({"player": ["ego", "non_ego"], "vehicle_type": kinds})
        drawn = types_of_vehicles(trace, scene.route_files)["non_ego"]
        assert (drawn.shape, drawn.length_m, drawn.width_m) == looks
