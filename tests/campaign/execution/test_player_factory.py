"""The drivers that a plan names, as they are made."""

from __future__ import annotations

from pathlib import Path

import pytest

from harness.campaign.execution.player_factory import PlayerFactory
from harness.campaign.execution.stage_run import RunContext
from harness.campaign.plan.stages import PlannedDriver, Trained, TrainedBefore
from harness.campaign.storage.run_folder import RunFolder
from harness.config.campaign import Campaign
from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.drivers.policy_file import write_policy
from harness.evaluation.strategies import ATTENTIVE
from harness.road.scene.open_scene import open_scene
from tests.support.policies import some_policy
from tests.support.tiny import CAREFUL, PAPER_MERGE, TEXTING


@pytest.mark.parametrize("kind", [Trained, TrainedBefore])
def test_player__with_its_eyes_on_the_road_has_no_lapses_and_is_else_the_same(
    tmp_path: Path, kind: type[Trained] | type[TrainedBefore]
) -> None:
    folder = RunFolder(tmp_path)
    write_policy(some_policy(), folder.policy("texting-seed1"))
    persona = read_document(TEXTING, Persona)
    context = RunContext(
        folder=folder,
        document=Campaign.model_validate({"name": "a", "scene": "b", "personas": ["c"]}),
        ego_persona=read_document(CAREFUL, Persona),
        personas={"texting": persona},
        policies=folder.policy("texting-seed1").parent,
    )
    factory = PlayerFactory(context=context, scene=open_scene(PAPER_MERGE))

    def drives(planned: PlannedDriver) -> Persona:
        player = factory.player(planned)
        assert player is not None
        (member,) = player.members
        return member.persona

    own = kind(stage="texting-seed1", persona="texting")
    attentive = kind(stage="texting-seed1", persona="texting", borrowed=ATTENTIVE)
    assert drives(own) == persona
    assert persona.attention is not None
    assert drives(attentive) == persona.model_copy(update={"attention": None})
