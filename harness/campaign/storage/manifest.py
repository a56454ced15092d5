"""The manifest of a run folder, checked like any file from outside: every part that other modules rely on."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path, PurePath
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field, ValidationError, model_validator

from harness.campaign.plan.plan import plan
from harness.campaign.plan.stages import Stage
from harness.campaign.storage.checksums import digest_of
from harness.config.campaign import Campaign, CampaignName, Seed
from harness.config.persona import Persona
from harness.config.scene import Name
from harness.config.toml_reading import Document
from harness.config.traits import PersonTraits, traits_of
from harness.errors import UsageError
from harness.evaluation.strategies import stage_id

FORMAT = 1
"""Of run folders. It is raised when a file of a run folder gets another form, or the same inputs give other numbers: a
run folder of another format is neither read nor continued."""
RUN_AGAIN = "run the campaign again into another folder, with --out"

Count = Annotated[int, Field(ge=0, le=10**15)]
Text = Annotated[str, Field(max_length=10_000)]
_MOST_LISTED = 3
_STAGE = re.compile(r"[A-Za-z][A-Za-z0-9_]*-seed\d+")


class _Record(Document):
    model_config = ConfigDict(extra="ignore")  # a stage may note more


class StageEntry(_Record):
    kind: Literal["training", "conditioning", "assessment", "reconfiguration", "selection", "preventability"]
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
    chosen: Text | None = None
    """Of a selection, and of an arm with a best response: the training whose policy was taken."""
    goals: Count | None = None
    """Of an arm without people, and of the training that made its player: games that the player ended at its goal."""
    played: Count | None = None
    """The games of that arm that could be played."""
    goal_share_asked: Annotated[float, Field(ge=0.0, le=1.0)] | None = None
    """Of a training: the least share of these games for its player to have learned."""
    where: Text | None = None
    """Of a training: who else drove in these games, as of `AloneBound`."""
    failing_roads: list[Text] = Field([])
    """Of a training: the further scenes on which most of its last games alone failed."""


class _ListedEgo(_Record):
    driver: Text


class _ListedCampaign(_Record):
    scene: Text
    ego: _ListedEgo


class _ListedEgoDriver(_Record):
    in_words: Text = ""


class ListedManifest(_Record):
    """What a list of runs reads of a manifest: reading all of it loads what plays games, to check the personas."""

    quick: bool
    campaign: _ListedCampaign
    ego_driver: _ListedEgoDriver | None = None
    personas: list[Name]
    seeds: list[Seed]
    versions: dict[Text, Text]
    stages: dict[Text, StageEntry]


class Manifest(_Record):
    format: int
    name: CampaignName
    file: Text
    """The name of the campaign's file."""
    quick: bool
    campaign: Campaign
    personas: list[Name]
    seeds: list[Seed] = Field(min_length=1)
    hashes: dict[Text, Text]
    versions: dict[Text, Text]
    stages: dict[Text, StageEntry]
    ego_persona: Persona
    persona_documents: dict[Name, Persona]
    """Of the personas and the baseline."""
    baseline: Name | None = None
    """The name of the campaign's baseline; None: it has none."""
    varying_drivers: dict[Text, Text] = Field({})
    """Drivers that decide otherwise when a game is played again, with the difference in words."""
    learned_elsewhere: dict[Text, Text] = Field({})
    """Policies that learned in other games than those of the campaign, with the difference in words."""

    @model_validator(mode="after")
    def _is_consistent(self) -> Manifest:
        """The names of stages become names of files; reports and model cards rely on the rest."""
        problems = [] if "harness" in self.versions else ["versions.harness: is missing"]
        named = {"personas": self.personas, "baseline": [self.baseline] if self.baseline is not None else []}
        for key, names in named.items():
            unknown = [name for name in names if name not in self.persona_documents]
            problems += [f"{key}: there is no document of persona {name!r}" for name in unknown]
        people = {"", *self.persona_documents, *self.campaign.mixed_people}
        for name, entry in self.stages.items():
            if name != stage_id(entry.name, entry.seed) or not _STAGE.fullmatch(name):
                problems.append(f"{name!r} is no stage")
            if entry.persona not in people:
                problems.append(f"stages.{name}.persona: there is no document of persona {entry.persona!r}")
            if entry.kind == "training" and entry.status == "done":
                unsaid = [key for key in ("steps", "budget_steps", "stopped") if getattr(entry, key) is None]
                problems += [f"stages.{name}.{key}: is missing" for key in unsaid]
        if problems:
            raise ValueError("; ".join(problems))
        return self


def read_manifest(file: Path, content: bytes, form: type[Document] = Manifest) -> dict[str, Any]:
    """The content of a manifest, of which what is in `form` is checked. Raises UsageError if it is damaged, or has
    another format than `FORMAT`."""
    try:
        manifest: dict[str, Any] = json.loads(content)
        found = manifest.get("format") if isinstance(manifest, dict) else None
        if isinstance(found, int) and found != FORMAT:
            message = f"the run folder has format {found}, this version of the harness reads format {FORMAT}"
            raise UsageError.of(file, "format", message, RUN_AGAIN)
        form.model_validate_json(content)
        return manifest
    except ValidationError as error:
        wrong = [f"{'.'.join(map(str, each['loc'])) or 'it'}: {each['msg']}" for each in error.errors()]
        more = [f"and {len(wrong) - _MOST_LISTED} more"] if len(wrong) > _MOST_LISTED else []
        words = "; ".join([*wrong[:_MOST_LISTED], *more])
    except (ValueError, RecursionError) as error:
        words = str(error)
    raise UsageError.of(file, "", f"is damaged: {words}", RUN_AGAIN)


def checksum_of_content(manifest: Mapping[str, Any]) -> str:
    """SHA-256 of what a manifest holds beside its key `sha256`, which states it."""
    return digest_of({key: value for key, value in manifest.items() if key != "sha256"})


def campaign_in(manifest: Mapping[str, Any]) -> Campaign:
    return Campaign.model_validate(manifest["campaign"], strict=False)


def planned(manifest: Mapping[str, Any]) -> list[Stage]:
    """Every stage of the plan of a run, each after those it needs."""
    return plan(campaign_in(manifest), manifest["personas"], is_tuned(manifest), traits_in(manifest))


def done_in(manifest: Mapping[str, Any], kind: str | None = None) -> list[str]:
    """The stages of a run that are done, by id; those of one kind, if it is given."""
    entries = manifest["stages"].items()
    return [name for name, entry in entries if entry["status"] == "done" and kind in (None, entry["kind"])]


def digests_read(manifest: Mapping[str, Any]) -> dict[str, dict[str, str]]:
    """The digest of each file that a run read, by the name of its folder and its own."""
    digests: dict[str, dict[str, str]] = {}
    for file, sha256 in manifest["hashes"].items():
        digests.setdefault(PurePath(file).parent.name, {})[PurePath(file).name] = sha256
    return digests


def traits_in(manifest: Mapping[str, Any]) -> PersonTraits:
    """What the plan of a run knows of the documents of its personas."""
    people = {name: Persona.from_record(each) for name, each in manifest["persona_documents"].items()}
    return traits_of([people[name] for name in manifest["personas"]], people.get(manifest.get("baseline")))


def is_tuned(manifest: Mapping[str, Any]) -> bool:
    """Whether the campaign's ego has tunable parameters, which round 2 searches."""
    return any(entry["kind"] == "reconfiguration" for entry in manifest["stages"].values())
