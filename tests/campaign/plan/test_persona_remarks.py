"""Payoffs that do not suit a scene, said before anything is trained."""

from __future__ import annotations

import pytest

from harness.campaign.plan.persona_remarks import crash_cost, ego_persona_remarks, persona_remarks, waiting_cost
from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.road.scene.open_scene import open_scene
from tests.support.repository import REPOSITORY


def shipped(name: str) -> Persona:
    return read_document(REPOSITORY / "personas" / f"{name}.toml", Persona)


def test_waiting_cost__is_the_discounted_sum_over_the_steps() -> None:
    world = open_scene(REPOSITORY / "networks" / "red_light").world
    by_hand = sum(
        0.8 * world.step_s * 0.99**step for step in range(world.steps)
    )  # 0.8 per second: the hurry of `speedy`
    assert waiting_cost(shipped("speedy"), world, 0.99) == pytest.approx(by_hand)
    assert waiting_cost(shipped("speedy"), world, 1.0) == pytest.approx(0.8 * world.time_limit_s)
    # time_pressure 0.5 and speed_under_limit 1 a second; nothing for speeding
    assert waiting_cost(shipped("impatient"), world, 1.0) == pytest.approx(1.5 * world.time_limit_s)
    assert crash_cost(shipped("speedy")) == 20.0


@pytest.mark.parametrize(
    ("scene", "persona", "remark"),
    [
        ("merge", "paper_speedy", "warning: paper_speedy: a crash costs 5, and standing for long behind somebody 7.86"),
        ("merge", "speedy", None),
        (
            "left_across",
            "late_merger",
            "warning: late_merger: queueing asks how far the lane goes on, and no lane of its",
        ),
        ("merge", "late_merger", None),  # the acceleration lane ends
    ],
)
def test_remarks__name_the_payoff_and_the_remedy(scene: str, persona: str, remark: str | None) -> None:
    found = persona_remarks([shipped(persona)], open_scene(REPOSITORY / "networks" / scene).world, 0.99)
    if remark is None:
        assert found == []
    else:
        (found_one,) = found
        assert found_one.startswith(remark)
        assert found_one.split(". ")[1].startswith(("Raise", "Choose"))


def test_remarks__an_ego_takes_no_limits_of_its_persona() -> None:
    assert ego_persona_remarks(shipped("careful")) == []
    (remark,) = ego_persona_remarks(shipped("drowsy"))
    assert remark.startswith("warning: ego.persona: drowsy has [attention] and [reaction], without effect")
