"""The surface of a road as plain geometry: slits, levels, and cars that follow lines."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from harness.road.net import surface
from harness.road.net.surface import Part

SQUARE = shapely.box(0.0, 0.0, 20.0, 20.0)


def beside(gap_m: float) -> shapely.MultiPolygon:
    return shapely.union(SQUARE, shapely.box(20.0 + gap_m, 0.0, 40.0, 20.0))


@pytest.mark.parametrize(("gap_m", "parts"), [(0.2, 1), (0.9, 1), (1.1, 2), (3.0, 2)])
def test_slits__thinner_than_a_metre_are_closed(gap_m: float, parts: int) -> None:
    assert len(shapely.get_parts(surface.without_slits(beside(gap_m)))) == parts


@pytest.mark.parametrize(("width_m", "holes"), [(0.9, 0), (1.1, 1)])
def test_slits__holes_thinner_than_a_metre_are_closed(width_m: float, holes: int) -> None:
    area = surface.without_slits(SQUARE.difference(shapely.box(5.0, 5.0, 15.0, 5.0 + width_m)))
    assert len(area.interiors) == holes


def road(x_from: float, x_to: float, height_m: float, own: bool) -> Part:
    """A road along x, 6 m wide, whose height begins at 0 and ends at `height_m`."""
    line = np.array([[x_from, 0.0, 0.0], [0.5 * (x_from + x_to), 0.0, height_m], [x_to, 0.0, height_m]])
    return Part(shape=surface.lane_shape(line[:, :2], 6.0), line=line, own=own)


def test_levels__only_the_overlap_that_differs_in_height_is_cut() -> None:
    """A ramp leaves the own road at its height, climbs in a loop, and crosses it above."""
    ramp_line = np.array([[0.0, 3.0, 0.0], [80.0, 30.0, 3.0], [120.0, 0.0, 6.0], [120.0, -60.0, 6.0]])
    ramp = Part(shape=surface.lane_shape(ramp_line[:, :2], 4.0), line=ramp_line, own=False)
    own = road(-100.0, 200.0, 0.0, True)
    _, kept = surface.own_level([own, ramp])
    assert kept.shape.intersects(shapely.Point(4.0, 3.0))  # where it leaves
    assert not kept.shape.intersects(shapely.Point(120.0, 0.0))  # where it crosses


def test_swept__a_car_that_follows_a_sharp_bend_stays_inside() -> None:
    bend = np.array([[0.0, 0.0], [20.0, 0.0], [20.0, 20.0]])
    lane = surface.lane_shape(bend, 2.2)
    area = surface.with_swept_paths(lane, [bend])
    diagonal = np.array([np.cos(np.pi / 4), np.sin(np.pi / 4)])
    ends = np.stack([(20.0, 0.0) + side * 2.3 * diagonal for side in (-1.0, 1.0)])
    car = surface.lane_shape(ends, 1.8)
    assert not lane.covers(car)
    assert area.covers(car)
