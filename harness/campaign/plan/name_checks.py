"""Names in a campaign that mean other parts of it: personas of populations and retrainings, arms of best responses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from harness.campaign.plan.best_responses import is_pair
from harness.campaign.plan.plan import name_of, plan
from harness.campaign.plan.stages import AssessmentStage
from harness.config.campaign import LEARNED, ROBUST, SUMO, Campaign
from harness.config.toml_reading import nearest
from harness.errors import Problem, UsageError

Wrong = Callable[[str, str, str], None]
"""Notes a problem: key, what is wrong, remedy."""


def check_names(file: Path, document: Campaign, personas: Sequence[str], tunable: bool = False) -> None:
    """Raises UsageError for every name that means nobody, or two at once; `tunable` as in `plan`."""
    problems: list[Problem] = []

    def wrong(key: str, message: str, remedy: str) -> None:
        problems.append(Problem(str(file), key, message, remedy))

    for k, each in enumerate(document.population):
        for name in each.shares:
            if name not in personas:
                wrong(f"population[{k}].shares", f"there is no persona {name!r}", nearest(name, personas))
        if each.name in personas or each.name in [other.name for other in document.population[:k]]:
            wrong(f"population[{k}].name", f"{each.name!r} is called something else too", "give it a name of its own")
    for key, names in (
        ("retraining.against", document.retraining.against),
        ("rounds.personas", document.rounds.personas),
    ):
        for name in names:
            if name not in personas:
                wrong(key, f"there is no persona {name!r}", nearest(name, personas))
    if len(set(document.retraining.against)) < len(document.retraining.against):
        wrong("retraining.against", "a persona stands twice", "name each once")
    _check_other_egos(document, wrong)
    if not problems and document.best_response is not None:
        _check_arms(document, personas, tunable, wrong)
    if problems:
        raise UsageError(problems)


def _check_other_egos(document: Campaign, wrong: Wrong) -> None:
    written = document.crossplay.egos if document.crossplay is not None else []
    names = [name_of(each) for each in written]
    for driver, name in zip(written, names, strict=True):
        if driver == LEARNED:
            wrong("crossplay.egos", "the learned egos are there anyway", "leave it out")
        elif driver == document.ego.driver:
            wrong("crossplay.egos", f"{driver!r} is the campaign's ego, which is there anyway", "leave it out")
        elif names.count(name) > 1:
            wrong("crossplay.egos", f"two drivers are called {name!r}", "rename a file, or leave one out")
        elif driver != SUMO and name in ("naive", ROBUST, SUMO):
            wrong("crossplay.egos", f"{driver!r} would be called {name!r}", "rename its file or folder")


def _check_arms(document: Campaign, personas: Sequence[str], tunable: bool, wrong: Wrong) -> None:
    assert document.best_response is not None
    arms = {stage.arm: stage for stage in plan(document, personas, tunable) if isinstance(stage, AssessmentStage)}
    pairs = [name for name, stage in arms.items() if is_pair(stage)]
    for name in document.best_response.arms:
        if name not in pairs:
            message = f"{name!r} is no arm of an ego and a persona" if name in arms else f"there is no arm {name!r}"
            wrong("best_response.arms", message, nearest(name, pairs))
