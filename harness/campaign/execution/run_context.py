"""What all stages of a run share."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from harness.campaign.plan.planned_drivers import External
from harness.campaign.plan.stages import Stage
from harness.campaign.preflight import OpenCampaign
from harness.campaign.storage.run_folder import RunFolder
from harness.config.campaign import Campaign
from harness.config.persona import Persona
from harness.drivers.external import ExternalDriver


@dataclass(frozen=True, kw_only=True)
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
    keys: Mapping[str, str]
    """The cache key of every stage."""
    policy_drivers: Mapping[str, ExternalDriver] = field(default_factory=dict)
    """The policies of others in the folder `policies`, by name."""
    keep_going: bool = False
    """Whether an arm is played to its end even if its first games can't be played."""

    def persona(self, name: str) -> Persona:
        """A persona of the campaign; the ego's own for the empty name."""
        return self.personas[name] if name else self.ego_persona

    def external_driver(self, name: str = "") -> ExternalDriver:
        """An external driver of the campaign: its ego, or another one by name."""
        driver = self.other_egos[name] if name else self.ego_driver
        assert driver is not None
        return driver

    def vehicle_type(self, stage: Stage) -> str | None:
        """The vehicle type of the ego in a stage; None: the scene's."""
        for driver in stage.drivers:
            if isinstance(driver, External) and driver.name:
                return self.external_driver(driver.name).vehicle_type
        return self.ego_driver.vehicle_type if self.ego_driver is not None else None

    def policy_before(self, stage: str) -> Path:
        """The folder of a policy that another run trained."""
        assert self.policies is not None
        return self.policies / stage


def run_context_of(
    campaign: OpenCampaign, folder: RunFolder, keys: Mapping[str, str], keep_going: bool = False
) -> RunContext:
    """The context of a run of a campaign. Its scene is the run folder's copy, which does not change."""
    return RunContext(
        folder=folder.path,
        scene_folder=folder.scene,
        document=campaign.document,
        ego_persona=campaign.ego_persona,
        personas={each.name: each for each in campaign.personas},
        ego_driver=campaign.ego_driver,
        other_egos=campaign.other_egos,
        policies=campaign.policies,
        keys=keys,
        policy_drivers=dict(campaign.policy_drivers),
        keep_going=keep_going,
    )
