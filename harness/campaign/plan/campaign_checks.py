"""Checks of a campaign against what it names: personas, drivers of the cross-play, arms, people of its scene."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TypeAlias

from harness.campaign.plan.plan import plan
from harness.campaign.plan.stages import AssessmentStage
from harness.campaign.plan.strategy_stages import crossplay_name
from harness.config.campaign import LEARNED, SHIPPED, SUMO, Campaign, Rounds
from harness.config.toml_reading import nearest
from harness.config.training import Retraining
from harness.config.traits import PersonTraits
from harness.errors import Problem, UsageError
from harness.evaluation.strategies import NaiveEgo, RobustEgo, strategy_name

_TAKEN = (strategy_name(NaiveEgo()), strategy_name(RobustEgo()), SUMO)
"""Names of egos that a driver of the cross-play can't have."""
MOST_LETTERS = 40
"""Of the name of a driver of the cross-play."""
_Found: TypeAlias = Iterator[tuple[str, str, str]]
"""Key, what is wrong, remedy."""


def check_campaign(
    file: Path,
    document: Campaign,
    personas: Sequence[str],
    tunable: bool,
    traits: PersonTraits,
    *,
    people: int,
    alike: Sequence[bool],
) -> None:
    """Raises UsageError with every mistake of a campaign about what it names: what does not fit a scene with this
    number of people, or the `roads` on which its egos learn too; names that refer to nothing, or to two things; a
    baseline with which nothing can be compared.

    `alike` says of each road whether its players and steps are those of the scene; `tunable`, `traits` as in `plan`.
    Arms and stages are checked where the rest is right: only then is there a plan.
    """
    of_scene = (*_people(document, people), *_places(document, people), *_roads(document, alike))
    _refuse(file, (*of_scene, *_personas(document, personas, traits), *_other_egos(document), *_baseline(traits)))
    _refuse(file, (*_arms(document, personas, tunable), *_stages(document, personas, tunable, traits)))


def _refuse(file: Path, found: Sequence[tuple[str, str, str]]) -> None:
    if problems := [Problem(str(file), *each) for each in found]:
        raise UsageError(problems)


def _people(document: Campaign, people: int) -> _Found:
    for k, crowd in enumerate(document.crowd):
        if len(crowd.personas) != people:
            message = f"{len(crowd.personas)} personas, and people of the scene: {people}"
            yield f"crowd[{k}].personas", message, f"name {people}; a name may repeat. [[population]] draws one"
    of_two = {
        "best_response": document.best_response is not None,
        "crossplay": document.crossplay is not None,
        "rounds.count": document.rounds.count > Rounds().count,
    }
    for key in (key for key, given in of_two.items() if given and people > 1):
        message = f"is about games of two players, and the scene has {people} people"
        yield key, message, "leave it out, or take a scene with one [[non_ego]]"


def _roads(document: Campaign, alike: Sequence[bool]) -> _Found:
    if not alike:
        return
    if document.policies is not None or document.ego.driver != LEARNED:
        yield "roads", "no ego is trained", "leave out this key, or train the ego"
    if document.retraining.starts != Retraining().starts:
        yield "retraining.starts", "regret is measured on one road", "leave out this key or `roads`"
    for written, is_alike in zip(document.roads, alike, strict=True):
        if not is_alike:
            message = f"{written!r}: its players, or the length of its steps, are not those of the scene"
            yield "roads", message, "name scenes with the same players, as `harness scene vary` makes of this one"


def _places(document: Campaign, people: int) -> _Found:
    """Fewer games at once than places in which a player learns."""
    if document.policies is not None:
        return
    needed = {f"a person learns in {people} places": people}
    if document.ego.driver == LEARNED:
        against = document.retraining.against
        roads, beside_sumo = len(document.roads) + 1, SUMO in against and len(against) > 1
        too = ", on each beside SUMO's driver too" if beside_sumo else ""
        needed[f"an ego learns on {roads} road{'s' * (roads > 1)}{too}"] = roads * (2 if beside_sumo else 1)
    reason, least = max(needed.items(), key=lambda each: each[1])
    if document.training.games < least:
        yield "training.games", f"{document.training.games} games at once, and {reason}", f"give at least {least}"


def _personas(document: Campaign, personas: Sequence[str], traits: PersonTraits) -> _Found:
    named = {f"population[{k}].shares": list(each.shares) for k, each in enumerate(document.population)}
    named |= {f"crowd[{k}].personas": list(dict.fromkeys(each.personas)) for k, each in enumerate(document.crowd)}
    named |= {"retraining.against": document.retraining.against, "rounds.personas": document.rounds.personas}
    for key, names in named.items():
        known = [*personas, SUMO, SHIPPED] if key == "retraining.against" else personas
        for name in names:
            if name not in known:
                yield key, f"there is no persona {name!r}", nearest(name, known)
    for name in {SUMO, SHIPPED} & {*personas} & {*document.retraining.against}:
        yield "retraining.against", f"{name!r} is the name of a persona, too", "give the persona another name"
    taken = [*personas, traits.baseline]
    mixed = [(f"population[{k}]", each.name) for k, each in enumerate(document.population)]
    mixed += [(f"crowd[{k}]", each.name) for k, each in enumerate(document.crowd)]
    for table, name in mixed:
        if name in taken:
            message = f"{name!r} is the name of a persona or of the baseline, or of another population or crowd"
            yield f"{table}.name", message, "give it another name"
        taken.append(name)
    if len(set(document.retraining.against)) < len(document.retraining.against):
        yield "retraining.against", "a persona is named twice", "name each once"


def _baseline(traits: PersonTraits) -> _Found:
    if traits.baseline and not traits.differing:
        message = f"no persona of the campaign differs from {traits.baseline!r}: there is nothing to compare"
        yield "attribution.baseline", message, "name another persona, or leave out [attribution]"


def _other_egos(document: Campaign) -> _Found:
    written = document.crossplay.egos if document.crossplay is not None else []
    names = [crossplay_name(each) for each in written]
    for driver, name in zip(written, names, strict=True):
        if driver == LEARNED:
            yield "crossplay.egos", "the learned egos always take part", "leave it out"
        elif driver == document.ego.driver:
            yield "crossplay.egos", f"{driver!r} is the campaign's ego, which always takes part", "leave it out"
        elif names.count(name) > 1:
            yield "crossplay.egos", f"two drivers are called {name!r}", "rename a file, or leave one out"
        elif len(name) > MOST_LETTERS:
            message = f"{name[:MOST_LETTERS]!r}… is longer than {MOST_LETTERS} letters"
            yield "crossplay.egos", message, "rename its file or folder"
        elif driver != SUMO and name in _TAKEN:
            yield "crossplay.egos", f"{driver!r} would be called {name!r}", "rename its file or folder"


def _arms(document: Campaign, personas: Sequence[str], tunable: bool) -> _Found:
    if document.best_response is None:
        return
    arms = {stage.name: stage for stage in plan(document, personas, tunable) if isinstance(stage, AssessmentStage)}
    pairs = [name for name, stage in arms.items() if stage.is_pair]
    for name in document.best_response.arms:
        if name not in pairs:
            message = f"{name!r} is no arm of an ego and a persona" if name in arms else f"there is no arm {name!r}"
            yield "best_response.arms", message, nearest(name, pairs)


def _stages(document: Campaign, personas: Sequence[str], tunable: bool, traits: PersonTraits) -> _Found:
    """Stages are named after personas: two of them may have the same name."""
    stages: dict[str, list[str]] = {}
    for stage in plan(document.model_copy(update={"policies": None}), personas, tunable, traits):
        stages.setdefault(stage.id, []).append(stage.persona)
    clashes = {tuple(sorted(filter(None, of))): name for name, of in stages.items() if len(of) > 1}
    for of, name in clashes.items():
        message = f"two stages would be called {name!r}, by persona {' and '.join(map(repr, of))}"
        yield "personas", message, "give the persona another name"
