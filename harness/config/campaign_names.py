"""The documents that a campaign names."""

from __future__ import annotations

from typing import Any

from pydantic import Field

from harness.config.campaign import LEARNED, DocumentPath, Ego
from harness.config.toml_reading import Excerpt


class _NamedByEgo(Excerpt):
    driver: DocumentPath = LEARNED
    persona: DocumentPath = Ego().persona
    perception: DocumentPath | dict[str, Any] | None = None


class _NamedByAttribution(Excerpt):
    baseline: DocumentPath


class CampaignNames(Excerpt):
    """The documents that a campaign names: they are checked even where the rest of it is wrong."""

    scene: DocumentPath
    roads: list[DocumentPath] = Field([])
    personas: list[DocumentPath]
    policies: DocumentPath | None = None
    ego: _NamedByEgo = _NamedByEgo()
    attribution: _NamedByAttribution | None = None
