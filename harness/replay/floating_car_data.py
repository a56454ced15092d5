"""A game's trace as the floating-car data that SUMO's replay device plays.

Requirements of the device for an exact replay (measured on SUMO 1.28):

- A vehicle's first record only inserts it, at the lane's centre. So each vehicle's first sample is written twice,
  once a step earlier, and all times are a step later than the game's.
- The device never removes a vehicle: after its last record SUMO drives it to the end of its route. So a vehicle
  that leaves before the game ends gets a last speed that takes it there within the next step. This is the only
  number of a replay that is not in the trace.
- A vehicle that is present when the game ends gets two more records: the last picture stays for one more step, and the
  second one is after the end of the simulation.
- Every record names a lane, and the vehicle's route consists of these lanes. The last one must belong to an edge,
  or the route would end before the junction in which the vehicle leaves.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import shapely

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.replay.vehicles import DrawnVehicle
from harness.road.xml.xml_file import parse_xml

_NOT_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_NOT_FOR_VEHICLES = {"crossing", "walkingarea"}


@dataclass(frozen=True, kw_only=True)
class Lanes:
    """The lanes of a net [L]: centre lines, SUMO's lengths (m), and for each lane the lane of an edge that it leads to:
    itself, or for a lane inside a junction the one after it."""

    ids: tuple[str, ...]
    centre_lines: tuple[FloatArray, ...]
    length_m: FloatArray
    onward: IntArray

    @classmethod
    def read(cls, net_file: Path) -> Lanes:
        root = parse_xml(net_file)
        ids, shapes, lengths = [], [], []
        for edge in root.iter("edge"):
            if edge.get("function") not in _NOT_FOR_VEHICLES:
                for lane in edge.iter("lane"):
                    ids.append(str(lane.get("id")))
                    points = [[float(c) for c in point.split(",")[:2]] for point in lane.get("shape", "").split()]
                    shapes.append(np.array(points))
                    lengths.append(float(lane.get("length", "nan")))
        row = {name: number for number, name in enumerate(ids)}
        onward = np.arange(len(ids))
        for connection in root.iter("connection"):
            inside = row.get(f"{connection.get('from')}_{connection.get('fromLane')}")
            after = row.get(f"{connection.get('to')}_{connection.get('toLane')}")
            if inside is not None and after is not None and ids[inside].startswith(":"):
                onward[inside] = after
        return cls(ids=tuple(ids), centre_lines=tuple(shapes), length_m=np.array(lengths), onward=onward)

    def bounds(self) -> tuple[float, float, float, float]:
        """min x, min y, max x, max y of all centre lines (m)."""
        points = np.concatenate(self.centre_lines)
        (left, bottom), (right, top) = points.min(0), points.max(0)
        return float(left), float(bottom), float(right), float(top)

    def locate(self, points_m: FloatArray, starts: BoolArray) -> IntArray:
        """Nearest lane [N] (row of `ids`) of points [N, 2].

        A point off the road gets the nearest lane. A vehicle can only be inserted on a lane outside junctions: points
        that are `starts` [N] get one of those.
        """
        lines = self._lines()
        points = shapely.points(points_m)
        lane = np.empty(len(points), dtype=np.int64)
        all_lanes = np.arange(len(lines))
        for chosen, usable in ((~starts, all_lanes), (starts, all_lanes[self.onward == all_lanes])):
            if chosen.any():
                lane[chosen] = usable[shapely.STRtree(lines[usable]).nearest(points[chosen])]
        return lane

    def position(self, lane: IntArray, points_m: FloatArray) -> FloatArray:
        """Position along lanes [N] of the place nearest to points [N, 2] (m) [N]."""
        share = shapely.line_locate_point(self._lines()[lane], shapely.points(points_m), normalized=True)
        return np.clip(share, 0.0, 1.0) * self.length_m[lane]

    def _lines(self) -> np.ndarray:
        return np.array([shapely.LineString(line) for line in self.centre_lines], dtype=object)


_SEND_OFF_MPS = 1e6


def shown_at(time_s: float, step_length_s: float) -> float:
    """The time of SUMO's step that shows the game's sample of `time_s`."""
    return time_s + step_length_s


def write_recording(
    *, trace: pd.DataFrame, types: Mapping[str, DrawnVehicle], lanes: Lanes, step_length_s: float, file: Path
) -> None:
    """Write one game as plain XML: some tens of kB, readable, and the same bytes on any machine."""
    records = _records(trace, types, lanes, step_length_s)
    last_step = records["step"].max()
    first = records.drop_duplicates("id").assign(step=lambda rows: rows["step"] - 1)
    last = records[records["step"] == last_step]
    after = [last.assign(step=last_step + more) for more in (1, 2)]
    written = pd.concat([first, records, *after]).sort_values(["step", "id"], kind="stable")

    names = [name for name in written.columns if name != "step"]
    columns = [written[name].tolist() for name in names]
    texts = [column if isinstance(column[0], str) else [f"{x + 0.0:.6f}" for x in column] for column in columns]
    root = ElementTree.Element("fcd-export")
    for step, rows in groupby(zip(written["step"].tolist(), *texts, strict=True), itemgetter(0)):
        # step 0 of the game is shown by SUMO's second step
        timestep = ElementTree.SubElement(root, "timestep", time=f"{(step + 1) * step_length_s:.3f}")
        for _, *values in rows:
            ElementTree.SubElement(timestep, "vehicle", dict(zip(names, values, strict=True)))
    write_xml(root, file)


def _records(
    trace: pd.DataFrame, types: Mapping[str, DrawnVehicle], lanes: Lanes, step_length_s: float
) -> pd.DataFrame:
    """The trace's rows in SUMO's units: the centre of the front bumper, and degrees clockwise from north."""
    trace = trace.sort_values(["step", "player"], kind="stable")
    length = trace["player"].map(lambda player: types[player].length_m).to_numpy(float)
    heading = trace["heading_rad"].to_numpy(float)
    ahead_m = 0.5 * length[:, None] * np.stack((np.cos(heading), np.sin(heading)), axis=-1)
    front = trace[["x_m", "y_m"]].to_numpy(float) + ahead_m
    player, step = trace["player"], np.rint(trace["time_s"].to_numpy(float) / step_length_s).astype(int)
    lane = lanes.locate(front, ~player.duplicated().to_numpy())
    leaves = ~player.duplicated(keep="last").to_numpy() & (step < step.max())
    lane = np.where(leaves, lanes.onward[lane], lane)
    return pd.DataFrame(
        {
            "step": step,
            "id": player.to_numpy(),
            "type": player.map(lambda player: types[player].name).to_numpy(),
            "x": front[:, 0],
            "y": front[:, 1],
            "angle": np.round(90.0 - np.degrees(heading), 6) % 360.0,
            "speed": np.where(leaves, _SEND_OFF_MPS, np.abs(trace["speed_mps"].to_numpy(float))),  # a step back
            "pos": lanes.position(lane, front),
            "lane": np.array(lanes.ids, dtype=object)[lane],
        }
    )


def write_xml(root: ElementTree.Element, file: Path) -> None:
    """Write an XML document."""
    file.write_bytes(xml_text(root))


def xml_text(root: ElementTree.Element) -> bytes:
    """A document, indented; the same content gives the same bytes. Characters that XML can't contain become `?`."""
    for element in root.iter():
        element.attrib.update({name: _NOT_XML.sub("?", value) for name, value in element.attrib.items()})
    ElementTree.indent(root)
    text: bytes = ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True)
    return text + b"\n"
