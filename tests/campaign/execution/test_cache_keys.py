"""The keys of stages: what a second training seed changes, and what it does not."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

from harness.campaign.execution.cache_keys import stage_keys
from harness.campaign.preflight import open_campaign
from tests.support.tiny import PAPER_MERGE, write_campaign


def keys(folder: Path, *seeds: int, **changes: Any) -> dict[str, str]:
    assessed = {"episodes": 2, "reference_drivers": True}
    campaign = open_campaign(write_campaign(folder, seeds=seeds, assessment=assessed, **changes))
    return stage_keys(campaign, campaign.stages)


def test_keys__of_games_depend_on_the_first_seed_and_those_of_trainings_do_not(tmp_path: Path) -> None:
    first, second, both = keys(tmp_path, 1), keys(tmp_path, 2), keys(tmp_path, 1, 2)
    assert first.items() <= both.items()
    trainings = {name for name in second if name.rpartition("-")[0] in ("naive", "speedy", "retrained_speedy")}
    assert len(trainings) == 3
    assert {name for name in second if second[name] == both[name]} == trainings


def test_keys__of_trainings_of_egos_depend_on_the_roads_on_which_they_learn_too(tmp_path: Path) -> None:
    road = Path(shutil.copytree(PAPER_MERGE, tmp_path / "road"))
    alone, before = keys(tmp_path, 1), keys(tmp_path, 1, roads=[str(road)])
    document = road / "scene.toml"
    document.write_text(document.read_text() + "# changed\n")
    after = keys(tmp_path, 1, roads=[str(road)])
    assert len({each["naive-seed1"] for each in (alone, before, after)}) == 3
