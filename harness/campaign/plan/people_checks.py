"""Checks a campaign against the number of people in its scene."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from harness.config.campaign import Campaign, Rounds
from harness.errors import Problem, UsageError


def check_people(file: Path, document: Campaign, people: int) -> None:
    """Raises UsageError for everything in a campaign that does not fit a scene with this number of people."""
    found = _several(document, people) if people > 1 else _one(document)
    problems = [Problem(str(file), *each) for each in found]
    if problems:
        raise UsageError(problems)


def _one(document: Campaign) -> Iterator[tuple[str, str, str]]:
    for k, _ in enumerate(document.crowd):
        remedy = "give the scene more [[non_ego]], or name a [[population]]"
        yield f"crowd[{k}]", "the scene has one person, and a crowd is of several", remedy


def _several(document: Campaign, people: int) -> Iterator[tuple[str, str, str]]:
    for k, crowd in enumerate(document.crowd):
        if len(crowd.personas) != people:
            message = f"{len(crowd.personas)} personas, and the scene has {people} people"
            yield f"crowd[{k}].personas", message, f"name {people} personas; a name may repeat"
    remedy = "leave it out, or take a scene with one [non_ego]"
    of_two = f"is about games of two players, and the scene has {people} people"
    if document.best_response is not None:
        yield "best_response", of_two, remedy
    if document.crossplay is not None:
        yield "crossplay", of_two, remedy
    if document.rounds.count > Rounds().count:
        yield "rounds.count", of_two, remedy
    for k, _ in enumerate(document.population):
        message = f"a population is one person for each game, and the scene has {people}"
        yield f"population[{k}]", message, "give a [[crowd]] with a persona for each of them"
    if document.policies is None and document.training.games < people:
        message = f"{document.training.games} games at once, and a person learns in {people} places"
        yield "training.games", message, f"give at least {people}"
