"""The plan of a campaign: the paper's rounds, the rounds after them, best responses, and everyone against everyone."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import PurePath

from harness.documents.campaign import ROBUST, SUMO, Campaign
from harness.exchange import Exchange, exchange
from harness.plan_searches import plan_searches, reconfigured
from harness.responses import is_pair, plan_responses
from harness.rounds import (
    AssessmentStage,
    Drives,
    Stage,
    TrainingStage,
    arm_of,
    learned,
    learns,
    plan_robust,
    plan_rounds,
)


def plan(campaign: Campaign, personas: Sequence[str], tunable: bool = False) -> list[Stage]:
    """Every stage of a campaign against the personas named, each after what it needs. `tunable`: the ego is given,
    and has something to tune."""
    stages = [stage for seed in campaign.seeds for stage in _plan_seed(campaign, personas, seed, tunable)]
    if campaign.policies is None:
        return stages
    return [stage for stage in stages if not isinstance(stage, TrainingStage) or stage.responds_in]


def _plan_seed(campaign: Campaign, personas: Sequence[str], seed: int, tunable: bool) -> list[Stage]:
    exchanges = {persona: exchange(campaign, persona, seed) for persona in personas}
    stages = [*plan_rounds(campaign, personas, seed), *plan_robust(campaign, personas, seed)]
    stages += plan_searches(campaign, personas, seed) if tunable else []
    for each in exchanges.values():
        stages += each.stages
    if campaign.crossplay is not None:
        stages += _everyone(campaign, exchanges, seed, tunable)
    stages += _responses(campaign, exchanges, stages, tunable)
    return list(dict.fromkeys(stages))


def _responses(
    campaign: Campaign, exchanges: dict[str, Exchange], stages: Iterable[Stage], tunable: bool
) -> list[Stage]:
    """Best responses in the last arm of every exchange, and in the arms that the campaign names."""
    if campaign.best_response is None:
        return []
    last = [
        arm_of(f"reconfigured_{persona}" if tunable else each.egos[-1].name, each.non_egos[-1].name)
        for persona, each in exchanges.items()
    ]
    arms = {stage.arm: stage for stage in stages if isinstance(stage, AssessmentStage)}
    named = dict.fromkeys((*last, *campaign.best_response.arms))
    pairs = [arms[name] for name in named if name in arms and is_pair(arms[name])]
    return [stage for pair in pairs for stage in plan_responses(campaign, pair)]


def _everyone(campaign: Campaign, exchanges: dict[str, Exchange], seed: int, tunable: bool) -> list[Stage]:
    """The arms of every ego against every non-ego."""
    assert campaign.crossplay is not None
    egos = {ego.name: (ego.drives, ego.unless) for each in exchanges.values() for ego in each.egos}
    if learns(campaign):
        names = [f"retrained_{each.name}" for each in campaign.population]
        names += [ROBUST] if campaign.retraining.against else []
        egos |= {name: (learned(campaign, name, seed), ()) for name in names}
    if tunable:
        names = [*exchanges, *(each.name for each in campaign.population)]
        egos |= {f"reconfigured_{name}": (reconfigured(name, seed), ()) for name in names}
    egos |= {name: (drives, ()) for name, drives in other_egos(campaign).items()}
    return [
        AssessmentStage(
            arm_of(name, non_ego.name),
            seed,
            non_ego.persona,
            drives,
            non_ego.drives,
            max(unless, non_ego.unless, key=len) if non_ego.persona in name else (*unless, *non_ego.unless),
        )
        for name, (drives, unless) in egos.items()
        for each in exchanges.values()
        for non_ego in each.non_egos
    ]


def other_egos(campaign: Campaign) -> dict[str, Drives]:
    """The drivers that meet every non-ego beside the campaign's own egos, by name."""
    written = campaign.crossplay.egos if campaign.crossplay is not None else []
    return {name_of(each): Drives("sumo") if each == SUMO else Drives("given", name_of(each)) for each in written}


def name_of(written: str) -> str:
    """What a driver is called in arms: as its document or folder is."""
    return PurePath(written).stem if written.endswith(".toml") else PurePath(written).name
