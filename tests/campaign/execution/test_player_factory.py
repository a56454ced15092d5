"""The drivers that a plan names, as they are made."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.campaign.execution.player_factory import PlayerFactory
from harness.campaign.execution.stage_run import RunContext
from harness.campaign.plan.planned_drivers import (
    FixedMixture,
    PlannedDriver,
    Shipped,
    SumoDriven,
    Trained,
    TrainedBefore,
)
from harness.campaign.shipped_people import shipped_people
from harness.campaign.storage.run_folder import RunFolder
from harness.config.campaign import Campaign
from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.config.traits import with_trait_of
from harness.drivers.mixture import Member
from harness.drivers.policy_file import write_policy
from harness.evaluation.strategies import ATTENTIVE, Borrowed
from harness.game.observation_layout import SIZE
from harness.road.scene.open_scene import open_scene
from harness.shipped_documents import named_document
from tests.support.policies import some_policy
from tests.support.tiny import CAREFUL, PAPER_MERGE, SPEEDY, TEXTING

KINDS = pytest.mark.parametrize("kind", [Trained, TrainedBefore])


@pytest.fixture
def factory(tmp_path: Path) -> PlayerFactory:
    """A factory of players with policies of two people, read from the run folder or from that of another run."""
    folder = RunFolder(tmp_path)
    people = {name: read_document(file, Persona) for name, file in (("texting", TEXTING), ("speedy", SPEEDY))}
    for seed, name in enumerate(people):
        write_policy(some_policy(seed=seed), folder.policy(f"{name}-seed1"))
    context = RunContext(
        folder=folder,
        document=Campaign.model_validate({"name": "a", "scene": "b", "personas": ["c"]}),
        ego_persona=read_document(CAREFUL, Persona),
        people=people,
        policies=folder.policy("texting-seed1").parent,
    )
    return PlayerFactory(context=context, scene=open_scene(PAPER_MERGE))


def test_sides__of_a_scene_with_shipped_people_are_those_without_one_training_and_sumos_driver(
    factory: PlayerFactory,
) -> None:
    opponent = (FixedMixture(members=(SumoDriven(), Shipped(without=1)), shares=(1.0, 1.0)),)
    ((nobody, whole),) = factory.sides(opponent)  # no people of this scene: SUMO's driver plays all games
    assert (whole, [each.takes_over for each in nobody if each]) == (1.0, [False])
    cut_in = shipped_people(named_document("cut_in", "networks"))
    context = replace(factory.context, shipped={"paper_merge": cut_in})
    (people, share), (sumo, other) = replace(factory, context=context).sides(opponent)
    assert (share, other) == (0.5, 0.5)
    assert [each.takes_over for each in sumo if each] == [False]
    (mixture,) = people
    assert mixture is not None
    assert [each.persona.name for each in mixture.members] == ["impatient", "impatient", "speedy", "speedy"]
    assert [each.share for each in mixture.members] == [0.25] * 4


def member_of(factory: PlayerFactory, planned: PlannedDriver) -> Member:
    player = factory.player(planned)
    assert player is not None
    (member,) = player.members
    return member


@KINDS
def test_player__with_its_eyes_on_the_road_has_no_lapses_and_is_else_the_same(
    factory: PlayerFactory, kind: type[Trained] | type[TrainedBefore]
) -> None:
    persona = factory.context.persona("texting")
    assert persona.attention is not None
    assert member_of(factory, kind(stage="texting-seed1", persona="texting")).persona == persona
    attentive = kind(stage="texting-seed1", persona="texting", borrowed=ATTENTIVE)
    assert member_of(factory, attentive).persona == persona.model_copy(update={"attention": None})


@KINDS
def test_player__has_one_trait_of_another_persona(
    factory: PlayerFactory, kind: type[Trained] | type[TrainedBefore]
) -> None:
    texting, speedy = (factory.context.persona(name) for name in ("texting", "speedy"))
    for trait, stage in (("decisions", "texting-seed1"), ("payoff", "speedy-seed1")):
        borrowed = Borrowed(trait=trait, of="speedy")
        member = member_of(factory, kind(stage=stage, persona="texting", borrowed=borrowed))
        assert member.persona == with_trait_of(texting, trait, speedy)
        actions = [
            member.driver.decide(np.arange(1), np.zeros((1, SIZE)), np.full((1, 2), noise)).tolist() for noise in (0, 1)
        ]
        assert (actions[0] != actions[1]) == (member.persona.decisions == "sampled")
