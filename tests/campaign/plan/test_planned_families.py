"""The families of planned tests."""

from __future__ import annotations

import pytest

from harness.campaign.plan.planned_families import planned_families
from harness.evaluation.planned_tests import About
from tests.support.plans import campaign_of


@pytest.mark.parametrize(
    ("seeds", "of_pairs", "over"), [([1], 6, 0), ([1, 2], 12, 0), ([1, 2, 3], 18, 6), ([4, 1, 2, 3], 24, 6)]
)
def test_families__are_those_of_the_plan(seeds: list[int], of_pairs: int, over: int) -> None:
    personas = ["anna", "bert", "carl"]
    found = planned_families(campaign_of(*personas, seeds=seeds), personas)
    sizes = {About.TRAINED_PAIR: of_pairs, About.TRAININGS: over}
    assert {each.about: len(each.tests) for each in found} == {about: size for about, size in sizes.items() if size}
    for family in found:
        expected = tuple(seeds) if family.about is About.TRAININGS else None
        assert {expected or each.seeds for each in family.tests} == {each.seeds for each in family.tests}
        assert {(each.question, each.persona) for each in family.tests} == {
            (question, persona) for question in ("RQ1", "RQ2") for persona in personas
        }


def test_families__of_an_ego_that_does_not_learn_have_its_only_question() -> None:
    campaign = campaign_of("anna", seeds=[1, 2, 3], ego={"driver": "sumo"})
    pairs, over = planned_families(campaign, ["anna"])
    assert [(each.question, each.persona, each.seeds) for each in over.tests] == [("RQ1", "anna", (1, 2, 3))]
    assert len(pairs.tests) == 3
