"""Preflight: every document that a campaign names is read and checked before anything runs.

All problems are collected and reported at once. What can be checked without one another is checked even where a
document has problems of its own.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ConfigDict

from harness.campaign.plan.campaign_checks import check_names, check_people
from harness.campaign.plan.persona_remarks import persona_remarks
from harness.campaign.plan.plan import plan
from harness.campaign.plan.strategy_stages import crossplay_name
from harness.campaign.trained_policies import check_policies, find_policies
from harness.config.campaign import LEARNED, SUMO, Campaign, DocumentPath, Ego
from harness.config.persona import Persona
from harness.config.toml_reading import Document, read_document
from harness.drivers.car import car_of
from harness.drivers.external import ExternalDriver, find_driver
from harness.errors import Problem, UsageError, collect
from harness.game.roles import EGO
from harness.road.scene.load_check import check_loads
from harness.road.scene.open_scene import OpenScene, open_scene
from harness.shipped_documents import PACKAGE, Kind, find_document, is_name, missing_document

QUICK_STEPS = 262_144
QUICK_SEGMENT_STEPS = 65_536
QUICK_TRIALS = 12
QUICK_RESPONSE_STEPS = 131_072


class _NamedByEgo(Document):
    model_config = ConfigDict(extra="ignore")
    driver: DocumentPath = LEARNED
    persona: DocumentPath = Ego().persona


class _Names(Document):
    """The documents that a campaign names: they are checked even where the rest of it is wrong."""

    model_config = ConfigDict(extra="ignore")
    scene: DocumentPath
    personas: list[DocumentPath]
    policies: DocumentPath | None = None
    ego: _NamedByEgo = _NamedByEgo()


@dataclass(frozen=True, kw_only=True)
class OpenCampaign:
    """A campaign whose documents are all read and checked."""

    file: Path
    document: Campaign
    quick: bool
    scene: OpenScene
    ego_persona: Persona
    personas: tuple[Persona, ...]
    ego_driver: ExternalDriver | None
    """The ego's external driver; None where the ego is learned or driven by SUMO's own models."""
    policies: Path | None
    """The folder of policies trained in another run, where the campaign names one."""
    other_egos: Mapping[str, ExternalDriver]
    """The external drivers of the cross-play, by name."""
    policy_drivers: Mapping[str, ExternalDriver]
    """The policies of others in the folder `policies`, by name."""
    hashes: dict[str, str]
    """SHA-256 of every file that the campaign rests on, by its path from the campaign's folder."""

    @property
    def run_name(self) -> str:
        """The name of its run folder in `reports/`."""
        return self.document.name + ("-quick" if self.quick else "")

    @property
    def tunable(self) -> bool:
        """Whether the ego is external and has tunable parameters."""
        return _is_tunable(self.ego_driver)

    @property
    def persona_remarks(self) -> list[str]:
        """What in the payoffs of the personas does not suit the scene: a sentence each."""
        return persona_remarks(self.personas, self.scene.world, self.document.training.discount)

    def hash_of(self, path: Path) -> str:
        """SHA-256 of one of those files."""
        return self.hashes[_relative(self.file, path)]


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
    named = document or collect([], lambda: read_document(file, _Names))
    if named is None:
        raise UsageError(problems)
    found = _find_documents(
        file,
        document=document,
        named=named,
        allow_code=allow_code,
        policies_exist=policies_exist,
        problems=problems,
    )
    if problems or document is None or found.scene is None:
        raise UsageError(problems)
    ego_persona, *personas = (persona for persona in found.personas if persona is not None)
    names = [persona.name for persona in personas]
    tunable = _is_tunable(found.ego_driver)
    check_people(file, document, len(found.scene.document.non_ego))
    check_names(file, document, names, tunable)
    _check_stage_names(file, document, names, tunable)
    files, read = [file], None
    if found.policies is not None and policies_exist:
        read = check_policies(
            file,
            document=document,
            ego_persona=ego_persona,
            personas=personas,
            folder=found.policies,
            world=found.scene.world,
            allow_code=allow_code,
        )
        files += read.files
    files += found.files()
    quick = quick and (found.policies is None or tunable)
    return OpenCampaign(
        file=file,
        document=_quickened(document) if quick else document,
        quick=quick,
        scene=found.scene,
        ego_persona=ego_persona,
        personas=tuple(personas),
        ego_driver=found.ego_driver,
        policies=found.policies,
        other_egos=found.other_egos,
        policy_drivers=read.drivers if read is not None else {},
        hashes={_relative(file, each): hashlib.sha256(each.read_bytes()).hexdigest() for each in files},
    )


@dataclass(frozen=True, kw_only=True)
class _Documents:
    """What a campaign names, as far as it could be read."""

    scene: OpenScene | None
    persona_files: Sequence[Path]
    """The ego's persona first."""
    personas: Sequence[Persona | None]
    ego_driver: ExternalDriver | None
    other_egos: Mapping[str, ExternalDriver]
    policies: Path | None

    def files(self) -> list[Path]:
        """All files that were read, but those of policies."""
        assert self.scene is not None
        scene = self.scene.document
        found = [*self.persona_files, *(self.scene.folder / each for each in scene.files)]
        for driver in (self.ego_driver, *self.other_egos.values()):
            found += map(Path, driver.files if driver is not None else ())
        return found


def _find_documents(
    file: Path,
    *,
    document: Campaign | None,
    named: Campaign | _Names,
    allow_code: bool,
    policies_exist: bool,
    problems: list[Problem],
) -> _Documents:
    """Read and check what a campaign names; what is wrong is added to `problems`."""
    ego_driver = collect(problems, lambda: _find_ego(file, named.ego.driver, allow_code))
    vehicle_type = ego_driver.vehicle_type if ego_driver is not None else None
    scene = collect(problems, lambda: open_scene(_find_named(file, "scene", named.scene, "networks"), vehicle_type))
    written = [("ego.persona", named.ego.persona), *(("personas", each) for each in named.personas)]
    found = [collect(problems, lambda each=each: _read_persona(file, *each)) for each in written]  # type: ignore[misc]
    personas = [each[1] if each is not None else None for each in found]
    if ego_driver is not None and scene is not None:
        sampled = personas[0] is not None and personas[0].decisions == "sampled"
        games = _games_at_once(document, ego_driver)
        collect(problems, lambda: ego_driver.try_out(car_of(scene.world, EGO), sampled, games))
    collect(problems, lambda: _check_round_2(file, document, ego_driver))
    other_egos = _find_other_egos(file, document, scene, allow_code=allow_code, problems=problems)
    policies = collect(problems, lambda: find_policies(file, named.policies, policies_exist))
    problems += _same_names(file, named.personas, personas[1:])
    if not problems and scene is not None:
        collect(problems, lambda: check_loads(scene))
    return _Documents(
        scene=scene,
        persona_files=[each[0] for each in found if each is not None],
        personas=personas,
        ego_driver=ego_driver,
        other_egos=other_egos,
        policies=policies,
    )


def _is_tunable(driver: ExternalDriver | None) -> bool:
    return driver is not None and bool(driver.searched)


def _find_named(file: Path, key: str, written: str, kind: Kind) -> Path:
    """A document that a campaign names. Raises UsageError if a name is that of no document."""
    found = find_document(written, file.parent, kind)
    if is_name(written) and not os.path.exists(found):
        raise UsageError.of(file, key, *missing_document(written, file.parent, kind))
    return found


def _read_persona(file: Path, key: str, written: str) -> tuple[Path, Persona]:
    """The file of a persona that a campaign names, and the persona. Raises UsageError if it is missing or wrong."""
    path = _find_named(file, key, written, "personas")
    return path, read_document(path, Persona)


def _relative(campaign_file: Path, path: Path) -> str:
    if path.resolve().is_relative_to(PACKAGE):
        return path.resolve().relative_to(PACKAGE.parent).as_posix()
    return Path(os.path.relpath(path.resolve(), campaign_file.resolve().parent)).as_posix()


def _same_names(file: Path, written: Sequence[str], personas: Sequence[Persona | None]) -> list[Problem]:
    """A problem for each persona whose name another one has."""
    names = [each.name for each in personas if each is not None]
    return [
        Problem(
            str(file),
            "personas",
            f"{path!r}: another persona is called {persona.name!r} too",
            "give each persona a name of its own",
        )
        for path, persona in zip(written, personas, strict=True)
        if persona is not None and names.count(persona.name) > 1
    ]


def _games_at_once(document: Campaign | None, ego_driver: ExternalDriver) -> int:
    """The number of games that the ego will have to play at once."""
    if document is None:
        return 1
    search = document.reconfiguration
    return max(
        document.training.games if document.policies is None else 1,
        min(search.games, search.games_at_once) if _is_tunable(ego_driver) else 1,
    )


def _check_round_2(file: Path, document: Campaign | None, ego_driver: ExternalDriver | None) -> None:
    """Raises UsageError for a table about round 2 of another kind of ego than the campaign's."""
    if document is None or (ego_driver is None and document.ego.driver not in (LEARNED, SUMO)):
        return  # the ego's kind is not known
    learned = document.ego.driver == LEARNED
    reasons = {"reconfiguration": "is trained" if learned else "has nothing to tune", "retraining": "is not trained"}
    applies = {"reconfiguration": _is_tunable(ego_driver), "retraining": learned}
    if ignored := [name for name in reasons if name in document.model_fields_set and not applies[name]]:
        remedy = "leave out this table, or name another ego"
        raise UsageError(
            Problem(str(file), name, f"this ego {reasons[name]}: the table would be ignored", remedy)
            for name in ignored
        )


def _check_stage_names(file: Path, document: Campaign, personas: Sequence[str], tunable: bool) -> None:
    """Raises UsageError where two stages would have the same name: stages are named after personas."""
    stages: dict[str, list[str]] = {}
    for stage in plan(document.model_copy(update={"policies": None}), personas, tunable):
        stages.setdefault(stage.id, []).append(stage.persona)
    clashes = {tuple(sorted(filter(None, of))): name for name, of in stages.items() if len(of) > 1}
    if clashes:
        raise UsageError(
            Problem(
                str(file),
                "personas",
                f"two stages would be called {name!r}, by persona {' and '.join(map(repr, of))}",
                "give the persona another name",
            )
            for of, name in clashes.items()
        )


def _find_ego(file: Path, driver: str, allow_code: bool) -> ExternalDriver | None:
    return None if driver in (LEARNED, SUMO) else find_driver(driver, file, "ego.driver", allow_code)


def _find_other_egos(
    file: Path, document: Campaign | None, scene: OpenScene | None, *, allow_code: bool, problems: list[Problem]
) -> dict[str, ExternalDriver]:
    """The external drivers of the cross-play, each found and tried; what is wrong is added to `problems`."""
    found: dict[str, ExternalDriver] = {}
    crossplay = document.crossplay if document is not None else None
    for written in crossplay.egos if crossplay is not None else ():
        if written in (SUMO, LEARNED):
            continue
        driver = collect(problems, lambda written=written: find_driver(written, file, "crossplay.egos", allow_code))  # type: ignore[misc]
        if driver is not None:
            found[crossplay_name(written)] = driver
            if scene is not None:
                collect(problems, lambda driver=driver: driver.try_out(car_of(scene.world, EGO), False))  # type: ignore[misc]
    return found


def _quickened(document: Campaign) -> Campaign:
    """The same campaign with fewer training steps, and fewer trials."""
    training = document.training.model_copy(
        update={
            "steps": min(document.training.steps, QUICK_STEPS),
            "segment_steps": min(document.training.segment_steps, QUICK_SEGMENT_STEPS),
        }
    )
    search = document.reconfiguration
    search = search.model_copy(update={"trials": min(search.trials, QUICK_TRIALS)})
    changes: dict[str, Any] = {"training": training, "reconfiguration": search}
    if document.best_response is not None:
        steps = min(document.best_response.steps, QUICK_RESPONSE_STEPS)
        changes["best_response"] = document.best_response.model_copy(update={"steps": steps})
    return document.model_copy(update=changes)
