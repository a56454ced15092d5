"""Opening a campaign: every document it names is read and checked before anything runs."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import ConfigDict

from harness.documents.campaign import LEARNED, SUMO, Campaign, DocumentPath, Ego, Training, resolve
from harness.documents.persona import Persona
from harness.documents.reading import Document, read_document
from harness.errors import Problem, UsageError, attempt
from harness.policy_file import read_policy
from harness.rounds import plan
from harness.traffic.opening import OpenScene, open_scene

QUICK_STEPS = 262_144
QUICK_SEGMENT_STEPS = 65_536


@dataclass(frozen=True)
class OpenCampaign:
    """A campaign with everything it names, in order."""

    file: Path
    document: Campaign
    quick: bool
    scene: OpenScene
    ego_persona: Persona
    personas: tuple[Persona, ...]
    ego_policy: Path | None
    """The folder of the ego's policy, where the campaign names one."""
    hashes: dict[str, str]
    """SHA-256 of every file the campaign rests on, by its path from the campaign's folder."""

    def hash_of(self, path: Path) -> str:
        """SHA-256 of one of those files."""
        return self.hashes[_from(self.file, path)]


def open_campaign(file: Path, quick: bool = False) -> OpenCampaign:
    """Read a campaign and everything it names. Raises UsageError with every problem found."""
    problems: list[Problem] = []

    document = attempt(problems, lambda: read_document(file, Campaign))
    named = document or _named(file)
    if named is None:
        raise UsageError(problems)
    scene_folder = resolve(file, named.scene)
    scene = attempt(problems, lambda: open_scene(scene_folder))
    persona_files = [resolve(file, named.ego.persona), *(resolve(file, each) for each in named.personas)]
    personas = [attempt(problems, lambda path=path: read_document(path, Persona)) for path in persona_files]  # type: ignore[misc]
    ego_policy = attempt(problems, lambda: _ego_policy(file, named.ego.driver))
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
    if problems or document is None or scene is None:
        raise UsageError(problems)
    _check_stage_names(file, document, [persona.name for persona in personas[1:] if persona is not None])
    files = [
        file,
        *persona_files,
        *(scene_folder / each for each in ("scene.toml", scene.document.net, scene.document.routes)),
    ]
    hashes = {_from(file, each): hashlib.sha256(each.read_bytes()).hexdigest() for each in files}
    ego, *others = (persona for persona in personas if persona is not None)
    if quick:
        document = _quickened(document)
    return OpenCampaign(file, document, quick, scene, ego, tuple(others), ego_policy, hashes)


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
    ego: _NamedByEgo = _NamedByEgo()


def _named(file: Path) -> _Named | None:
    try:
        return read_document(file, _Named)
    except UsageError:
        return None


def _check_stage_names(file: Path, document: Campaign, personas: Sequence[str]) -> None:
    """Stages are called after personas: a persona called `naive` would be taken for the naive ego."""
    stages: dict[str, list[str]] = {}
    for stage in plan(document, personas):
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


def _ego_policy(file: Path, driver: str) -> Path | None:
    if driver in (LEARNED, SUMO):
        return None
    folder = resolve(file, driver)
    if not os.path.isdir(folder):
        raise UsageError.of(
            file,
            "ego.driver",
            f"{driver!r} is neither a driver nor the folder of a policy",
            f"use {LEARNED!r}, {SUMO!r} or a folder",
        )
    read_policy(folder)
    return folder


def _quickened(document: Campaign) -> Campaign:
    """The same campaign with fewer training steps."""
    training: Training = document.training.model_copy(
        update={
            "steps": min(document.training.steps, QUICK_STEPS),
            "segment_steps": min(document.training.segment_steps, QUICK_SEGMENT_STEPS),
        }
    )
    return document.model_copy(update={"training": training})
