"""Preflight: every document that a campaign names is read and checked before anything runs.

All problems are collected and reported at once. What can be checked without one another is checked even where a
document has problems of its own.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from harness.campaign.campaign_players import CampaignPlayers
from harness.campaign.plan.campaign_checks import check_campaign
from harness.campaign.plan.plan import plan
from harness.campaign.plan.stages import Stage
from harness.campaign.plan.strategy_stages import crossplay_name
from harness.campaign.shipped_people import ShippedPerson, shipped_people
from harness.campaign.trained_policies import check_policies, find_policies
from harness.config.campaign import LEARNED, SHIPPED, SUMO, Campaign
from harness.config.campaign_names import CampaignNames
from harness.config.ego_perception import EgoPerception
from harness.config.persona import Persona
from harness.config.toml_reading import D, Document, read_document
from harness.config.traits import traits_of
from harness.drivers import car, driver_files, policy_origin
from harness.drivers.external import ExternalDriver, find_driver
from harness.errors import Problem, UsageError, collect
from harness.game.roles import EGO
from harness.road.scene.load_check import check_loads
from harness.road.scene.open_scene import OpenScene, open_scene
from harness.shipped_documents import PACKAGE, Kind, named_document

QUICK_STEPS = 262_144
QUICK_SEGMENT_STEPS = 65_536
QUICK_TRIALS = 12
QUICK_RESPONSE_STEPS = 131_072


@dataclass(frozen=True, kw_only=True)
class OpenCampaign(CampaignPlayers):
    """A campaign whose documents are all read and checked."""

    file: Path
    quick: bool
    scene: OpenScene
    roads: tuple[OpenScene, ...]
    """The scenes on whose roads the egos learn too."""
    personas: tuple[Persona, ...]
    baseline: Persona | None
    """The careful person of `[attribution]`; it may be one of the personas."""
    learned_elsewhere: dict[str, str]
    """Policies that learned in other games than the campaign's: how the games differ, in words."""
    hashes: dict[str, str]
    """SHA-256 of every file that the campaign rests on, by its path from the campaign's folder."""

    @property
    def run_name(self) -> str:
        """The name of its run folder in `reports/`."""
        return self.document.name + ("-quick" if self.quick else "")

    @property
    def tunable(self) -> bool:
        return _is_tunable(self.ego_driver)

    @property
    def stages(self) -> list[Stage]:
        """Every stage of its plan, each after those it needs."""
        names = [persona.name for persona in self.personas]
        return plan(self.document, names, self.tunable, traits_of(self.personas, self.baseline))

    def hash_of(self, path: Path) -> str:
        return self.hashes[_relative(self.file, path)]

    def hashes_of(self, scene: OpenScene) -> dict[str, str]:
        """SHA-256 of the files of one of its scenes, by name."""
        return {name: self.hash_of(scene.folder / name) for name in scene.document.files}


def open_campaign(
    file: Path, quick: bool = False, allow_code: bool = False, policies_exist: bool = True
) -> OpenCampaign:
    """Read a campaign and everything it names. Raises UsageError with every problem found.

    `quick` shortens trainings and searches; a campaign without any is the same with it. `allow_code` permits an
    external driver that is code from a file to run (`drivers.external` says why a document can't give this permission).
    Without `policies_exist`, the policies that the campaign plays are left unread: another campaign is to make them.
    """
    problems: list[Problem] = []
    document = collect(problems, lambda: read_document(file, Campaign))
    named = document or collect([], lambda: read_document(file, CampaignNames))
    if named is None:
        raise UsageError(problems)
    driver = named.ego.driver
    ego_driver = None
    if driver not in (LEARNED, SUMO):
        ego_driver = collect(problems, lambda: find_driver(driver, file, "ego.driver", allow_code))
    vehicle_type = ego_driver.vehicle_type if ego_driver is not None else None
    scene = collect(problems, lambda: _open_named(file, "scene", named.scene, vehicle_type))
    roads = [collect(problems, partial(_open_named, file, "roads", each)) for each in named.roads]
    written = [("ego.persona", named.ego.persona), *(("personas", each) for each in named.personas)]
    if named.attribution is not None:
        written.append(("attribution.baseline", named.attribution.baseline))
    named_files: list[Path] = []
    found = [
        collect(problems, partial(_read_named, file, key, name, "personas", Persona, named_files))
        for key, name in written
    ]
    ego_persona, *personas = found
    if isinstance(errors := named.ego.perception, str):
        perception = collect(
            problems, lambda: _read_named(file, "ego.perception", errors, "perception", EgoPerception, named_files)
        )
        if document is not None and perception is not None:
            document = document.model_copy(update={"ego": document.ego.model_copy(update={"perception": perception})})
    baseline = personas.pop() if named.attribution is not None else None
    elsewhere: dict[str, str] = {}
    if ego_driver is not None and scene is not None:
        collect(problems, partial(_note_origin, ego_driver, scene, ego_persona, elsewhere))
        sampled = ego_persona is not None and ego_persona.decisions == "sampled"
        games, road = _games_at_once(document, ego_driver), lambda: scene.cartesian_roads[EGO]
        collect(problems, lambda: ego_driver.try_out(car.car_of(scene.world, EGO), sampled, games, road=road))
    other_egos: dict[str, ExternalDriver] = {}
    if document is not None:
        problems += _ignored_tables(file, document, ego_driver)
        other_egos = _find_other_egos(file, document, scene, allow_code=allow_code, problems=problems)
        if scene is not None:
            for each in other_egos.values():
                collect(problems, partial(_note_origin, each, scene, ego_persona, elsewhere))
    policies = collect(problems, lambda: find_policies(file, named.policies, policies_exist))
    problems += _same_names(file, named.personas, personas, baseline)
    opened = [each for each in roads if each is not None]
    if not problems and scene is not None:
        for each_scene in (scene, *opened):
            collect(problems, partial(check_loads, each_scene))
    if problems or document is None or scene is None or ego_persona is None:
        raise UsageError(problems)
    read = [each for each in personas if each is not None]
    tunable, traits, names = _is_tunable(ego_driver), traits_of(read, baseline), [persona.name for persona in read]
    people, alike = len(scene.document.non_ego), [_game_of(each) == _game_of(scene) for each in opened]
    check_campaign(file, document, names, tunable, traits, people=people, alike=alike)
    shipped = _shipped_people(file, document, (scene, *opened))
    persons = {each.name: each for each in (*read, baseline) if each is not None}
    files, policy_drivers = list[Path](), dict[str, ExternalDriver]()
    if policies is not None and policies_exist:
        files, policy_drivers = check_policies(
            file,
            document=document,
            ego_persona=ego_persona,
            personas=list(persons.values()),
            stages=plan(document, names, tunable, traits),
            folder=policies,
            scene=scene,
            allow_code=allow_code,
            elsewhere=elsewhere,
        )
    scene_files = (each.folder / name for each in (scene, *opened) for name in each.document.files)
    shipped_files = (each for of_scene in shipped.values() for person in of_scene for each in person.files)
    files = [file, *files, *named_files, *scene_files, *shipped_files]
    for external in (ego_driver, *other_egos.values()):
        files += map(Path, external.files if external is not None else ())
    quick = quick and (policies is None or tunable)
    return OpenCampaign(
        file=file,
        document=_quickened(document) if quick else document,
        quick=quick,
        scene=scene,
        roads=tuple(opened),
        shipped=shipped,
        ego_persona=ego_persona,
        people=persons,
        personas=tuple(read),
        baseline=baseline,
        ego_driver=ego_driver,
        policies=policies,
        other_egos=other_egos,
        policy_drivers=policy_drivers,
        learned_elsewhere=dict(policy_origin.grouped(elsewhere)),
        hashes={_relative(file, each): driver_files.sha256_of(each) for each in files},
    )


def _note_origin(driver: ExternalDriver, scene: OpenScene, persona: Persona | None, elsewhere: dict[str, str]) -> None:
    """Add to `elsewhere` how the games in which an ego's policy learned differ. Raises UsageError as `other_games`."""
    if driver.document is None and (
        words := policy_origin.other_games(driver.place, scene.document, scene.world, player=EGO, persona=persona)
    ):
        elsewhere[driver.written] = words


def _is_tunable(driver: ExternalDriver | None) -> bool:
    return driver is not None and bool(driver.searched)


def _open_named(file: Path, key: str, written: str, vehicle_type: str | None = None) -> OpenScene:
    """A scene that a campaign names. Raises UsageError if it is missing or wrong."""
    return open_scene(named_document(written, "networks", file, key), vehicle_type)


def _game_of(scene: OpenScene) -> tuple[object, ...]:
    """What all roads of a campaign have in common."""
    return scene.world.roles, scene.world.walks.tolist(), scene.world.step_s


def _read_named(file: Path, key: str, written: str, kind: Kind, form: type[D], files: list[Path]) -> D:
    """A document that a campaign names; its file is added to `files`. Raises UsageError if it is missing or wrong."""
    path = named_document(written, kind, file, key)
    document = read_document(path, form)
    files.append(path)
    return document


def _shipped_people(
    file: Path, document: Campaign, scenes: Sequence[OpenScene]
) -> dict[str, tuple[ShippedPerson, ...]]:
    """The shipped people of each of these scenes that has some, where the ego is retrained against them. Raises
    UsageError if none has."""
    if SHIPPED not in document.retraining.against:
        return {}
    found = {each.document.name: people for each in scenes if (people := shipped_people(each.folder))}
    if not found:
        message = f"{SHIPPED!r}: no people are shipped for the scene, nor for one of `roads`"
        raise UsageError.of(file, "retraining.against", message, "name personas, or a shipped scene with people")
    return found


def _relative(campaign_file: Path, path: Path) -> str:
    if path.resolve().is_relative_to(PACKAGE):
        return path.resolve().relative_to(PACKAGE.parent).as_posix()
    return Path(os.path.relpath(path.resolve(), campaign_file.resolve().parent)).as_posix()


def _same_names(
    file: Path, written: Sequence[str], personas: Sequence[Persona | None], baseline: Persona | None
) -> Iterator[Problem]:
    names = [each.name for each in personas if each is not None]
    for path, persona in zip(written, personas, strict=True):
        if persona is not None and names.count(persona.name) > 1:
            message = f"{path!r}: another persona is called {persona.name!r} too"
            yield Problem(str(file), "personas", message, "give each persona a name of its own")
        if persona is not None and baseline is not None and persona.name == baseline.name and persona != baseline:
            message = f"the persona {path!r} is called {persona.name!r} too, and is another one"
            yield Problem(str(file), "attribution.baseline", message, "give the baseline a name of its own")


def _games_at_once(document: Campaign | None, ego_driver: ExternalDriver) -> int:
    if document is None:
        return 1
    search = document.reconfiguration
    return max(
        document.training.games if document.policies is None else 1,
        min(search.games, search.games_at_once) if _is_tunable(ego_driver) else 1,
    )


def _ignored_tables(file: Path, document: Campaign, ego_driver: ExternalDriver | None) -> Iterator[Problem]:
    """A problem for each table and key about another kind of ego than the campaign's."""
    if ego_driver is None and document.ego.driver not in (LEARNED, SUMO):
        return  # the ego's kind is not known
    if ego_driver is not None and ego_driver.vehicle_type is not None:
        by_sumo = f"SUMO drives the ego {document.ego.driver!r}"
        remedy = "leave out this key, or name another ego.driver"
        if document.ego.shield is not None:
            yield Problem(str(file), "ego.shield", f"{by_sumo}, so that there is no decision to check", remedy)
        if document.ego.perception is not None:
            message = f"{by_sumo}, and its driver models know what is there"
            yield Problem(str(file), "ego.perception", message, remedy)
    learned = document.ego.driver == LEARNED
    reasons = {}
    if not _is_tunable(ego_driver):
        reasons["reconfiguration"] = "is trained" if learned else "has nothing to tune"
    if not learned:
        reasons["retraining"] = "is not trained"
    for name, reason in reasons.items():
        if name in document.model_fields_set:
            message = f"this ego {reason}: the table would be ignored"
            yield Problem(str(file), name, message, "leave out this table, or name another ego")


def _find_other_egos(
    file: Path, document: Campaign, scene: OpenScene | None, *, allow_code: bool, problems: list[Problem]
) -> dict[str, ExternalDriver]:
    """The external drivers of the cross-play, each found and tried; what is wrong is added to `problems`."""
    found: dict[str, ExternalDriver] = {}
    for written in document.crossplay.egos if document.crossplay is not None else ():
        if written in (SUMO, LEARNED):
            continue
        driver = collect(problems, partial(find_driver, written, file, "crossplay.egos", allow_code))
        if driver is not None:
            found[crossplay_name(written)] = driver
            if document.ego.perception is not None and driver.vehicle_type is not None:
                message = f"SUMO drives {written!r}, and its driver models know what is there"
                remedy = "leave out this driver, or ego.perception"
                problems.append(Problem(str(file), "crossplay.egos", message, remedy))
            if scene is not None:
                collect(problems, partial(driver.try_out, car.car_of(scene.world, EGO), False))
    return found


def _quickened(document: Campaign) -> Campaign:
    training, search, response = document.training, document.reconfiguration, document.best_response
    steps = {
        "steps": min(training.steps, QUICK_STEPS),
        "segment_steps": min(training.segment_steps, QUICK_SEGMENT_STEPS),
    }
    changes: dict[str, Document] = {
        "training": training.model_copy(update=steps),
        "reconfiguration": search.model_copy(update={"trials": min(search.trials, QUICK_TRIALS)}),
    }
    if response is not None:
        fewer = {"steps": min(response.steps, QUICK_RESPONSE_STEPS)}
        changes["best_response"] = response.model_copy(update=fewer)
    return document.model_copy(update=changes)
