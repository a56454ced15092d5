"""Opening a campaign: every document it names is read and checked before anything runs."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ConfigDict

from harness.campaign.plan.name_checks import check_names
from harness.campaign.plan.plan import name_of, plan
from harness.config.campaign import LEARNED, SUMO, Campaign, DocumentPath, Ego, Training, resolve
from harness.config.persona import Persona
from harness.config.toml_reading import Document, nearest, read_document
from harness.drivers.car import car_of
from harness.drivers.external import ExternalDriver, find_driver
from harness.drivers.policy_file import check_no_archive, policy_files, read_policy
from harness.errors import Problem, UsageError, collect
from harness.game.state import EGO
from harness.traffic.load_check import check_loads
from harness.traffic.scene import OpenScene, open_scene

QUICK_STEPS = 262_144
QUICK_SEGMENT_STEPS = 65_536
QUICK_TRIALS = 12
QUICK_RESPONSE_STEPS = 131_072


@dataclass(frozen=True)
class OpenCampaign:
    """A campaign with everything it names, in order."""

    file: Path
    document: Campaign
    quick: bool
    scene: OpenScene
    ego_persona: Persona
    personas: tuple[Persona, ...]
    ego_driver: ExternalDriver | None
    """The ego's driver, where it is neither learned nor plainly SUMO's own."""
    policies: Path | None
    """The folder of the policies trained before, where the campaign names one."""
    other_egos: Mapping[str, ExternalDriver]
    """Who meets every non-ego in cross-play beside the campaign's own egos, by name; SUMO's plain own is not here."""
    hashes: dict[str, str]
    """SHA-256 of every file the campaign rests on, by its path from the campaign's folder."""

    @property
    def tunable(self) -> bool:
        """Whether the ego is given, and has something to tune."""
        return self.ego_driver is not None and bool(self.ego_driver.searched)

    def hash_of(self, path: Path) -> str:
        """SHA-256 of one of those files."""
        return self.hashes[_from(self.file, path)]


def open_campaign(file: Path, quick: bool = False, allow_code: bool = False) -> OpenCampaign:
    """Read a campaign and everything it names. Raises UsageError with every problem found.

    Quick makes trainings and searches shorter: a campaign that has none is the same without it. `allow_code`: an ego
    that is code which comes as a file may be run (`harness.drivers.external` says why a document can't decide that).
    """
    problems: list[Problem] = []

    document = collect(problems, lambda: read_document(file, Campaign))
    named = document or _named(file)
    if named is None:
        raise UsageError(problems)
    scene_folder = resolve(file, named.scene)
    ego_driver = collect(problems, lambda: _ego_driver(file, named.ego.driver, allow_code))
    scene = collect(problems, lambda: open_scene(scene_folder, ego_driver.vehicle_type if ego_driver else None))
    persona_files = [resolve(file, named.ego.persona), *(resolve(file, each) for each in named.personas)]
    personas = [collect(problems, lambda path=path: read_document(path, Persona)) for path in persona_files]  # type: ignore[misc]
    if ego_driver is not None and scene is not None:
        sampled = personas[0] is not None and personas[0].decisions == "sampled"
        collect(problems, lambda: ego_driver.try_out(car_of(scene.world, EGO), sampled, _at_once(document, ego_driver)))
    collect(problems, lambda: _check_round_2(file, document, ego_driver))
    other_egos = _other_egos(problems, file, document, scene, allow_code)
    policies = collect(problems, lambda: _policies_folder(file, named.policies))
    for given, persona in zip(named.personas, personas[1:], strict=True):
        names = [each.name for each in personas[1:] if each is not None]
        if persona is not None and names.count(persona.name) > 1:
            problems.append(
                Problem(
                    str(file),
                    "personas",
                    f"{given!r}: another persona is called {persona.name!r} too",
                    "give each persona a name of its own",
                )
            )
    if not problems and scene is not None:
        collect(problems, lambda: check_loads(scene))
    if problems or document is None or scene is None:
        raise UsageError(problems)
    names = [persona.name for persona in personas[1:] if persona is not None]
    tunable = ego_driver is not None and bool(ego_driver.searched)
    check_names(file, document, names, tunable)
    _check_stage_names(file, document, names, tunable)
    files = [
        file,
        *(_trained_before(file, document, names, policies) if policies is not None else ()),
        *persona_files,
        *(scene_folder / each for each in ("scene.toml", scene.document.net, scene.document.routes)),
    ]
    for driver in (ego_driver, *other_egos.values()):
        if driver is not None:
            files += map(Path, driver.files)
    hashes = {_from(file, each): hashlib.sha256(each.read_bytes()).hexdigest() for each in files}
    ego, *others = (persona for persona in personas if persona is not None)
    quick = quick and (policies is None or tunable)
    if quick:
        document = _quickened(document)
    return OpenCampaign(file, document, quick, scene, ego, tuple(others), ego_driver, policies, other_egos, hashes)


def _from(campaign_file: Path, path: Path) -> str:
    return Path(os.path.relpath(path.resolve(), campaign_file.resolve().parent)).as_posix()


class _NamedByEgo(Document):
    model_config = ConfigDict(extra="ignore")
    driver: DocumentPath = LEARNED
    persona: DocumentPath = Ego().persona


class _Named(Document):
    """The documents that a campaign names: what is wrong with the rest of it keeps nobody from looking at them."""

    model_config = ConfigDict(extra="ignore")
    scene: DocumentPath
    personas: list[DocumentPath]
    policies: DocumentPath | None = None
    ego: _NamedByEgo = _NamedByEgo()


def _named(file: Path) -> _Named | None:
    try:
        return read_document(file, _Named)
    except UsageError:
        return None


def _at_once(document: Campaign | None, ego_driver: ExternalDriver) -> int:
    """How many games at once the ego will have to play."""
    if document is None:
        return 1
    search = document.reconfiguration
    return max(
        document.training.games if document.policies is None else 1,
        min(search.games, search.games_at_once) if ego_driver.searched else 1,
    )


def _check_round_2(file: Path, document: Campaign | None, ego_driver: ExternalDriver | None) -> None:
    """Raises UsageError for a table that says how round 2 goes of another kind of ego than this."""
    if document is None or (ego_driver is None and document.ego.driver not in (LEARNED, SUMO)):
        return  # nobody knows which ego it has
    learned = document.ego.driver == LEARNED
    wrong = {"reconfiguration": "is trained" if learned else "has nothing to tune", "retraining": "is not trained"}
    has = {"reconfiguration": ego_driver is not None and ego_driver.searched, "retraining": learned}
    if ignored := [name for name in wrong if name in document.model_fields_set and not has[name]]:
        remedy = "leave out this table, or name another ego"
        raise UsageError(
            Problem(str(file), name, f"this ego {wrong[name]}: the table would be ignored", remedy) for name in ignored
        )


def _check_stage_names(file: Path, document: Campaign, personas: Sequence[str], tunable: bool) -> None:
    """Stages are called after personas: a persona called `naive` would be taken for the naive ego."""
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


def _ego_driver(file: Path, driver: str, allow_code: bool) -> ExternalDriver | None:
    return None if driver in (LEARNED, SUMO) else find_driver(driver, file, "ego.driver", allow_code)


def _other_egos(
    problems: list[Problem], file: Path, document: Campaign | None, scene: OpenScene | None, allow_code: bool
) -> dict[str, ExternalDriver]:
    """The drivers of [crossplay], each found and tried; what is wrong with them goes to `problems`."""
    found: dict[str, ExternalDriver] = {}
    crossplay = document.crossplay if document is not None else None
    for written in crossplay.egos if crossplay is not None else ():
        if written in (SUMO, LEARNED):
            continue
        driver = collect(problems, lambda written=written: find_driver(written, file, "crossplay.egos", allow_code))  # type: ignore[misc]
        if driver is not None:
            found[name_of(written)] = driver
            if scene is not None:
                collect(problems, lambda driver=driver: driver.try_out(car_of(scene.world, EGO), False))  # type: ignore[misc]
    return found


def _policies_folder(file: Path, written: str | None) -> Path | None:
    if written is None:
        return None
    folder = resolve(file, written)
    check_no_archive(file, "policies", written, folder)
    if not os.path.isdir(folder):
        raise UsageError.of(
            file,
            "policies",
            f"{written!r}: there is no such folder",
            f"name one laid out as <run>/policies/; {_beside(folder)}",
        )
    return folder


def _beside(folder: Path) -> str:
    """What there is in the place of a folder that is not there."""
    if not os.path.isdir(folder.parent):
        return f"there is no folder {folder.parent}"
    return nearest(folder.name, [each.name for each in folder.parent.iterdir() if each.is_dir()] or ["(no folder)"])


def _trained_before(file: Path, document: Campaign, personas: Sequence[str], folder: Path) -> list[Path]:
    """The files of every policy that a campaign reads. Raises UsageError for each that is missing or doesn't fit."""
    stages = plan(document, personas)
    there = {each.name for each in folder.iterdir() if each.is_dir()}
    problems: list[Problem] = []
    files: list[Path] = []
    for name in dict.fromkeys(name for stage in stages for name in stage.reads):
        if name not in there:
            message = f"{document.policies!r} holds no policy {name!r}"
            problems.append(Problem(str(file), "policies", message, _instead(name, there)))
            continue
        policy = collect(problems, lambda name=name: read_policy(folder / name))  # type: ignore[misc]
        if policy is not None and (learned := policy.card.get("stage")) != name:
            message = f"was learned as {learned!r}, but is called {name!r}"
            problems.append(Problem(str(folder / name), "stage", message, "give the folder its policy's name"))
        files += policy_files(folder / name)
    if problems:
        raise UsageError(problems)
    return files


def _instead(missing: str, there: Iterable[str]) -> str:
    """A remedy for a policy that is missing: the seeds that there are of its stage, or the stages that there are."""
    stage = missing.rpartition("-seed")[0]
    parts = [each.rpartition("-seed") for each in there]
    if seeds := sorted(int(seed) for name, _, seed in parts if name == stage and seed.isdecimal()):
        return f"there is {stage!r} of seed {', '.join(map(str, seeds))}"
    return nearest(stage, {name for name, _, _ in parts if name} or ["(no policy at all)"])


def _quickened(document: Campaign) -> Campaign:
    """The same campaign with fewer training steps, and fewer trials."""
    training: Training = document.training.model_copy(
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
