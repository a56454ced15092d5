"""The keys of stages: what a second training seed changes, and what it does not."""

from __future__ import annotations

from pathlib import Path

from harness.campaign.execution.cache_keys import stage_keys
from harness.campaign.preflight import open_campaign
from tests.support.tiny import write_campaign


def keys(folder: Path, *seeds: int) -> dict[str, str]:
    campaign = open_campaign(write_campaign(folder, seeds=seeds, assessment={"episodes": 2, "reference_drivers": True}))
    return stage_keys(campaign, campaign.stages)


def test_keys__of_games_depend_on_the_first_seed_and_those_of_trainings_do_not(tmp_path: Path) -> None:
    first, second, both = keys(tmp_path, 1), keys(tmp_path, 2), keys(tmp_path, 1, 2)
    assert first.items() <= both.items()
    trainings = {name for name in second if name.rpartition("-")[0] in ("naive", "speedy", "retrained_speedy")}
    assert len(trainings) == 3
    assert {name for name in second if second[name] == both[name]} == trainings
