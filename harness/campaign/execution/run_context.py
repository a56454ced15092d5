"""What all stages of a run share."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from harness.campaign.plan.stages import AssessmentStage, Stage
from harness.campaign.preflight import OpenCampaign
from harness.campaign.storage.run_folder import RunFolder
from harness.config.campaign import Campaign
from harness.config.persona import Persona
from harness.drivers.external import ExternalDriver


@dataclass(frozen=True)
class RunContext:
    """What all stages of a run share; small enough to be sent to another process."""

    folder: Path
    scene_folder: Path
    document: Campaign
    ego_persona: Persona
    personas: Mapping[str, Persona]
    ego_driver: ExternalDriver | None
    other_egos: Mapping[str, ExternalDriver]
    policies: Path | None
    keys: Mapping[str, str]  # of every stage

    def persona(self, name: str) -> Persona:
        """A persona of the campaign; the ego's own for the empty name."""
        return self.personas[name] if name else self.ego_persona

    def persona_met(self, name: str) -> Persona:
        """Of whom a player meets by this name in a training or a search; the ego's own for nobody, and for a
        population, whose people have each their own."""
        return self.persona(name if name in self.personas else "")

    def given(self, name: str) -> ExternalDriver:
        """A driver that the campaign names: its ego, or another one by name."""
        driver = self.other_egos[name] if name else self.ego_driver
        assert driver is not None
        return driver

    def vehicle_type(self, stage: Stage) -> str | None:
        """The vehicle type of the ego in a stage, where it is not the scene's."""
        players = (stage.ego, stage.non_ego) if isinstance(stage, AssessmentStage) else (stage.opponent,)
        named = [each.stage for each in players if each is not None and each.kind == "given" and each.stage]
        if named:
            return self.given(named[0]).vehicle_type
        return self.ego_driver.vehicle_type if self.ego_driver is not None else None

    def policy_before(self, stage: str) -> Path:
        """The folder of a policy that was trained before."""
        assert self.policies is not None
        return self.policies / stage


def run_context_of(campaign: OpenCampaign, folder: RunFolder, keys: Mapping[str, str]) -> RunContext:
    """The conditions of a run of a campaign: on the run folder's copy of the scene, which stays what it was."""
    personas = {each.name: each for each in campaign.personas}
    return RunContext(
        folder.path,
        folder.scene,
        campaign.document,
        campaign.ego_persona,
        personas,
        campaign.ego_driver,
        campaign.other_egos,
        campaign.policies,
        keys,
    )
