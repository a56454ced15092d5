"""The families of tests that follow from a campaign, and how `harness check` lists them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from harness.campaign.plan.paper_rounds import questions
from harness.config.campaign import Campaign
from harness.evaluation.planned_tests import Family, families


def planned_families(campaign: Campaign, personas: Sequence[str], tunable: bool = False) -> tuple[Family, ...]:
    """The families of Holm's correction, before any outcome is known; `tunable` as in `plan`."""
    return families(questions(campaign, personas, tunable))


def family_lines(families: Sequence[Family]) -> Iterator[str]:
    """A line for each family of Holm's correction: its tests, and their training seeds."""
    for family in families:
        tests = ", ".join(dict.fromkeys(f"{test.question} {test.persona}" for test in family.tests))
        seeds = list(dict.fromkeys(str(seed) for test in family.tests for seed in test.seeds))
        each = "each by itself" if len(family.tests[0].seeds) == 1 else "together"
        trainings = f"training seeds {', '.join(seeds)} {each}" if len(seeds) > 1 else f"training seed {seeds[0]}"
        size = f"{len(family.tests)} test{'' if len(family.tests) == 1 else 's'}"
        yield f"Holm's correction over {size} about {family.about.value}: {tests} ({trainings})"


def family_records(families: Sequence[Family]) -> list[dict[str, object]]:
    """A record for each family, as `family_lines` tells it."""
    return [
        {
            "about": family.about.value,
            "tests": [
                {"question": test.question, "persona": test.persona, "seeds": list(test.seeds)} for test in family.tests
            ],
        }
        for family in families
    ]
