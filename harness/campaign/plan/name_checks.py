"""Checks the names in a campaign that refer to other parts of it: personas, drivers of the cross-play, arms."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from harness.campaign.plan.plan import plan
from harness.campaign.plan.stages import AssessmentStage
from harness.campaign.plan.strategy_drivers import crossplay_name
from harness.config.campaign import LEARNED, SUMO, Campaign
from harness.config.toml_reading import nearest
from harness.errors import Problem, UsageError
from harness.evaluation.strategies import NaiveEgo, RobustEgo, strategy_name

_TAKEN = (strategy_name(NaiveEgo()), strategy_name(RobustEgo()), SUMO)
"""Names of egos that a driver of the cross-play can't have."""
MOST_LETTERS = 40
"""Of the name of a driver of the cross-play."""
Wrong = Callable[[str, str, str], None]
"""Notes a problem: key, what is wrong, remedy."""


def check_names(file: Path, document: Campaign, personas: Sequence[str], tunable: bool = False) -> None:
    """Raises UsageError for every name that refers to nothing, or to two things; `tunable` as in `plan`."""
    problems: list[Problem] = []

    def wrong(key: str, message: str, remedy: str) -> None:
        problems.append(Problem(str(file), key, message, remedy))

    populations = [each.name for each in document.population]
    for k, each in enumerate(document.population):
        for name in each.shares:
            if name not in personas:
                wrong(f"population[{k}].shares", f"there is no persona {name!r}", nearest(name, personas))
        if each.name in personas or each.name in populations[:k]:
            message = f"{each.name!r} is the name of a persona or of another population"
            wrong(f"population[{k}].name", message, "give it another name")
    crowds = [each.name for each in document.crowd]
    for k, crowd in enumerate(document.crowd):
        for name in dict.fromkeys(crowd.personas):
            if name not in personas:
                wrong(f"crowd[{k}].personas", f"there is no persona {name!r}", nearest(name, personas))
        if crowd.name in (*personas, *populations, *crowds[:k]):
            message = f"{crowd.name!r} is the name of a persona, a population or another crowd"
            wrong(f"crowd[{k}].name", message, "give it another name")
    for key, names in (
        ("retraining.against", document.retraining.against),
        ("rounds.personas", document.rounds.personas),
    ):
        for name in names:
            if name not in personas:
                wrong(key, f"there is no persona {name!r}", nearest(name, personas))
    if len(set(document.retraining.against)) < len(document.retraining.against):
        wrong("retraining.against", "a persona is named twice", "name each once")
    _check_other_egos(document, wrong)
    if not problems and document.best_response is not None:
        _check_arms(document, personas, tunable, wrong)
    if problems:
        raise UsageError(problems)


def _check_other_egos(document: Campaign, wrong: Wrong) -> None:
    written = document.crossplay.egos if document.crossplay is not None else []
    names = [crossplay_name(each) for each in written]
    for driver, name in zip(written, names, strict=True):
        if driver == LEARNED:
            wrong("crossplay.egos", "the learned egos always take part", "leave it out")
        elif driver == document.ego.driver:
            wrong("crossplay.egos", f"{driver!r} is the campaign's ego, which always takes part", "leave it out")
        elif names.count(name) > 1:
            wrong("crossplay.egos", f"two drivers are called {name!r}", "rename a file, or leave one out")
        elif len(name) > MOST_LETTERS:
            message = f"{name[:MOST_LETTERS]!r}… is longer than {MOST_LETTERS} letters"
            wrong("crossplay.egos", message, "rename its file or folder")
        elif driver != SUMO and name in _TAKEN:
            wrong("crossplay.egos", f"{driver!r} would be called {name!r}", "rename its file or folder")


def _check_arms(document: Campaign, personas: Sequence[str], tunable: bool, wrong: Wrong) -> None:
    assert document.best_response is not None
    arms = {stage.name: stage for stage in plan(document, personas, tunable) if isinstance(stage, AssessmentStage)}
    pairs = [name for name, stage in arms.items() if stage.is_pair]
    for name in document.best_response.arms:
        if name not in pairs:
            message = f"{name!r} is no arm of an ego and a persona" if name in arms else f"there is no arm {name!r}"
            wrong("best_response.arms", message, nearest(name, pairs))
