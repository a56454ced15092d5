"""The driver that plays a strategy in a campaign: trained in it, trained before, searched, or external."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import PurePath

from harness.campaign.plan.planned_drivers import (
    Crowd,
    External,
    Mixture,
    PlannedDriver,
    PlannedMember,
    Reconfigured,
    SumoDriven,
    Trained,
    TrainedBefore,
)
from harness.campaign.plan.stages import stage_id
from harness.config.campaign import LEARNED, SUMO, Campaign
from harness.evaluation.strategies import (
    NaiveEgo,
    OtherEgo,
    PersonaNonEgo,
    ReconfiguredEgo,
    Strategy,
    SumoNonEgo,
    strategy_name,
)


def ego_learns(campaign: Campaign) -> bool:
    """Whether the campaign's ego is a learned policy, trained in it or before."""
    return campaign.ego.driver == LEARNED


def driver_of(campaign: Campaign, strategy: Strategy, seed: int) -> PlannedMember:
    """The driver that plays a strategy, for one training seed. A population has none: see `population_driver`."""
    stage = stage_id(strategy_name(strategy), seed)
    match strategy:
        case SumoNonEgo() | OtherEgo(driver="sumo"):
            return SumoDriven()
        case OtherEgo(driver=name):
            return External(name=name)
        case ReconfiguredEgo():
            return Reconfigured(stage=stage)
        case NaiveEgo() if not ego_learns(campaign):
            return SumoDriven() if campaign.ego.driver == SUMO else External()
        case PersonaNonEgo(persona=persona):
            return learned_driver(campaign, stage, persona)
        case _:
            return learned_driver(campaign, stage)


def learned_driver(campaign: Campaign, stage: str, persona: str = "") -> Trained | TrainedBefore:
    """The policy of a training stage: made by this plan, or read from the campaign's folder of policies."""
    if campaign.policies is None:
        return Trained(stage=stage, persona=persona)
    return TrainedBefore(stage=stage, persona=persona)


def population_driver(campaign: Campaign, shares: Mapping[str, float], seed: int) -> PlannedDriver:
    """Personas by their shares, one of which is drawn for each game."""
    members = tuple(driver_of(campaign, PersonaNonEgo(persona=name), seed) for name in shares)
    return Mixture(members=members, shares=tuple(shares.values()))


def crowd_driver(campaign: Campaign, personas: Sequence[str], seed: int) -> Crowd:
    """A persona for each person of the scene."""
    return Crowd(members=tuple(driver_of(campaign, PersonaNonEgo(persona=name), seed) for name in personas))


def mixed_people(campaign: Campaign, seed: int) -> dict[str, PlannedDriver]:
    """The populations and crowds of a campaign, by name: opponents that are made of several personas."""
    populations = {each.name: population_driver(campaign, each.shares, seed) for each in campaign.population}
    return populations | {each.name: crowd_driver(campaign, each.personas, seed) for each in campaign.crowd}


def crossplay_drivers(campaign: Campaign) -> dict[str, PlannedMember]:
    """The drivers of the cross-play beside the campaign's own egos, by name."""
    written = campaign.crossplay.egos if campaign.crossplay is not None else []
    return {name: driver_of(campaign, OtherEgo(driver=name), 0) for name in map(crossplay_name, written)}


def crossplay_name(written: str) -> str:
    """The name of a driver in arms, which are names of files too: that of its document or folder, with "_" for all but
    letters and digits. `naive_seed1` for `policies/merge/naive-seed1`."""
    name = PurePath(written).stem if written.endswith(".toml") else PurePath(written).name
    plain = re.sub("[^A-Za-z0-9]+", "_", name)
    return plain if plain[:1].isalpha() else f"ego_{plain}"


def warm_start(campaign: Campaign, seed: int) -> Trained | TrainedBefore | None:
    """The naive ego, from whose parameters a retraining starts if the campaign says so; None: from random ones."""
    if not campaign.retraining.warm_start:
        return None
    return learned_driver(campaign, stage_id(strategy_name(NaiveEgo()), seed))
