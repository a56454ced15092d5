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

An answer is never worse than what it answers with. PPO may end anywhere, also below the policy that the player has. So
a selection (`evaluation.game_theory.policy_selection`) follows each of these trainings: the player goes on with the
best of the new answer and all its earlier policies, by games against what the training played against. A rejected
answer takes part in the cross-play under that name. The paper's rounds 1 and 2 have no selection: whether a retrained
ego is worse than the naive one is their question (RQ2).

With `[best_response]` the rounds of a persona end early, when neither player's best response gains anything
distinguishable from 0, after searches that do not lack power (`execution.run_stage`): the later stages have nothing to
do.

A best response (equation 2 of the paper) tells how much a player can gain by changing its strategy alone. For an arm,
each player in turn learns again against the other player, which stays fixed, from several starts: first from its own
present policy, then from nothing. The best of these trainings is chosen by games that are played for this choice alone,
so that its gain in the arm's own games is not due to having been chosen by them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from harness.campaign.plan.alone_bounds import alone_bounds
from harness.campaign.plan.planned_drivers import (
    BestOf,
    EquilibriumMixture,
    FixedMixture,
    Learned,
    PlannedDriver,
    Side,
    Trained,
    members_of,
    persona_of,
)
from harness.campaign.plan.stages import (
    AssessmentStage,
    EquilibriumGate,
    Gate,
    RejectionGate,
    SelectionStage,
    Stage,
    TrainingStage,
)
from harness.campaign.plan.strategy_stages import SeedStages, ego_learns
from harness.config.campaign import Campaign
from harness.config.training import ATTENTIVE_SHARE
from harness.evaluation.strategies import (
    PAPER_ROUNDS,
    Arm,
    BestResponse,
    EgoStrategy,
    NaiveEgo,
    PersonaNonEgo,
    ReconfiguredEgo,
    RetrainedEgo,
    RoundAnswer,
    player_of,
    round_of,
    stage_id,
    strategy_name,
)
from harness.game.roles import EGO, NON_EGO


@dataclass(frozen=True, kw_only=True)
class PersonaRounds:
    """All strategies of one persona's rounds, for one seed, and the stages of the rounds after the paper's."""

    egos: list[EgoStrategy]
    non_egos: list[PersonaNonEgo]
    stages: list[Stage]

    def rejected(self, player: int) -> list[RoundAnswer]:
        """The answers of a player that a selection may reject, as they then play in the cross-play."""
        found = [each.strategy for each in self.stages if isinstance(each, SelectionStage)]
        return [RoundAnswer(of=each, is_rejected=True) for each in found if player_of(each) == player]


def persona_rounds(of: SeedStages, persona: str, tunable: bool = False) -> PersonaRounds:
    """All rounds of a persona. The stages of rounds 0 to 2 are those of `paper_rounds`."""
    campaign = of.campaign
    gates: tuple[Gate, ...] = ()
    egos: list[EgoStrategy] = [NaiveEgo()]
    non_egos = [PersonaNonEgo(persona=persona)]
    stages: list[Stage] = []
    rounds = PersonaRounds(egos=egos, non_egos=non_egos, stages=stages)
    if not ego_learns(campaign):
        egos.extend([ReconfiguredEgo(against=persona)] if tunable else [])
        return rounds
    iterates = not campaign.rounds.personas or persona in campaign.rounds.personas
    last = campaign.rounds.count if iterates else min(campaign.rounds.count, PAPER_ROUNDS)
    for round_ in range(PAPER_ROUNDS, last + 1):
        learner_is_ego = round_ % 2 == 0
        if learner_is_ego:
            egos.append(RetrainedEgo(against=persona, round=round_))
        else:
            non_egos.append(PersonaNonEgo(persona=persona, round=round_))
        of.gates[egos[-1] if learner_is_ego else non_egos[-1]] = gates
        if round_ > PAPER_ROUNDS:
            stages.extend(_plan_round(of, rounds, gates, ego_learns=learner_is_ego))
        if campaign.stops_early and learner_is_ego and round_ < last:
            pair = of.pair(egos[-1], non_egos[-1])
            stages.extend(plan_best_responses(campaign, pair))
            gates = (*gates, gate_of(campaign, pair))
    return rounds


def _plan_round(of: SeedStages, rounds: PersonaRounds, gates: tuple[Gate, ...], *, ego_learns: bool) -> list[Stage]:
    """Train an answer of a player, select with which policy it goes on, and assess this one against the other player's
    latest strategy and alone."""
    egos, non_egos = rounds.egos, rounds.non_egos
    persona = non_egos[0].persona
    own: Sequence[EgoStrategy] | Sequence[PersonaNonEgo]
    if ego_learns:
        own, alone, others = egos, Arm(ego=egos[-1]), [of.side(each) for each in non_egos]
        before = egos[:-1], non_egos
    else:
        own, alone, others = non_egos, Arm(non_ego=non_egos[-1]), [of.side(each) for each in egos]
        before = egos, non_egos[:-1]
    opponent, weighing = _opponent(of, others, *before)
    strategy = own[-1]
    assert isinstance(strategy, RetrainedEgo | PersonaNonEgo)
    answer = RoundAnswer(of=strategy)
    selected = stage_id(strategy_name(strategy), of.seed)
    rejection = RejectionGate(selection=selected, answer=stage_id(strategy_name(answer), of.seed))
    of.gates[answer] = gates
    of.gates[replace(answer, is_rejected=True)] = (*gates, rejection)
    training = of.training(answer, opponent, persona=persona)
    return [
        *weighing,
        training,
        *_selections(of, training, strategy, [policy for each in own for policy in of.side(_as_trained(each))]),
        of.pair(egos[-1], non_egos[-1]),
        of.assessment(alone, persona=persona),
    ]


def _selections(
    of: SeedStages,
    training: TrainingStage,
    strategy: RetrainedEgo | PersonaNonEgo,
    policies: Sequence[PlannedDriver],
) -> list[SelectionStage]:
    """The selection of a strategy after the training of its answer. None in a campaign with policies of another run,
    which has the player's strategies from there."""
    if of.campaign.policies is not None:
        return []
    selection = SelectionStage(
        seed=of.seed,
        persona=training.persona,
        strategy=strategy,
        candidates=tuple(each for each in policies if isinstance(each, Trained)),
        opponent=training.opponent,
        alone_share=training.alone_share,
        gates=training.gates,
    )
    return [selection]


def _as_trained(strategy: EgoStrategy | PersonaNonEgo) -> EgoStrategy | PersonaNonEgo | RoundAnswer:
    """A strategy of a player's rounds as its training made it, whatever was selected after that."""
    if isinstance(strategy, RetrainedEgo | PersonaNonEgo) and round_of(strategy) > PAPER_ROUNDS:
        return RoundAnswer(of=strategy)
    return strategy


def _opponent(
    of: SeedStages, others: Sequence[Side], egos: Sequence[EgoStrategy], non_egos: Sequence[PersonaNonEgo]
) -> tuple[Side, list[AssessmentStage]]:
    """The opponent in a training, one or several of the sides `others`; and the assessments by which it is weighed, if
    it is: those of `egos` against `non_egos`."""
    against = of.campaign.rounds.against
    if against == "latest" or len(others) == 1:
        return others[-1], []
    members = tuple(member for side in others for member in members_of(*side))
    if against == "all":
        return (FixedMixture(members=members, shares=(1.0,) * len(members)),), []
    arms = [[of.pair(ego, non_ego) for non_ego in non_egos] for ego in egos]
    ids = tuple(tuple(arm.id for arm in row) for row in arms)
    return (EquilibriumMixture(members=members, arms=ids),), [arm for row in arms for arm in row]


def plan_best_responses(campaign: Campaign, pair: AssessmentStage) -> list[Stage]:
    """The stages that measure how much each player of a pair can still gain: trainings, and an arm for each player."""
    return [stage for learner in (EGO, NON_EGO) for stage in _plan_response(campaign, pair, learner)]


def gate_of(campaign: Campaign, pair: AssessmentStage) -> EquilibriumGate:
    """The gate behind which there is nothing to do when neither player of a pair gains anything, and both can drive."""
    responses = (replace(pair.arm, best_response_of=learner) for learner in (EGO, NON_EGO))
    ego, non_ego = (stage_id(arm.name, pair.seed) for arm in responses)
    bounds = tuple(each for each in alone_bounds(campaign, pair.arm) if each.goal_share > 0)
    alone = tuple(stage_id(each.arm, pair.seed) for each in bounds)
    return EquilibriumGate(pair=pair.id, ego_response=ego, non_ego_response=non_ego, alone=alone, bounds=bounds)


def _plan_response(campaign: Campaign, pair: AssessmentStage, learner: int) -> list[Stage]:
    assert campaign.best_response is not None
    arm = replace(pair.arm, best_response_of=learner)
    (own,), other = pair.sides[learner], pair.sides[1 - learner]
    trainings = []
    for start in range(1, campaign.best_response.starts + 1):
        initial = own if start == 1 and isinstance(own, Learned) else None
        from_nothing = learner == NON_EGO and initial is None
        trainings.append(
            TrainingStage(
                seed=pair.seed,
                persona=pair.persona,
                strategy=BestResponse(arm=arm, start=start),
                opponent=other,
                initial=initial,
                alone_share=0.0,
                attentive_share=ATTENTIVE_SHARE if from_nothing else 0.0,
                gates=pair.gates,
            )
        )
    persona = persona_of(own)
    best = BestOf(members=tuple(Trained(stage=each.id, persona=persona) for each in trainings), persona=persona)
    ego, non_ego = ((best,), other) if learner == EGO else (other, (best,))
    return [*trainings, replace(pair, arm=arm, ego=ego, non_ego=non_ego)]
