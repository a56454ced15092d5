"""Iterated best response: the rounds after the paper's, in which non-ego and ego go on answering one another.

In round 3 the non-ego learns against the retrained ego, in round 4 the ego against that non-ego, and so on. The
campaign chooses the opponent of each training:

| `[rounds] against` | the opponent in a training |
| --- | --- |
| latest | the other player's strategy of the round before |
| all | one of all the other player's strategies so far, drawn for each game (fictitious play: Brown 1951, \
Heinrich et al. 2015) |
| equilibrium | the same, drawn by the equilibrium of the game between all strategies so far (policy-space response \
oracles: Lanctot et al. 2017) |

With `[best_response]` the rounds of a persona end early, when neither player's best response gains anything
distinguishable from 0 (`execution.equilibrium_stop`): the later stages have nothing to do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from harness.campaign.plan.best_responses import gate_of, plan_best_responses
from harness.campaign.plan.planned_drivers import EquilibriumMixture, Mixture, PlannedDriver, PlannedMember
from harness.campaign.plan.stages import AssessmentStage, EquilibriumGate, Stage, TrainingStage
from harness.campaign.plan.strategy_drivers import driver_of, ego_learns, warm_start
from harness.config.campaign import Campaign
from harness.config.training import ATTENTIVE_SHARE
from harness.evaluation.strategies import (
    PAPER_ROUNDS,
    Arm,
    EgoStrategy,
    NaiveEgo,
    PersonaNonEgo,
    ReconfiguredEgo,
    RetrainedEgo,
)
from harness.game.roles import EGO, NON_EGO


@dataclass(frozen=True, kw_only=True)
class Ego:
    """An ego strategy of a campaign, and the driver that plays it."""

    strategy: EgoStrategy
    driver: PlannedMember
    persona: str = ""
    """The persona to whose rounds it belongs; empty: to none."""
    gates: tuple[EquilibriumGate, ...] = ()


@dataclass(frozen=True, kw_only=True)
class NonEgo:
    """A non-ego strategy of a campaign, and the driver that plays it."""

    strategy: PersonaNonEgo
    driver: PlannedMember
    gates: tuple[EquilibriumGate, ...] = ()


@dataclass(frozen=True, kw_only=True)
class PersonaRounds:
    """All strategies of one persona's rounds, for one seed, and the stages of the rounds after the paper's."""

    egos: tuple[Ego, ...]
    non_egos: tuple[NonEgo, ...]
    stages: tuple[Stage, ...] = ()


def persona_rounds(campaign: Campaign, persona: str, seed: int, tunable: bool = False) -> PersonaRounds:
    """All rounds of a persona. The stages of rounds 0 to 2 are those of `paper_rounds` and `search_rounds`."""
    egos = [Ego(strategy=NaiveEgo(), driver=driver_of(campaign, NaiveEgo(), seed), persona=persona)]
    non_egos = [_non_ego(campaign, PersonaNonEgo(persona=persona), seed)]
    if not ego_learns(campaign):
        if tunable:
            egos.append(_ego(campaign, ReconfiguredEgo(against=persona), seed))
        return PersonaRounds(egos=tuple(egos), non_egos=tuple(non_egos))
    stages: list[Stage] = []
    gates: tuple[EquilibriumGate, ...] = ()
    iterates = not campaign.rounds.personas or persona in campaign.rounds.personas
    last = campaign.rounds.count if iterates else PAPER_ROUNDS
    for round_ in range(PAPER_ROUNDS, last + 1):
        if round_ % 2 == 0:
            egos.append(_ego(campaign, RetrainedEgo(against=persona, round=round_), seed, gates))
        else:
            non_egos.append(_non_ego(campaign, PersonaNonEgo(persona=persona, round=round_), seed, gates))
        if round_ > PAPER_ROUNDS:
            stages += _plan_round(campaign, persona, seed, round_, egos, non_egos)
        if campaign.stops_early and round_ % 2 == 0 and round_ < last:
            pair = pairing(egos[-1], non_egos[-1], seed)
            stages += plan_best_responses(campaign, pair)
            gates = (*gates, gate_of(campaign, pair))
    return PersonaRounds(egos=tuple(egos), non_egos=tuple(non_egos), stages=tuple(stages))


def pairing(ego: Ego, non_ego: NonEgo, seed: int) -> AssessmentStage:
    """The assessment of an ego strategy against a non-ego strategy."""
    # In the rounds of one persona a later strategy has the gates of the earlier ones; across personas each has its own.
    same = ego.persona == non_ego.strategy.persona
    gates = max(ego.gates, non_ego.gates, key=len) if same else (*ego.gates, *non_ego.gates)
    return AssessmentStage(
        seed=seed,
        persona=non_ego.strategy.persona,
        arm=Arm(ego=ego.strategy, non_ego=non_ego.strategy),
        ego=ego.driver,
        non_ego=non_ego.driver,
        gates=gates,
    )


def _ego(
    campaign: Campaign,
    strategy: RetrainedEgo | ReconfiguredEgo,
    seed: int,
    gates: tuple[EquilibriumGate, ...] = (),
) -> Ego:
    driver = driver_of(campaign, strategy, seed)
    return Ego(strategy=strategy, driver=driver, persona=strategy.against, gates=gates)


def _non_ego(campaign: Campaign, strategy: PersonaNonEgo, seed: int, gates: tuple[EquilibriumGate, ...] = ()) -> NonEgo:
    return NonEgo(strategy=strategy, driver=driver_of(campaign, strategy, seed), gates=gates)


def _plan_round(
    campaign: Campaign, persona: str, seed: int, round_: int, egos: Sequence[Ego], non_egos: Sequence[NonEgo]
) -> list[Stage]:
    """Train the latest strategy, the last of its player's, and assess it against the other player's and alone."""
    learner = EGO if round_ % 2 == 0 else NON_EGO
    latest: Ego | NonEgo = egos[-1] if learner == EGO else non_egos[-1]
    settings = campaign.retraining if learner == EGO else campaign.non_ego_training
    opponent, weighing = _opponent(campaign, learner, egos, non_egos, seed)
    training = TrainingStage(
        seed=seed,
        persona=persona,
        strategy=latest.strategy,
        opponent=opponent,
        initial=warm_start(campaign, seed) if learner == EGO else None,
        alone_share=settings.alone_share,
        attentive_share=ATTENTIVE_SHARE if learner == NON_EGO else 0.0,
        gates=latest.gates,
    )
    if learner == EGO:
        arm, ego, non_ego = Arm(ego=egos[-1].strategy), latest.driver, None
    else:
        arm, ego, non_ego = Arm(non_ego=non_egos[-1].strategy), None, latest.driver
    alone = AssessmentStage(seed=seed, persona=persona, arm=arm, ego=ego, non_ego=non_ego, gates=latest.gates)
    return [*weighing, training, pairing(egos[-1], non_egos[-1], seed), alone]


def _opponent(
    campaign: Campaign, learner: int, egos: Sequence[Ego], non_egos: Sequence[NonEgo], seed: int
) -> tuple[PlannedDriver, list[AssessmentStage]]:
    """The opponent in a training of the latest strategy, and the assessments by which it is weighed, if it is."""
    others = [each.driver for each in (non_egos if learner == EGO else egos)]
    if campaign.rounds.against == "latest" or len(others) == 1:
        return others[-1], []
    if campaign.rounds.against == "all":
        return Mixture(members=tuple(others), shares=(1.0,) * len(others)), []
    rows = egos[:-1] if learner == EGO else egos
    columns = non_egos if learner == EGO else non_egos[:-1]
    arms = [[pairing(ego, non_ego, seed) for non_ego in columns] for ego in rows]
    ids = tuple(tuple(arm.id for arm in row) for row in arms)
    return EquilibriumMixture(members=tuple(others), arms=ids), [arm for row in arms for arm in row]
