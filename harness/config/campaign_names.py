"""The documents that a campaign names."""

from __future__ import annotations

from typing import Any

from pydantic import ConfigDict, Field

from harness.config.campaign import LEARNED, DocumentPath, Ego
from harness.config.toml_reading import Document


class _NamedByEgo(Document):
    model_config = ConfigDict(extra="ignore")
    driver: DocumentPath = LEARNED
    persona: DocumentPath = Ego().persona
    perception: DocumentPath | dict[str, Any] | None = None


class _NamedByAttribution(Document):
    model_config = ConfigDict(extra="ignore")
    baseline: DocumentPath


class CampaignNames(Document):
    """The documents that a campaign names: they are checked even where the rest of it is wrong."""

    model_config = ConfigDict(extra="ignore")
    scene: DocumentPath
    roads: list[DocumentPath] = Field([])
    personas: list[DocumentPath]
    policies: DocumentPath | None = None
    ego: _NamedByEgo = _NamedByEgo()
    attribution: _NamedByAttribution | None = None
