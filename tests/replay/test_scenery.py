"""The texts of a replay: the labels of contacts and the title do not lie over one another."""

from __future__ import annotations

from itertools import combinations

import pytest

from harness.replay.contacts import Contact
from harness.replay.gui_settings import Viewport
from harness.replay.scenery import scenery

VIEW = Viewport(x_m=0.0, y_m=0.0, width_m=120.0, height_m=43.0)


@pytest.mark.parametrize("y_m", [-15.0, 0.0, 6.0, 9.3, 12.0, 15.0])
def test_scenery__labels_of_two_contacts_and_the_title_are_apart(y_m: float) -> None:
    touches = [Contact(time_s=1.0, x_m=3.0, y_m=y_m, label=f"collision {number}") for number in range(2)]
    document = scenery(types={}, rails=[], touches=touches, view=VIEW, title="a long title")
    heights = [float(each.get("y", "nan")) for each in document.iter("poi")]
    assert len(heights) == 3
    assert min(abs(one - other) for one, other in combinations(heights, 2)) >= 0.05 * VIEW.height_m
