"""The policies that a campaign reads instead of training: found, and checked against its personas.

A policy's folder is that of another run, or it has a driver document, `driver.toml`: a policy that others trained, on
`harness/NonEgo-v0` or with both players in `ParallelDrivingEnv`, drives as the person or ego of that name.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path

from harness.campaign.plan.stages import ConditioningStage, Stage
from harness.config.campaign import Campaign
from harness.config.persona import Persona
from harness.config.toml_reading import nearest
from harness.drivers.car import Car, car_of
from harness.drivers.external import ExternalDriver, find_driver
from harness.drivers.policy_file import Policy, check_no_archive, persona_hash, policy_files, read_policy
from harness.drivers.policy_of_many import personas_in, read_policy_of_many
from harness.drivers.policy_origin import other_games
from harness.errors import Problem, UsageError, collect
from harness.evaluation.strategies import name_and_seed
from harness.game.roles import EGO, NON_EGO, ROLES
from harness.road.scene.open_scene import OpenScene
from harness.shipped_documents import find_document, shipped_names

DRIVER = "driver.toml"
"""The driver document in the folder of a policy that others trained, or of a search."""
_ANOTHER = "train it again, or use the persona it was trained with"


def find_policies(file: Path, written: str | None, exist: bool = True) -> Path | None:
    """The folder of policies that a campaign names. Raises UsageError if there is none although it should `exist`."""
    if written is None:
        return None
    folder = find_document(written, file.parent, "policies")
    check_no_archive(file, "policies", written, folder)
    if exist and not os.path.isdir(folder):
        beside = f"there is no folder {folder.parent}"
        if "/" not in written:
            beside = nearest(written, shipped_names("policies"))
        elif os.path.isdir(folder.parent):
            beside = nearest(
                folder.name, [each.name for each in folder.parent.iterdir() if each.is_dir()] or ["(no folder)"]
            )
        remedy = f"name one laid out as <run>/policies/; {beside}"
        raise UsageError.of(file, "policies", f"{written!r}: there is no such folder", remedy)
    return folder


def check_policies(
    file: Path,
    *,
    document: Campaign,
    ego_persona: Persona,
    personas: Sequence[Persona],
    stages: Sequence[Stage],
    folder: Path,
    scene: OpenScene,
    allow_code: bool,
    elsewhere: dict[str, str],
) -> tuple[list[Path], dict[str, ExternalDriver]]:
    """The files of every policy that the stages of a campaign read, and the policies of others by the name of their
    folder. `personas`: every persona that drives as a non-ego.

    Raises UsageError for each that is missing or does not fit, and for each that runs code in files without permission
    (`allow_code`). How the games differ in which a policy learned is added to `elsewhere`, by its name.
    """
    available = {each.name for each in folder.iterdir() if each.is_dir()}
    by_name = {each.name: each for each in personas}
    problems: list[Problem] = []
    files: list[Path] = []
    drivers: dict[str, ExternalDriver] = {}
    of_many: dict[str, list[str]] = {}
    for stage in stages:
        if isinstance(stage, ConditioningStage):
            of_many.setdefault(stage.of.stage, []).append(stage.persona)
    for name in dict.fromkeys(name for stage in stages for name in stage.reads):
        place = folder / name / DRIVER
        person = by_name.get(name_and_seed(name)[0])
        player = EGO if person is None else NON_EGO
        if name not in available:
            message = f"{document.policies!r} holds no policy {name!r}"
            problems.append(Problem(str(file), "policies", message, _alternatives(name, available)))
        elif place.is_file():
            sampled = (person or ego_persona).decisions == "sampled"
            car = car_of(scene.world, player)
            driver = collect(problems, partial(_find_and_try, place, allow_code, car, sampled))
            if driver is not None:
                drivers[name] = driver
                files += [place, *map(Path, driver.files)]
        else:
            is_of_many = name in of_many
            player = NON_EGO if is_of_many else player
            policy = collect(problems, partial(read_policy_of_many if is_of_many else read_policy, folder / name))
            if policy is not None and is_of_many:
                problems += _problems_of_many(policy, folder / name, of_many[name], by_name)
            if policy is not None:
                problems += _problems_of(policy, folder / name, ego_persona, by_name)
                origin = partial(other_games, folder / name, scene.document, scene.world, player=player)
                if words := collect(problems, origin):
                    elsewhere[name] = words
            files += policy_files(folder / name)
    if problems:
        raise UsageError(problems)
    return files, drivers


def _find_and_try(place: Path, allow_code: bool, car: Car, sampled: bool) -> ExternalDriver:
    driver = find_driver(place.name, place, "", allow_code)
    if driver.vehicle_type is not None:
        message, remedy = "SUMO's models are no policy", "name them as the ego: [ego] driver"
        raise UsageError.of(place, "kind", message, remedy)
    driver.try_out(car, sampled)
    return driver


def _problems_of(
    policy: Policy, folder: Path, ego_persona: Persona, personas: Mapping[str, Persona]
) -> Iterable[Problem]:
    card = policy.card
    if (stage := card.get("stage")) != folder.name:
        message = f"was learned as {stage!r}, but is called {folder.name!r}"
        yield Problem(str(folder), "stage", message, "give the folder its policy's name")
    name = card.get("persona")
    persona = ego_persona if card.get("player") == ROLES[EGO] else personas.get(str(name))
    sha256 = card.get("persona_sha256")
    if persona is not None and (message := learned_by_another(name, sha256, persona, "the campaign's")):
        yield Problem(str(folder), "persona_sha256", message, _ANOTHER)


def _problems_of_many(
    policy: Policy, folder: Path, names: Iterable[str], personas: Mapping[str, Persona]
) -> Iterable[Problem]:
    hashes = personas_in(dict(policy.card))
    for name in names:
        if name not in hashes:
            yield Problem(str(folder), "personas", f"is no policy of {name!r}", nearest(name, list(hashes)))
        elif message := learned_by_another(name, hashes[name], personas[name], "the campaign's"):
            yield Problem(str(folder), "personas", message, _ANOTHER)


def learned_by_another(name: object, sha256: object, persona: Persona, whose: str) -> str:
    """How a policy learned that was learned by a persona of this name and hash, if that is not the persona; empty if it
    is. `whose` persona this is, in words."""
    if sha256 == persona_hash(persona):
        return ""
    return f"was learned by {name!r} with another payoff or limits than {whose} {persona.name!r} has"


def _alternatives(missing: str, available: Iterable[str]) -> str:
    """A remedy for a missing policy: the seeds that its stage has, or the stages that exist."""
    stage, _ = name_and_seed(missing)
    parts = [name_and_seed(each) for each in available]
    if seeds := sorted(seed for name, seed in parts if name == stage and seed is not None):
        return f"there is {stage!r} of seed {', '.join(map(str, seeds))}"
    return nearest(stage, {name for name, _ in parts if name} or ["(no policy at all)"])
