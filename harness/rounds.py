"""The plan: which trainings and which arms follow from a campaign, and what each needs first.

| round | stages of each seed |
| --- | --- |
| 0 | train `naive`; assess `naive_alone`, `naive_vs_sumo` |
| 1 | for each persona: train `<persona>` against the naive ego; assess `<persona>_alone`, `naive_vs_<persona>` |
| 2 | for each persona: train `retrained_<persona>`; assess `retrained_vs_<persona>`, `retrained_alone_<persona>` |

Round 2 of an ego that is given and has parameters to tune searches them: `reconfigured_<persona>` and its arms take the
place of `retrained_<persona>`. An ego with nothing to train and nothing to tune has no round 2. A campaign that names a
folder of policies has the same arms and no trainings: what they would have made is read from there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from harness.comparison import Question
from harness.documents.campaign import LEARNED, SUMO, Campaign
from harness.game.state import EGO, NON_EGO


@dataclass(frozen=True)
class Drives:
    """Who drives a player: SUMO, the campaign's given ego, that ego as a search reconfigured it, the policy that a
    training stage made, or the one that such a stage made before, in another run."""

    kind: Literal["sumo", "given", "reconfigured", "policy", "before"]
    stage: str = ""
    persona: str = ""
    """Whose habits it has; empty: the ego's own."""


@dataclass(frozen=True)
class TrainingStage:
    """One training: who learns, against whom, beginning from what."""

    name: str  # naive, <persona>, retrained_<persona>
    seed: int
    persona: str
    learner: int
    opponent: Drives | None
    initial: str | None
    alone_share: float
    attentive_share: float = 0.0

    @property
    def id(self) -> str:
        """What the stage and its policy are called in the run folder."""
        return stage_id(self.name, self.seed)

    @property
    def needs(self) -> tuple[str, ...]:
        """The stages that have to be done before."""
        return _stages(self.initial, self.opponent)


@dataclass(frozen=True)
class AssessmentStage:
    """One arm: its pairing, assessed."""

    arm: str
    seed: int
    persona: str
    ego: Drives | None
    non_ego: Drives | None

    @property
    def id(self) -> str:
        """What the stage and its files are called in the run folder."""
        return stage_id(self.arm, self.seed)

    @property
    def needs(self) -> tuple[str, ...]:
        """The stages that have to be done before."""
        return _stages(None, self.ego, self.non_ego)

    @property
    def reads(self) -> tuple[str, ...]:
        """The policies trained before that drive in it, each called after the stage that made it."""
        return tuple(each.stage for each in (self.ego, self.non_ego) if each is not None and each.kind == "before")


@dataclass(frozen=True)
class ReconfigurationStage:
    """One search: the given ego's parameters, on its own payoff, against whom."""

    name: str  # reconfigured_<persona>
    seed: int
    persona: str
    opponent: Drives

    @property
    def id(self) -> str:
        """What the stage and the driver it finds are called in the run folder."""
        return stage_id(self.name, self.seed)

    @property
    def needs(self) -> tuple[str, ...]:
        """The stages that have to be done before."""
        return _stages(None, self.opponent)

    @property
    def reads(self) -> tuple[str, ...]:
        """The policies trained before that drive in it, each called after the stage that made it."""
        return (self.opponent.stage,) if self.opponent.kind == "before" else ()


Stage = TrainingStage | AssessmentStage | ReconfigurationStage


def stage_id(name: str, seed: int) -> str:
    """A stage's name in the run folder."""
    return f"{name}-seed{seed}"


def _stages(initial: str | None, *drivers: Drives | None) -> tuple[str, ...]:
    made = ("policy", "reconfigured")
    named = [initial or "", *(each.stage for each in drivers if each is not None and each.kind in made)]
    return tuple(dict.fromkeys(name for name in named if name))


def plan(campaign: Campaign, personas: Sequence[str], tunable: bool = False) -> list[Stage]:
    """Every stage of a campaign against the personas named, each after what it needs. `tunable`: the ego is given,
    and has something to tune."""
    stages = [stage for seed in campaign.seeds for stage in _plan_seed(campaign, personas, seed, tunable)]
    if campaign.policies is not None:
        return [stage for stage in stages if not isinstance(stage, TrainingStage)]
    return stages


def _plan_seed(campaign: Campaign, personas: Sequence[str], seed: int, tunable: bool) -> list[Stage]:
    learned = campaign.ego.driver == LEARNED
    trained: Literal["policy", "before"] = "policy" if campaign.policies is None else "before"
    naive = stage_id("naive", seed)
    if learned:
        ego = Drives(trained, naive)
    else:
        ego = Drives("sumo" if campaign.ego.driver == SUMO else "given")
    stages: list[Stage] = []
    if learned:
        stages.append(TrainingStage("naive", seed, "", EGO, None, None, 1.0))
    for persona in personas:
        initial = naive if learned and campaign.non_ego_training.warm_start else None
        how = campaign.non_ego_training
        stages.append(
            TrainingStage(persona, seed, persona, NON_EGO, ego, initial, how.alone_share, how.attentive_share)
        )
    stages.append(AssessmentStage("naive_alone", seed, "", ego, None))
    stages.append(AssessmentStage("naive_vs_sumo", seed, "", ego, Drives("sumo")))
    for persona in personas:
        person = Drives(trained, stage_id(persona, seed), persona)
        if learned:
            name = f"retrained_{persona}"
            begins = naive if campaign.retraining.warm_start else None
            stages.append(TrainingStage(name, seed, persona, EGO, person, begins, campaign.retraining.alone_share))
        stages.append(AssessmentStage(f"{persona}_alone", seed, persona, None, person))
        stages.append(AssessmentStage(f"naive_vs_{persona}", seed, persona, ego, person))
        if learned:
            retrained = Drives(trained, stage_id(f"retrained_{persona}", seed))
            stages.append(AssessmentStage(f"retrained_vs_{persona}", seed, persona, retrained, person))
            stages.append(AssessmentStage(f"retrained_alone_{persona}", seed, persona, retrained, None))
        elif tunable:
            stages += _reconfiguration(persona, seed, person)
    return stages


def _reconfiguration(persona: str, seed: int, person: Drives) -> list[Stage]:
    name = f"reconfigured_{persona}"
    found = Drives("reconfigured", stage_id(name, seed))
    return [
        ReconfigurationStage(name, seed, persona, person),
        AssessmentStage(f"reconfigured_vs_{persona}", seed, persona, found, person),
        AssessmentStage(f"reconfigured_alone_{persona}", seed, persona, found, None),
    ]


def questions(campaign: Campaign, personas: Sequence[str], tunable: bool = False) -> list[Question]:
    """The research questions of a campaign (paper, section 4.2), for each persona and seed; `tunable` as in `plan`."""
    asked = []
    for persona in personas:
        for seed in campaign.seeds:
            against, retrained = f"naive_vs_{persona}", f"retrained_vs_{persona}"
            asked.append(Question("RQ1", persona, seed, "naive_alone", against))
            if campaign.ego.driver == LEARNED:
                asked.append(Question("RQ2", persona, seed, against, retrained))
            elif tunable:
                asked.append(Question("RQ2", persona, seed, against, f"reconfigured_vs_{persona}"))
    return asked
