"""What counts as prevented by a reference driver in the ego's seat."""

from __future__ import annotations

import pytest

from harness.campaign.execution.preventability_stage import outcome_of
from harness.evaluation.rule_book.thresholds import WRONG_WAY_LEAST_S


@pytest.mark.parametrize(
    ("cells", "expected"),
    [
        ({}, "goal"),
        ({"ego_red_lights": 0.0, "ego_wrong_way_s": 0.0}, "goal"),
        ({"ego_red_lights": None, "ego_wrong_way_s": None}, "goal"),
        ({"ego_red_lights": 1.0, "ego_wrong_way_s": 0.0}, "on_red"),
        ({"ego_red_lights": 0.0, "ego_wrong_way_s": WRONG_WAY_LEAST_S}, "wrong_way"),
        ({"ego_outcome": "collision", "ego_red_lights": 1.0}, "collision"),
    ],
)
def test_outcome__a_goal_by_breaking_a_rule_is_not_one(cells: dict[str, object], expected: str) -> None:
    assert outcome_of({"ego_outcome": "goal", **cells}) == expected
