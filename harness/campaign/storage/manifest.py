"""The manifest of a run folder: the parts that other modules rely on, checked like any file from outside."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field, ValidationError

from harness.config.campaign import Campaign, CampaignName, Seed
from harness.config.persona import Persona
from harness.config.scene import Name
from harness.config.toml_reading import Document

Count = Annotated[int, Field(ge=0, le=10**15)]
Text = Annotated[str, Field(max_length=10_000)]
_MOST_LISTED = 3
FINISHED = ("done", "settled")
"""Statuses of a finished stage; `settled`: an approximate equilibrium left nothing to do."""


class _Record(Document):
    model_config = ConfigDict(extra="ignore")  # a later version of the same format may have more keys


class StageEntry(_Record):
    """A stage in the manifest."""

    kind: Literal["training", "assessment", "reconfiguration", "preventability"]
    name: Text
    persona: Name | Literal[""] = ""
    seed: Seed
    status: Text
    message: Text = ""
    steps: Count | None = None
    budget_steps: Count | None = None
    stopped: Text | None = None
    finished_on: Annotated[str, Field(pattern=r"^\d{4}-\d\d-\d\d$")] | None = None
    """The date in UTC."""
    rule: Text | None = None
    seconds: Annotated[float, Field(ge=0.0, le=1e9)] | None = None
    episodes: Count | None = None
    errors: Count | None = None
    trials: Count | None = None
    trials_unplayed: Count | None = None
    chosen_trial: Count | None = None
    settled: Text | None = None
    goals: Count | None = None
    """Of an arm in which a player drives alone, and of the training that made the player: games that it ended at its
    goal."""
    played: Count | None = None
    """The games of that arm that could be played."""
    goal_share_asked: Annotated[float, Field(ge=0.0, le=1.0)] | None = None
    """Of a training: the least share of these games for its player to have learned."""


class Manifest(_Record):
    """The content of a manifest."""

    format: int
    name: CampaignName
    file: Text = ""
    """The name of the campaign's file; empty in runs of earlier versions."""
    quick: bool = False
    campaign: dict[str, Any]
    personas: list[Name]
    seeds: list[Seed] = Field(min_length=1)
    hashes: dict[Text, Text] = Field(default_factory=dict)
    versions: dict[Text, Text] = Field(default_factory=dict)
    stages: dict[Text, StageEntry]
    ego_persona: dict[str, Any] | None = None
    persona_documents: dict[Name, dict[str, Any]] = Field(default_factory=dict)


def check_manifest(content: bytes, known_format: int) -> Manifest:
    """A manifest's text as a record. Raises ValueError saying which keys are wrong, and how."""
    try:
        manifest = Manifest.model_validate_json(content)
    except ValidationError as error:
        raise ValueError(_words(error)) from None
    if manifest.format != known_format:
        raise ValueError(f"format: it is {manifest.format}, not {known_format}")
    return manifest


def problems_for_report(manifest: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Key and problem of each part that only reports and model cards rely on."""
    try:
        Campaign.model_validate(manifest["campaign"], strict=False)
    except ValidationError as error:
        yield "campaign", _words(error)
    if "persona_documents" not in manifest:
        return  # runs of earlier versions have no model cards
    documents = {"ego_persona": manifest.get("ego_persona")}
    documents |= {f"persona_documents.{name}": each for name, each in manifest["persona_documents"].items()}
    for key, document in documents.items():
        try:
            Persona.from_record(document)
        except ValidationError as error:
            yield key, _words(error)
    if "harness" not in manifest.get("versions", {}):
        yield "versions.harness", "is missing"
    written = manifest["campaign"]
    populations = {each.get("name") for each in (*written.get("population", ()), *written.get("crowd", ()))}
    for name, entry in manifest["stages"].items():
        if entry.get("persona", "") not in {"", *manifest["persona_documents"], *populations}:
            yield f"stages.{name}.persona", f"there is no document of persona {entry['persona']!r}"
        if entry["kind"] == "training" and entry["status"] == "done":
            for key in ("steps", "budget_steps", "stopped"):
                if entry.get(key) is None:
                    yield f"stages.{name}.{key}", "is missing"


def is_tuned(manifest: Mapping[str, Any]) -> bool:
    """Whether the campaign's ego has tunable parameters, which round 2 searches."""
    return any(entry["kind"] == "reconfiguration" for entry in manifest["stages"].values())


def _words(error: ValidationError) -> str:
    found = [f"{'.'.join(map(str, each['loc'])) or 'it'}: {each['msg']}" for each in error.errors()]
    more = f"; and {len(found) - _MOST_LISTED} more" if len(found) > _MOST_LISTED else ""
    return "; ".join(found[:_MOST_LISTED]) + more
