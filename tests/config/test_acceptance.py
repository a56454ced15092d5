"""The table [acceptance] of a campaign: what can't be judged is refused when the file is read."""

from __future__ import annotations

from typing import Any

import pytest

from harness.config.campaign import Acceptance, Campaign

CAMPAIGN: dict[str, Any] = {"name": "tiny", "scene": "merge", "personas": ["speedy"]}


def test_bounds__are_the_keys_that_are_given() -> None:
    assert Acceptance(failure_rate=0.1, speed_loss_mps=1.0).bounds == {"failure_rate": 0.1, "speed_loss_mps": 1.0}


@pytest.mark.parametrize(
    ("table", "more", "words"),
    [
        ({}, {}, "no bound is given"),
        ({"ego": "naive"}, {}, "no bound is given"),
        ({"gap_share": 0.1}, {}, "without [best_response], no gap is measured"),
        ({"preventable_failure_rate": 0.1}, {"assessment": {"reference_drivers": False}}, "is not judged"),
        ({"failure_rate": 1.5}, {}, "less than or equal to 1"),
    ],
)
def test_campaign__refuses_a_bound_that_can_not_be_judged(
    table: dict[str, Any], more: dict[str, Any], words: str
) -> None:
    with pytest.raises(ValueError, match=words.replace("[", r"\[")):
        Campaign.model_validate({**CAMPAIGN, **more, "acceptance": table})
