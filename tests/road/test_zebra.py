"""The stripes of marked crossings, in drawings."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from harness.road.net.walker_conflicts import stripes
from harness.road.scene.open_scene import open_scene
from tests.support.repository import REPOSITORY

ROAD = shapely.box(0.0, 0.0, 100.0, 7.0)


def test_stripes__cover_every_other_half_metre_of_the_carriageway() -> None:
    corners = np.array(list(stripes([np.array([[50.0, -5.0], [50.0, 12.0]])], ROAD)))
    middles = corners[:, :4].mean(axis=1)
    assert middles[:, 0] == pytest.approx(50.0)
    assert middles[:, 1] == pytest.approx([0.5, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5])
    assert np.ptp(corners, axis=1) == pytest.approx(np.array([[4.0, 0.5]] * 7))  # along the road, along the way


def test_stripes__way_beside_the_road_has_none() -> None:
    assert not list(stripes([np.array([[10.0, 9.0], [90.0, 9.0]])], ROAD))


def test_shipped_scenes__only_the_zebra_is_striped() -> None:
    assert len(open_scene(REPOSITORY / "networks" / "zebra").stripes) == 7
    assert not open_scene(REPOSITORY / "networks" / "crossing").stripes
