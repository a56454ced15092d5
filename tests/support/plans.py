"""The plan of a tiny campaign."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from harness.campaign.execution.cache_keys import stage_keys
from harness.campaign.plan.plan import plan
from harness.campaign.plan.stages import Stage
from harness.campaign.preflight import open_campaign
from tests.support.tiny import write_campaign


def planned(folder: Path, **changes: Any) -> tuple[dict[str, Stage], dict[str, str]]:
    """A campaign's stages and their keys, by id and in order."""
    campaign = open_campaign(write_campaign(folder, **changes))
    stages = plan(campaign.document, [persona.name for persona in campaign.personas])
    assert len({stage.id for stage in stages}) == len(stages)
    return {stage.id: stage for stage in stages}, stage_keys(campaign, stages)
