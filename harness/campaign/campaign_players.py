"""Who drives in a campaign: what preflight finds, and every stage of a run is given."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from harness.campaign.shipped_people import ShippedPerson
from harness.config.campaign import Campaign
from harness.config.persona import Persona
from harness.drivers.external import ExternalDriver


@dataclass(frozen=True, kw_only=True)
class CampaignPlayers:
    """The document of a campaign, with the personas, drivers and policies that it names."""

    document: Campaign
    ego_persona: Persona
    people: Mapping[str, Persona]
    """Every persona that drives as a non-ego, by name: those of the campaign, and the baseline."""
    ego_driver: ExternalDriver | None = None
    """The ego's external driver; None where the ego is learned or driven by SUMO's own models."""
    other_egos: Mapping[str, ExternalDriver] = field(default_factory=dict)
    """The external drivers of the cross-play, by name."""
    shipped: Mapping[str, tuple[ShippedPerson, ...]] = field(default_factory=dict)
    """The shipped people of the scene and the roads, by the name of the scene, where the ego is retrained against
    them."""
    policies: Path | None = None
    """The folder of policies trained in another run, where the campaign names one."""
    policy_drivers: Mapping[str, ExternalDriver] = field(default_factory=dict)
    """The policies of others in the folder `policies`, by name."""
