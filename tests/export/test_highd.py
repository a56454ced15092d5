"""Tables in the layout of highD, with values computed by hand.

The scene tests/data/merge has two lanes along x, whose centre lines are at y = -1.6 and y = -4.8. Cars are 5 m long.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from harness.export.highd import highd_tables, neighbours_of
from harness.export.lane_courses import NONE, LaneCourses
from harness.road.scene.open_scene import OpenScene
from tests.support.exports import exported, signals_game
from tests.support.replays import drive, game, straight

FORMAT = {
    "tracks": "frame id x y width height xVelocity yVelocity xAcceleration yAcceleration frontSightDistance "
    "backSightDistance dhw thw ttc precedingXVelocity precedingId followingId leftPrecedingId leftAlongsideId "
    "leftFollowingId rightPrecedingId rightAlongsideId rightFollowingId laneId",
    "tracksMeta": "id width height initialFrame finalFrame numFrames class drivingDirection traveledDistance "
    "minXVelocity maxXVelocity meanXVelocity minDHW minTHW minTTC numLaneChanges",
    "recordingMeta": "id frameRate locationId speedLimit month weekDay startTime duration totalDrivenDistance "
    "totalDrivenTime numVehicles numCars numTrucks upperLaneMarkings lowerLaneMarkings",
}


def tables_of(trace: pd.DataFrame, scene: OpenScene) -> Mapping[str, pd.DataFrame]:
    files = highd_tables(exported(trace, scene), 7, LaneCourses.read(scene.net_file))
    assert sorted(files) == ["07_recordingMeta.csv", "07_tracks.csv", "07_tracksMeta.csv"]
    return {name[3:-4]: pd.read_csv(io.BytesIO(content)) for name, content in files.items()}


def following() -> pd.DataFrame:
    """The ego follows a slower car in the left lane; another is beside it, and one changes from the right lane."""
    changing = [(10.0 + k, -4.8 + 0.32 * k, 0.0, 10.0) for k in range(11)]
    return game(
        drive("ego", straight(40.0, -1.6, 10.0, 11)),
        drive("ahead", straight(60.0, -1.6, 8.0, 11)),
        drive("beside", straight(41.0, -4.8, 10.0, 6), first_step=3),
        drive("changes", changing),
    )


def test_columns__are_those_of_the_format(merge: OpenScene) -> None:
    tables = tables_of(following(), merge)
    added = {"tracks": ["heading"], "tracksMeta": ["name", "kind"], "recordingMeta": []}
    for name, columns in FORMAT.items():
        assert list(tables[name].columns) == [*columns.split(), *added[name]]


def test_headways__are_those_to_the_car_ahead(merge: OpenScene) -> None:
    first = tables_of(following(), merge)["tracks"].query("frame == 1").set_index("id")
    ego, ahead, changes = (first.loc[number] for number in (1, 2, 3))
    assert (ego["precedingId"], ahead["followingId"], ahead["precedingId"]) == (2, 1, 0)
    assert ego["dhw"] == pytest.approx(20.0 - 5.0)
    assert ego["thw"] == pytest.approx((20.0 - 5.0) / 10.0, abs=1e-4)
    assert ego["ttc"] == pytest.approx((20.0 - 5.0) / 2.0)
    assert ego["precedingXVelocity"] == pytest.approx(8.0)
    assert (ahead["dhw"], ahead["thw"], ahead["ttc"]) == (0.0, 0.0, 0.0)
    assert changes["leftPrecedingId"] == 1
    assert ego["rightFollowingId"] == 3


def test_neighbours__that_overlap_are_alongside(merge: OpenScene) -> None:
    tracks = tables_of(following(), merge)["tracks"]
    third = tracks[tracks["frame"] == 4].set_index("id")
    assert (third.loc[1, "rightAlongsideId"], third.loc[1, "rightPrecedingId"]) == (4, 0)
    assert (third.loc[4, "leftAlongsideId"], third.loc[4, "leftPrecedingId"]) == (1, 2)


@pytest.mark.parametrize("hand", ["right", "left"])
def test_neighbours__are_on_the_side_where_they_drive(hand: str, build_net: Callable[..., Path]) -> None:
    nodes = '<node id="a" x="0" y="0"/><node id="b" x="200" y="0"/>'
    options = ("--lefthand",) if hand == "left" else ()
    file = build_net(nodes, '<edge id="ab" from="a" to="b" numLanes="2"/>', "", *options)
    courses = LaneCourses.read(file)
    upper, lower = sorted(range(2), key=lambda lane: -courses.lanes.centre_lines[lane][0, 1])  # both go east
    assert courses.lanes.ids[upper] == ("ab_1" if hand == "right" else "ab_0")
    assert (courses.left[upper], courses.right[upper]) == (NONE, courses.course[lower])
    assert (courses.left[lower], courses.right[lower]) == (courses.course[upper], NONE)


def test_neighbours__that_overlap_in_the_same_lane_are_neither_ahead_nor_behind() -> None:
    tracks = pd.DataFrame({"frame": [1, 1, 1], "width": [5.0, 5.0, 5.0]})
    stations, beside = np.array([[0.0], [4.9], [10.0]]), np.array([[0, NONE, NONE]] * 3)
    found = neighbours_of(tracks, stations, beside)
    assert found["precedingId"].tolist() == [2, 2, NONE]
    assert found["followingId"].tolist() == [NONE, NONE, 1]


def test_boxes__have_the_bodies_in_their_middle(merge: OpenScene) -> None:
    trace = following()
    tracks = tables_of(trace, merge)["tracks"]
    ego = trace[trace["player"] == "ego"].sort_values("step")
    rows = tracks[tracks["id"] == 1]
    left_m, _, _, top_m = LaneCourses.read(merge.net_file).bounds_m
    np.testing.assert_allclose(rows["x"] + 0.5 * rows["width"] + left_m, ego["x_m"], atol=1e-3)
    np.testing.assert_allclose(top_m - (rows["y"] + 0.5 * rows["height"]), ego["y_m"], atol=1e-3)
    assert rows["frame"].tolist() == list(range(1, 12))


def test_meta__counts_lane_changes_and_frames(merge: OpenScene) -> None:
    meta = tables_of(following(), merge)["tracksMeta"].set_index("name")
    assert meta["numLaneChanges"].to_dict() == {"ego": 0, "ahead": 0, "changes": 1, "beside": 0}
    assert meta.loc["beside", ["initialFrame", "finalFrame", "numFrames"]].tolist() == [4, 9, 6]
    assert meta.loc["ego", "traveledDistance"] == pytest.approx(10.0)
    assert meta.loc["ahead", ["minDHW", "minTHW", "minTTC"]].tolist() == [-1.0, -1.0, -1.0]


def test_recording__has_markings_and_sums(merge: OpenScene) -> None:
    (recording,) = tables_of(following(), merge)["recordingMeta"].to_dict("records")
    assert (recording["id"], recording["frameRate"], recording["numVehicles"], recording["numCars"]) == (7, 10, 4, 4)
    assert recording["lowerLaneMarkings"].split(";")[:2] == ["0.00", "3.20"]
    assert recording["upperLaneMarkings"] == "0.00;0.00"
    assert recording["duration"] == pytest.approx(1.0)


def test_lanes__stay_the_same_through_a_junction() -> None:
    meta = tables_of(*signals_game())["tracksMeta"].set_index("name")
    assert meta.loc["non_ego", "numLaneChanges"] == 0
