"""The drivers that play a strategy in a campaign, and the trainings and assessments that follow from strategies."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import PurePath

from harness.campaign.plan.planned_drivers import (
    External,
    Learned,
    PlannedDriver,
    PlannedMember,
    Reconfigured,
    Shipped,
    Side,
    SumoDriven,
    Trained,
    TrainedBefore,
    members_of,
    one_of,
    persona_of,
)
from harness.campaign.plan.stages import AssessmentStage, ConditioningStage, Gate, TrainingStage
from harness.config.campaign import LEARNED, SHIPPED, SUMO, Campaign
from harness.config.training import ATTENTIVE_SHARE, Training
from harness.config.traits import PAYOFF, UNREAD, PersonTraits
from harness.evaluation.strategies import (
    PAPER_ROUNDS,
    Arm,
    Borrowed,
    EgoStrategy,
    ManyPersonas,
    NaiveEgo,
    NonEgoStrategy,
    OtherEgo,
    PersonaNonEgo,
    ReconfiguredEgo,
    RetrainedEgo,
    RobustEgo,
    RoundAnswer,
    Strategy,
    SumoNonEgo,
    player_of,
    stage_id,
    strategy_name,
)
from harness.game.roles import NON_EGO


def ego_learns(campaign: Campaign) -> bool:
    """Whether the campaign's ego is a learned policy, trained in it or before."""
    return campaign.ego.driver == LEARNED


def has_round_2(campaign: Campaign) -> bool:
    """Whether an ego that learns is retrained against each persona alone."""
    return campaign.rounds.count >= PAPER_ROUNDS


def robust_is_last(campaign: Campaign) -> bool:
    """Whether the robust ego is the last one: none is retrained against one persona alone."""
    return ego_learns(campaign) and not has_round_2(campaign) and bool(campaign.retraining.against)


def crossplay_name(written: str) -> str:
    """The name of a driver in arms, which are names of files too: that of its document or folder, with "_" for all but
    letters and digits. `naive_seed1` for `policies/paper_merge/naive-seed11`."""
    name = PurePath(written).stem if written.endswith(".toml") else PurePath(written).name
    plain = re.sub("[^A-Za-z0-9]+", "_", name)
    return plain if plain[:1].isalpha() else f"ego_{plain}"


@dataclass(frozen=True, kw_only=True)
class SeedStages:
    """Makes the stages of one training seed of a campaign."""

    campaign: Campaign
    seed: int
    traits: PersonTraits = UNREAD
    gates: dict[Strategy, tuple[Gate, ...]] = field(default_factory=dict)
    """Of the strategies after round 2: the gates before their stages."""

    def side(self, strategy: EgoStrategy | NonEgoStrategy | None) -> Side:
        """The side that plays a strategy; no one for None."""
        match strategy:
            case None:
                return ()
            case PersonaNonEgo(persona=name) if name in self.campaign.mixed_people:
                return tuple(self.mixture(shares) for shares in self.campaign.mixed_people[name])
            case _:
                return (self._driver(strategy),)

    def mixture(self, shares: Mapping[str, float]) -> PlannedDriver:
        """Personas by their shares, one of which is drawn for each game; of one, its driver."""
        return one_of((self._driver(PersonaNonEgo(persona=name)), share) for name, share in shares.items())

    def robust_opponent(self, names: Iterable[str]) -> PlannedDriver:
        """The opponent in the training of the robust ego: personas, `sumo` or `shipped` in equal shares, one of them in
        each game. A persona has the policies of the other training seeds; of a single seed, its own."""
        named = [self._met_by_robust(name) for name in names]
        return one_of((driver, 1.0 / len(drivers)) for drivers in named for driver in drivers)

    def _met_by_robust(self, name: str) -> list[PlannedMember]:
        seeds = self.campaign.seeds
        if name == SUMO:
            return [SumoDriven()]
        if name == SHIPPED:
            return [Shipped(without=seeds.index(self.seed))]
        others = [seed for seed in seeds if seed != self.seed] or [self.seed]
        return [replace(self, seed=seed)._driver(PersonaNonEgo(persona=name)) for seed in others]

    def pair(self, ego: EgoStrategy, non_ego: PersonaNonEgo | RoundAnswer) -> AssessmentStage:
        person = non_ego.of if isinstance(non_ego, RoundAnswer) else non_ego
        assert isinstance(person, PersonaNonEgo)
        return self.assessment(Arm(ego=ego, non_ego=non_ego), persona=person.persona)

    def assessment(self, arm: Arm, *, persona: str = "") -> AssessmentStage:
        ego, non_ego = self.side(arm.ego), self.side(arm.non_ego)
        # a later strategy of a persona has the gates of the earlier ones of this persona
        gates = chain.from_iterable(self.gates[each] for each in (arm.ego, arm.non_ego) if each in self.gates)
        return AssessmentStage(
            seed=self.seed, persona=persona, arm=arm, ego=ego, non_ego=non_ego, gates=tuple(dict.fromkeys(gates))
        )

    def training(
        self,
        strategy: EgoStrategy | PersonaNonEgo | ManyPersonas | RoundAnswer,
        opponent: Side,
        *,
        persona: str = "",
    ) -> TrainingStage:
        """The training of a person, of several in one, or of an ego after the naive one."""
        campaign, is_person = self.campaign, player_of(strategy) == NON_EGO
        warm = campaign.retraining.warm_start and not is_person
        is_of_round_2 = isinstance(strategy, RetrainedEgo | RobustEgo)  # a later ego is a `RoundAnswer`
        by_regret = campaign.retraining.starts == "regret" and is_of_round_2
        return TrainingStage(
            seed=self.seed,
            persona=persona,
            strategy=strategy,
            opponent=opponent,
            initial=self._learned(NaiveEgo()) if warm else None,
            alone_share=campaign.non_ego_training.alone_share if is_person else campaign.retraining.alone_share,
            attentive_share=ATTENTIVE_SHARE if is_person else 0.0,
            gates=self.gates.get(strategy, ()),
            best_known=self._learned(NaiveEgo()) if by_regret else None,
        )

    def people(self, personas: Sequence[str]) -> Iterator[TrainingStage | ConditioningStage]:
        """The trainings of round 1: one for each persona, or one for all together, from which each gets its policy."""
        naive, together = self.side(NaiveEgo()), self.campaign.non_ego_training.together
        if not together or (len(personas) < 2 and self.campaign.policies is None):
            for name in personas:
                yield self.training(PersonaNonEgo(persona=name), naive, persona=name)
            return
        of_all = ManyPersonas(personas=tuple(personas))
        yield self.training(of_all, naive)
        for name in personas:
            yield ConditioningStage(seed=self.seed, persona=name, of=self._learned(of_all))

    def _driver(self, strategy: EgoStrategy | NonEgoStrategy) -> PlannedMember:
        match strategy:
            case SumoNonEgo() | OtherEgo(driver="sumo"):
                return SumoDriven()
            case OtherEgo(driver=name):
                return External(name=name)
            case ReconfiguredEgo():
                return Reconfigured(stage=stage_id(strategy_name(strategy), self.seed))
            case NaiveEgo() if not ego_learns(self.campaign):
                return SumoDriven() if self.campaign.ego.driver == SUMO else External()
            case PersonaNonEgo(persona=persona, borrowed=Borrowed(trait=trait, of=of) as borrowed):
                policy = PersonaNonEgo(persona=of) if trait == PAYOFF else replace(strategy, borrowed=None)
                return replace(self._learned(policy, persona), borrowed=borrowed)
            case RoundAnswer(of=of, is_rejected=True):
                return self._driver(RoundAnswer(of=of))
            case PersonaNonEgo(persona=persona) | RoundAnswer(of=PersonaNonEgo(persona=persona)):
                return self._learned(strategy, persona)
            case _:
                return self._learned(strategy)

    def _learned(self, strategy: Strategy, persona: str = "") -> Learned:
        stage = stage_id(strategy_name(strategy), self.seed)
        is_derived = self.campaign.non_ego_training.together and isinstance(strategy, PersonaNonEgo)
        if self.campaign.policies is None or is_derived:
            return Trained(stage=stage, persona=persona)
        return TrainedBefore(stage=stage, persona=persona)


def training_settings(campaign: Campaign, stage: TrainingStage) -> Training:
    """The settings of one training, with its budget.

    A best response has a budget of its own. A training in which each game has one of several personas, as the opponent
    or as the learner, has the budget, and the segment length by which its learning curve is judged, times their number.
    """
    settings = campaign.training
    if stage.is_best_response:
        assert campaign.best_response is not None
        return settings.model_copy(update={"steps": campaign.best_response.steps})
    met = max((len(set(map(_person, members_of(driver)))) for driver in stage.opponent), default=1)
    personas = met * len(stage.personas)
    more = {"steps": settings.steps * personas, "segment_steps": settings.segment_steps * personas}
    return settings.model_copy(update=more)


def _person(driver: PlannedMember) -> str | Shipped:
    """Whose driver it is: a persona has one in each round."""
    return driver if isinstance(driver, Shipped) else persona_of(driver)
