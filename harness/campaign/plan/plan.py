"""The plan of a campaign: the paper's rounds, the rounds after them, best responses, and everyone against everyone."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import PurePath

from harness.campaign.plan.best_responses import is_pair, plan_responses
from harness.campaign.plan.iterated_rounds import Exchange, Strategy, arm, exchange
from harness.campaign.plan.paper_rounds import learned, learns, plan_robust, plan_rounds
from harness.campaign.plan.search_rounds import plan_searches, reconfigured
from harness.campaign.plan.stages import AssessmentStage, Drives, Stage, TrainingStage, arm_of
from harness.config.campaign import ROBUST, SUMO, Campaign


def plan(campaign: Campaign, personas: Sequence[str], tunable: bool = False) -> list[Stage]:
    """Every stage of a campaign against the personas named, each after what it needs. `tunable`: the ego is given,
    and has something to tune."""
    stages = [stage for seed in campaign.seeds for stage in _plan_seed(campaign, personas, seed, tunable)]
    if campaign.policies is None:
        return stages
    return [stage for stage in stages if not isinstance(stage, TrainingStage) or stage.responds_in]


def _plan_seed(campaign: Campaign, personas: Sequence[str], seed: int, tunable: bool) -> list[Stage]:
    exchanges = {persona: exchange(campaign, persona, seed, tunable) for persona in personas}
    stages = [*plan_rounds(campaign, personas, seed), *plan_robust(campaign, personas, seed)]
    stages += plan_searches(campaign, personas, seed) if tunable else []
    for each in exchanges.values():
        stages += each.stages
    if campaign.crossplay is not None:
        stages += _everyone(campaign, exchanges, seed)
    stages += _responses(campaign, exchanges, stages)
    return list(dict.fromkeys(stages))


def _responses(campaign: Campaign, exchanges: dict[str, Exchange], stages: Iterable[Stage]) -> list[Stage]:
    """Best responses in the last arm of every exchange, and in the arms that the campaign names."""
    if campaign.best_response is None:
        return []
    last = [arm_of(each.egos[-1].name, each.non_egos[-1].name) for each in exchanges.values()]
    arms = {stage.arm: stage for stage in stages if isinstance(stage, AssessmentStage)}
    named = dict.fromkeys((*last, *campaign.best_response.arms))
    pairs = [arms[name] for name in named if name in arms and is_pair(arms[name])]
    return [stage for pair in pairs for stage in plan_responses(campaign, pair)]


def _everyone(campaign: Campaign, exchanges: dict[str, Exchange], seed: int) -> list[Stage]:
    """The arms of every ego against every non-ego."""
    egos = {ego.name: ego for each in exchanges.values() for ego in each.egos}
    for name, drives in _beside_exchanges(campaign, seed, bool(egos.keys() - {"naive"})).items():
        egos[name] = Strategy(name, "", 0, drives)
    non_egos = [non_ego for each in exchanges.values() for non_ego in each.non_egos]
    return [arm(ego, non_ego, seed) for ego in egos.values() for non_ego in non_egos]


def _beside_exchanges(campaign: Campaign, seed: int, has_round_2: bool) -> dict[str, Drives]:
    """The egos of no one persona's exchange, by name: made against several, or brought along."""
    egos: dict[str, Drives] = {}
    for each in campaign.population if has_round_2 else ():
        if learns(campaign):
            egos[f"retrained_{each.name}"] = learned(campaign, f"retrained_{each.name}", seed)
        else:
            egos[f"reconfigured_{each.name}"] = reconfigured(each.name, seed)
    if learns(campaign) and campaign.retraining.against:
        egos[ROBUST] = learned(campaign, ROBUST, seed)
    return egos | other_egos(campaign)


def other_egos(campaign: Campaign) -> dict[str, Drives]:
    """The drivers that meet every non-ego beside the campaign's own egos, by name."""
    written = campaign.crossplay.egos if campaign.crossplay is not None else []
    return {name_of(each): Drives("sumo") if each == SUMO else Drives("given", name_of(each)) for each in written}


def name_of(written: str) -> str:
    """What a driver is called in arms: as its document or folder is."""
    return PurePath(written).stem if written.endswith(".toml") else PurePath(written).name
