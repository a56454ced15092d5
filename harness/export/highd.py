"""A recorded game as three tables in the layout of the highD data set: tracks, tracksMeta, recordingMeta.

Columns are those of highD's published format, by name and in its order; `heading` in tracks and `name` and `kind` in
tracksMeta are additional. highD shows straight motorways from above, with y downwards; coordinates are therefore those
of the net with y reversed, from the upper left corner of its lanes on. Boxes are not turned: x and y are the corner of
a box of the body's length and width around its centre. 0 stands for "no vehicle", and -1 for a least value that does
not exist.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from harness.export.exported_game import BUS, PERSON, THING, TRAM, TRUCK, Body, ExportedGame
from harness.export.lane_courses import NONE, LaneCourses
from harness.game.arrays import FloatArray, IntArray


def neighbours_of(tracks: pd.DataFrame, stations: FloatArray, beside: IntArray) -> dict[str, IntArray]:
    """The rows [N] of the nearest road users of each row in the same frame, by highD's columns; NONE without one.

    `tracks` has `frame` and `width`, the body's length; `stations` [N, C] are places along each course, `beside` [N, 3]
    the courses of the own lane and of those to the left and right. A body that overlaps lengthwise is alongside: in
    the own lane it has no column, and is neither ahead nor behind.
    """
    count, length_m = len(tracks), tracks["width"].to_numpy()
    names = [
        ("precedingId", None, "followingId"),
        ("leftPrecedingId", "leftAlongsideId", "leftFollowingId"),
        ("rightPrecedingId", "rightAlongsideId", "rightFollowingId"),
    ]
    found: dict[str, IntArray] = {name: np.full(count, NONE) for row in names for name in row if name is not None}
    for frame in tracks.groupby("frame", sort=False).indices.values():
        for row in frame:
            for lane, (ahead, alongside, behind) in enumerate(names):
                course = beside[row, lane]
                others = frame[(frame != row) & (beside[frame, 0] == course)] if course != NONE else frame[:0]
                if not len(others):
                    continue
                away_m = stations[others, course] - stations[row, course]
                overlaps = np.abs(away_m) < 0.5 * (length_m[others] + length_m[row])
                if alongside is not None:
                    found[alongside][row] = _nearest(others[overlaps], away_m[overlaps])
                others, away_m = others[~overlaps], away_m[~overlaps]
                found[ahead][row] = _nearest(others[away_m > 0.0], away_m[away_m > 0.0])
                found[behind][row] = _nearest(others[away_m <= 0.0], away_m[away_m <= 0.0])
    return found


def _nearest(rows: IntArray, away_m: FloatArray) -> int:
    return int(rows[np.argmin(np.abs(away_m))]) if len(rows) else NONE


FIRST_LANE = 2
"""highD counts the area beside the road as lane 1."""
NO_MARKINGS = "0.00;0.00"
TRACKS = (
    *("frame", "id", "x", "y", "width", "height", "xVelocity", "yVelocity", "xAcceleration", "yAcceleration"),
    *("frontSightDistance", "backSightDistance", "dhw", "thw", "ttc", "precedingXVelocity", "precedingId"),
    *("followingId", "leftPrecedingId", "leftAlongsideId", "leftFollowingId", "rightPrecedingId"),
    *("rightAlongsideId", "rightFollowingId", "laneId", "heading"),
)
_TRUCKS = (TRUCK, BUS, TRAM)


def highd_tables(game: ExportedGame, number: int, courses: LaneCourses) -> dict[str, bytes]:
    """The files of a game, by name. Obstacles that are no vehicles, and buildings, are left out."""
    users = [body for body in game.bodies if body.kind.group != THING]
    tracks = _tracks(users, game, courses)
    meta = pd.DataFrame([_of_track(rows, body) for (_, rows), body in zip(tracks.groupby("id"), users, strict=True)])
    recording = pd.DataFrame([_of_recording(game, number, meta, courses)])
    tables = {"tracks": tracks[list(TRACKS)], "tracksMeta": meta, "recordingMeta": recording}
    return {
        f"{number:02d}_{name}.csv": table.round(4).to_csv(index=False, lineterminator="\n").encode()
        for name, table in tables.items()
    }


def _tracks(users: list[Body], game: ExportedGame, courses: LaneCourses) -> pd.DataFrame:
    left_m, _, right_m, top_m = courses.bounds_m
    parts = []
    for place, body in enumerate(users, start=1):
        velocity = body.speed_mps[:, None] * np.column_stack((np.cos(body.heading_rad), -np.sin(body.heading_rad)))
        many = len(velocity) > 1
        acceleration = np.gradient(velocity, game.step_s, axis=0) if many else np.zeros_like(velocity)
        x_m, forwards = body.x_m - left_m, velocity[:, 0].sum() >= 0.0
        to_right_m, to_left_m = (right_m - left_m) - x_m, x_m
        parts.append(
            pd.DataFrame(
                {
                    "frame": body.first_step + 1 + np.arange(len(x_m)),
                    "id": place,
                    "x": x_m - 0.5 * body.length_m,
                    "y": top_m - body.y_m - 0.5 * body.width_m,
                    "width": body.length_m,
                    "height": body.width_m,
                    "xVelocity": velocity[:, 0],
                    "yVelocity": velocity[:, 1],
                    "xAcceleration": acceleration[:, 0],
                    "yAcceleration": acceleration[:, 1],
                    "frontSightDistance": to_right_m if forwards else to_left_m,
                    "backSightDistance": to_left_m if forwards else to_right_m,
                    "heading": np.degrees(body.heading_rad) % 360.0,
                    "speed": np.abs(body.speed_mps),
                    "centre_x": body.x_m,
                    "centre_y": body.y_m,
                }
            )
        )
    tracks = pd.concat(parts, ignore_index=True)
    points = tracks[["centre_x", "centre_y"]].to_numpy()
    lane = np.concatenate([courses.lanes_of(points[rows]) for rows in tracks.groupby("id").indices.values()])
    tracks["laneId"] = courses.course[lane] + FIRST_LANE
    beside = np.stack((courses.course[lane], courses.left[lane], courses.right[lane]), axis=-1)
    stations = courses.stations(points)
    found = neighbours_of(tracks, stations, beside)
    for name, rows in found.items():
        tracks[name] = np.where(rows == NONE, 0, tracks["id"].to_numpy()[rows])
    return _with_headways(tracks, found["precedingId"], stations, courses.course[lane])


def _with_headways(tracks: pd.DataFrame, ahead: IntArray, stations: FloatArray, course: IntArray) -> pd.DataFrame:
    """dhw (from bumper to bumper), thw and ttc to the road user ahead [N], a row of `tracks` or NONE."""
    has, rows = ahead != NONE, np.arange(len(tracks))
    length_m, speed_mps = tracks["width"].to_numpy(), tracks["speed"].to_numpy()
    apart_m = stations[ahead, course] - stations[rows, course] - 0.5 * (length_m[ahead] + length_m)
    closing_mps = speed_mps - speed_mps[ahead]
    with np.errstate(divide="ignore", invalid="ignore"):
        times = {"thw": apart_m / speed_mps, "ttc": apart_m / closing_mps}
    known = {name: np.where(has & np.isfinite(values), values, 0.0) for name, values in times.items()}
    ahead_mps = np.where(has, tracks["xVelocity"].to_numpy()[ahead], 0.0)
    return tracks.assign(dhw=np.where(has, apart_m, 0.0), precedingXVelocity=ahead_mps, **known)


def _of_track(rows: pd.DataFrame, body: Body) -> dict[str, object]:
    steps_m = np.hypot(np.diff(body.x_m), np.diff(body.y_m))
    led = rows[rows["precedingId"] > 0]
    x_mps = rows["xVelocity"].abs()
    return {
        "id": int(rows["id"].iloc[0]),
        "width": body.length_m,
        "height": body.width_m,
        "initialFrame": int(rows["frame"].iloc[0]),
        "finalFrame": int(rows["frame"].iloc[-1]),
        "numFrames": len(rows),
        "class": _class_of(body),
        "drivingDirection": 2 if rows["xVelocity"].sum() >= 0.0 else 1,
        "traveledDistance": float(steps_m.sum()),
        "minXVelocity": x_mps.min(),
        "maxXVelocity": x_mps.max(),
        "meanXVelocity": x_mps.mean(),
        "minDHW": _least(led["dhw"]),
        "minTHW": _least(led["thw"]),
        "minTTC": _least(led["ttc"][led["ttc"] > 0.0]),
        "numLaneChanges": int((np.diff(rows["laneId"]) != 0).sum()),
        "name": body.original,
        "kind": body.kind.word,
    }


def _class_of(body: Body) -> str:
    if body.kind.group == PERSON or body.kind.two_wheeled:
        return body.kind.word.capitalize()
    return "Truck" if body.kind in _TRUCKS else "Car"


def _least(values: pd.Series) -> float:
    return float(values.min()) if len(values) else -1.0


def _of_recording(game: ExportedGame, number: int, meta: pd.DataFrame, courses: LaneCourses) -> dict[str, object]:
    """Games have no date: it is that of other exported files, 1 January 1970."""
    top_m = courses.bounds_m[3]
    upper, lower = (";".join(f"{top_m - y_m:.2f}" for y_m in each) or NO_MARKINGS for each in courses.markings_y_m)
    return {
        "id": number,
        "frameRate": round(1.0 / game.step_s),
        "locationId": 1,
        "speedLimit": courses.speed_limit_mps,
        "month": "1.1970",
        "weekDay": "Thu",
        "startTime": "00:00",
        "duration": game.end_s,
        "totalDrivenDistance": meta["traveledDistance"].sum(),
        "totalDrivenTime": (meta["numFrames"] - 1).sum() * game.step_s,
        "numVehicles": len(meta),
        "numCars": int((meta["class"] == "Car").sum()),
        "numTrucks": int((meta["class"] == "Truck").sum()),
        "upperLaneMarkings": upper,
        "lowerLaneMarkings": lower,
    }
