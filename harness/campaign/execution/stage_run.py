"""What a stage is carried out with: what all stages of a run share, and one attempt at a stage."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

from harness.campaign.plan.planned_drivers import External
from harness.campaign.plan.stages import Stage
from harness.campaign.preflight import OpenCampaign
from harness.campaign.storage.run_folder import RunFolder
from harness.config.campaign import Campaign
from harness.config.persona import Persona
from harness.drivers.external import ExternalDriver

OnProgress: TypeAlias = Callable[[int, int], None]
"""Called with what is done of a stage, and with its total: steps, games or trials."""
OnStart: TypeAlias = Callable[[int], None]
"""Called with the number of each segment of a training, game of an arm or trial of a search before it starts: if the
process crashes, the place is known."""


@dataclass(frozen=True, kw_only=True)
class RunContext:
    """What all stages of a run share; small enough to be sent to another process."""

    folder: RunFolder
    document: Campaign
    ego_persona: Persona
    personas: Mapping[str, Persona]
    ego_driver: ExternalDriver | None = None
    other_egos: Mapping[str, ExternalDriver] = field(default_factory=dict)
    policies: Path | None = None
    """The folder of the policies that another run trained."""
    policy_drivers: Mapping[str, ExternalDriver] = field(default_factory=dict)
    """The policies of others in that folder, by name."""
    keys: Mapping[str, str] = field(default_factory=dict)
    """The cache key of every stage."""
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


def run_context_of(
    campaign: OpenCampaign, folder: RunFolder, keys: Mapping[str, str], keep_going: bool = False
) -> RunContext:
    """The context of a run of a campaign."""
    return RunContext(
        folder=folder,
        document=campaign.document,
        ego_persona=campaign.ego_persona,
        personas={each.name: each for each in campaign.personas},
        ego_driver=campaign.ego_driver,
        other_egos=campaign.other_egos,
        policies=campaign.policies,
        policy_drivers=campaign.policy_drivers,
        keys=keys,
        keep_going=keep_going,
    )


@dataclass(frozen=True, kw_only=True)
class Attempt:
    """What earlier attempts at a stage, in this run of the command, leave to the next one."""

    first: bool = True
    """The first attempt plays again the games that could not be played in an earlier run of the command."""
    abandoned: Mapping[int, str] = field(default_factory=dict)
    """Episodes that crashed their worker too often, each with the reason."""


@dataclass(frozen=True, kw_only=True)
class StageRun:
    """One attempt to carry out a stage, and what is called on the way."""

    context: RunContext
    attempt: Attempt = Attempt()
    on_progress: OnProgress = lambda done, total: None
    on_start: OnStart = lambda place: None


Work: TypeAlias = Callable[[Stage, StageRun], dict[str, Any]]
"""Carries a stage out and returns its facts for the manifest."""
