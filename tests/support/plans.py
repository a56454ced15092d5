"""The plan of a tiny campaign, and stages that are only names."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from harness.campaign.execution.cache_keys import stage_keys
from harness.campaign.execution.stage_run import RunContext
from harness.campaign.plan.plan import plan
from harness.campaign.plan.planned_drivers import Trained
from harness.campaign.plan.stages import Stage, TrainingStage
from harness.campaign.preflight import open_campaign
from harness.campaign.storage.run_folder import RunFolder
from harness.config.campaign import Campaign
from harness.config.persona import Persona
from harness.config.traits import UNREAD, PersonTraits
from harness.evaluation.strategies import PersonaNonEgo
from tests.support.tiny import write_campaign


def planned(folder: Path, **changes: Any) -> tuple[dict[str, Stage], dict[str, str]]:
    """A campaign's stages and their keys, by id and in order."""
    campaign = open_campaign(write_campaign(folder, **changes))
    stages = campaign.stages
    assert len({stage.id for stage in stages}) == len(stages)
    return {stage.id: stage for stage in stages}, stage_keys(campaign, stages)


def campaign_of(*personas: str, **changes: Any) -> Campaign:
    """A campaign with these personas, without reference drivers. None of its files is read."""
    document = {"name": "a", "scene": "b", "personas": list(personas), "assessment": {"reference_drivers": False}}
    return Campaign.model_validate({**document, **changes})


def stages_of(*personas: str, tunable: bool = False, traits: PersonTraits = UNREAD, **changes: Any) -> dict[str, Any]:
    """The stages of `campaign_of`, by name and in order. It has one seed."""
    return {stage.name: stage for stage in plan(campaign_of(*personas, **changes), personas, tunable, traits)}


def training_of(name: str, *needs: str, seed: int = 1) -> Stage:
    """A training that needs others: as its initial policy and as its opponent."""
    needed = tuple(Trained(stage=f"{each}-seed{seed}") for each in needs)
    return TrainingStage(
        seed=seed,
        persona="",
        strategy=PersonaNonEgo(persona=name),
        opponent=needed[1:],
        initial=needed[0] if needed else None,
        alone_share=0.0,
    )


def empty_context(folder: Path) -> RunContext:
    """The context of stages that do without one."""
    document: Any = Campaign
    persona: Any = Persona
    return RunContext(
        folder=RunFolder(folder),
        document=document.model_construct(),
        ego_persona=persona.model_construct(name="anyone"),
        people={},
    )
