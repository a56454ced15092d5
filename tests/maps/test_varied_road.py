"""Variants of a road: the change of the plane, and nets that netconvert builds of it."""

from __future__ import annotations

from dataclasses import replace
from math import pi, tan
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sumolib.net import Net

from harness.game.arrays import FloatArray
from harness.maps.varied_road import (
    ANGLE_DEG,
    BEND_MPS2,
    LENGTH_SHARE,
    LIMIT_SHARE,
    WIDTH_SHARE,
    RoadVariation,
    Warp,
    vary_net,
    vary_route_file,
    warp_of,
)
from harness.road.net.network import lane_line, read_net
from tests.support.repository import REPOSITORY

SAME = RoadVariation(length_share=1.0, width_share=1.0, limit_share=1.0, bend_mps2=0.0, angle_deg=0.0)
PLANE = Warp(x_m=0.0, y_m=0.0, heading_rad=0.0, length_share=1.0, angle_deg=0.0, curvature_per_m=0.0)
EAST = np.array([[0.0, 0.0], [100.0, 0.0]])
metres = st.floats(-500.0, 500.0)


def at(warp: Warp, x: float, y: float) -> list[float]:
    return list(warp(np.array([[x, y]]))[0].tolist())


@given(metres, metres, st.floats(-pi, pi))
def test_plane__without_a_change_stays(x: float, y: float, heading: float) -> None:
    assert at(replace(PLANE, heading_rad=heading, x_m=7.0, y_m=-3.0), x, y) == pytest.approx([x, y], abs=1e-9)


def test_plane__is_stretched_around_its_point() -> None:
    assert at(replace(PLANE, x_m=10.0, y_m=20.0, length_share=1.2), 60.0, 30.0) == pytest.approx([70.0, 32.0])


def test_plane__is_sheared_along_its_direction() -> None:
    """A road that crosses at a right angle leans forward, by the change of the angle."""
    sheared = replace(PLANE, angle_deg=15.0)
    assert at(sheared, 50.0, 0.0) == pytest.approx([50.0, 0.0])
    assert at(sheared, 0.0, 100.0) == pytest.approx([100.0 * tan(pi / 12.0), 100.0])
    north = replace(sheared, heading_rad=pi / 2.0)
    assert at(north, -100.0, 0.0) == pytest.approx([-100.0, 100.0 * tan(pi / 12.0)])


def test_plane__is_bent_to_the_left_by_its_curvature() -> None:
    """A quarter of a circle of radius 100 m: 157.1 m ahead are 100 m ahead and 100 m to the left."""
    bent = replace(PLANE, curvature_per_m=0.01)
    assert at(bent, 50.0 * pi, 0.0) == pytest.approx([100.0, 100.0])
    assert at(bent, 50.0 * pi, 20.0) == pytest.approx([80.0, 100.0])  # 20 m to the left: inside of the bend
    assert bent.heading_of(50.0 * pi, 0.0, 0.0) == pytest.approx(pi / 2.0, abs=1e-3)
    assert at(replace(PLANE, curvature_per_m=-0.01), 50.0 * pi, 0.0) == pytest.approx([100.0, -100.0])


@given(st.floats(-0.005, 0.005), st.floats(-200.0, 200.0), st.floats(-10.0, 10.0))
def test_plane__keeps_lengths_along_the_bent_line_and_widths_across_it(bend: float, along: float, left: float) -> None:
    bent = replace(PLANE, curvature_per_m=bend)
    line = bent(np.stack((np.linspace(0.0, along, 400), np.zeros(400)), axis=1))
    assert np.hypot(*np.diff(line, axis=0).T).sum() == pytest.approx(abs(along), rel=1e-3, abs=1e-6)
    apart = np.subtract(at(bent, along, left), at(bent, along, 0.0))
    assert np.hypot(*apart) == pytest.approx(abs(left), abs=1e-6)


def test_bend__has_its_lateral_acceleration_at_the_highest_limit() -> None:
    points = np.array([[0.0, 0.0], [60.0, 0.0]])
    warp = warp_of(replace(SAME, bend_mps2=1.2, limit_share=1.1), EAST, points, fastest_mps=20.0)
    assert warp.curvature_per_m * 22.0**2 == pytest.approx(1.2)


def test_bend__of_a_long_net_turns_by_a_quarter_at_most() -> None:
    points = np.array([[0.0, 0.0], [3000.0, 0.0]])
    warp = warp_of(replace(SAME, bend_mps2=1.5, length_share=1.25), EAST, points, fastest_mps=14.0)
    assert warp.curvature_per_m * 3750.0 == pytest.approx(pi / 2.0)


@given(st.integers(0, 1000))
def test_variation__is_drawn_by_its_parts_within_the_ranges(seed: int) -> None:
    drawn = RoadVariation.drawn("road", "merge", seed, 0)
    assert drawn == RoadVariation.drawn("road", "merge", seed, 0) != RoadVariation.drawn("road", "merge", seed, 1)
    numbers = (drawn.length_share, drawn.width_share, drawn.limit_share, drawn.bend_mps2, drawn.angle_deg)
    for number, (low, high) in zip(
        numbers, (LENGTH_SHARE, WIDTH_SHARE, LIMIT_SHARE, BEND_MPS2, ANGLE_DEG), strict=True
    ):
        assert low <= number <= high


# --- nets ----------------------------------------------------------------------------------------------------------


def varied(scene: str, folder: Path, variation: RoadVariation, curvature_per_m: float = 0.0) -> tuple[Net, Net, Warp]:
    """A shipped scene's net, its variant, and the change of the plane, around the origin and to the east."""
    source, target = REPOSITORY / "networks" / scene / f"{scene}.net.xml", folder / "varied.net.xml"
    warp = replace(
        PLANE,
        length_share=variation.length_share,
        angle_deg=variation.angle_deg,
        curvature_per_m=curvature_per_m,
    )
    vary_net(source, target, warp, variation)
    return read_net(source), read_net(target), warp


def edges(net: Net) -> list[str]:
    return sorted(edge.getID() for edge in net.getEdges(withInternal=False))


def line(net: Net, lane: str) -> FloatArray:
    return lane_line(net.getLane(lane))


@pytest.mark.parametrize("scene", ["merge", "roundabout", "zebra", "left_across"])
def test_net__has_the_same_edges_lanes_and_links(scene: str, tmp_path: Path) -> None:
    variation = replace(SAME, length_share=1.1, width_share=1.1, limit_share=0.9, angle_deg=10.0)
    before, after, _ = varied(scene, tmp_path, variation, curvature_per_m=0.002)
    assert edges(after) == edges(before)
    for name in edges(before):
        of_each = [
            [
                (
                    lane.getIndex(),
                    sorted(lane.getPermissions()),
                    sorted(str(link.getToLane().getID()) for link in lane.getOutgoing()),
                )
                for lane in net.getEdge(name).getLanes()
            ]
            for net in (before, after)
        ]
        assert of_each[0] == of_each[1]


def test_net__is_stretched_with_wider_lanes_and_other_limits(tmp_path: Path) -> None:
    before, after, _ = varied("merge", tmp_path, replace(SAME, length_share=1.2, width_share=1.1, limit_share=0.9))
    for name in edges(before):
        assert after.getEdge(name).getLength() == pytest.approx(1.2 * before.getEdge(name).getLength(), rel=0.03)
        for lane, wider in zip(before.getEdge(name).getLanes(), after.getEdge(name).getLanes(), strict=True):
            factor = 1.1 if lane.allows("passenger") else 1.0
            assert wider.getWidth() == pytest.approx(factor * lane.getWidth(), abs=0.01)
            assert wider.getSpeed() == pytest.approx(0.9 * lane.getSpeed(), abs=0.01)


def test_net__is_bent_as_the_plane(tmp_path: Path) -> None:
    before, after, warp = varied("merge", tmp_path, SAME, curvature_per_m=0.003)
    lane = "approach_1"
    bent = warp(line(before, lane))
    for point in (bent[0], bent[-1]):
        assert np.hypot(*(line(after, lane) - point).T).min() < 0.3
    turns = np.unwrap(np.arctan2(*np.diff(line(after, lane), axis=0).T[::-1]))
    assert turns[-1] - turns[0] == pytest.approx(0.003 * before.getLane(lane).getLength(), abs=0.05)


def test_routes__have_their_positions_stretched_and_words_kept(tmp_path: Path) -> None:
    source, target = tmp_path / "a.rou.xml", tmp_path / "b.rou.xml"
    source.write_text(
        '<routes><vehicle id="a" depart="0" departPos="230"/><vehicle id="b" depart="1" departPos="random"/></routes>'
    )
    vary_route_file(source, target, replace(SAME, length_share=1.1))
    root = ElementTree.parse(target).getroot()
    assert [each.attrib for each in root] == [
        {"id": "a", "depart": "0", "departPos": "253.00"},
        {"id": "b", "depart": "1", "departPos": "random"},
    ]
