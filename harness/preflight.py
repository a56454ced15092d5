"""Opening a campaign: every document it names is read and checked before anything runs."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from harness.documents.campaign import LEARNED, SUMO, Campaign, Training, resolve
from harness.documents.persona import Persona
from harness.documents.reading import read_document
from harness.errors import Problem, UsageError
from harness.policy_file import read_policy
from harness.traffic.opening import OpenScene, open_scene

QUICK_STEPS = 262_144
QUICK_SEGMENT_STEPS = 65_536

T = TypeVar("T")


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
    """SHA-256 of every file the campaign rests on, by name."""


def open_campaign(file: Path, quick: bool = False) -> OpenCampaign:
    """Read a campaign and everything it names. Raises UsageError with every problem found."""
    document = read_document(file, Campaign)
    problems: list[Problem] = []

    def attempt(action: Callable[[], T]) -> T | None:
        try:
            return action()
        except UsageError as error:
            problems.extend(error.problems)
            return None

    scene_folder = resolve(file, document.scene)
    scene = attempt(lambda: open_scene(scene_folder))
    persona_files = [resolve(file, document.ego.persona), *(resolve(file, each) for each in document.personas)]
    personas = [attempt(lambda path=path: read_document(path, Persona)) for path in persona_files]  # type: ignore[misc]
    ego_policy = attempt(lambda: _ego_policy(file, document))
    for given, persona in zip(document.personas, personas[1:], strict=True):
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
    if problems or scene is None:
        raise UsageError(problems)
    files = [
        file,
        *persona_files,
        *(scene_folder / each for each in ("scene.toml", scene.document.net, scene.document.routes)),
    ]
    hashes = {each.name: hashlib.sha256(each.read_bytes()).hexdigest() for each in files}
    ego, *others = (persona for persona in personas if persona is not None)
    if quick:
        document = _quickened(document)
    return OpenCampaign(file, document, quick, scene, ego, tuple(others), ego_policy, hashes)


def _ego_policy(file: Path, document: Campaign) -> Path | None:
    driver = document.ego.driver
    if driver in (LEARNED, SUMO):
        return None
    folder = resolve(file, driver)
    if not folder.is_dir():
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
