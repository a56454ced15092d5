"""Rounds without end: non-ego and ego go on answering one another, each by a training of its own.

Round 3 is the non-ego's answer to the retrained ego, round 4 the ego's to that, and so on. Whom a player answers is
the campaign's choice:

| `[rounds] against` | the opponent in a training |
| --- | --- |
| latest | the other player of the round before |
| all | one of all it has been so far, by chance in each game (fictitious play: Brown 1951, Heinrich et al. 2015) |
| equilibrium | the same by the equilibrium of the game between all strategies so far (policy-space response oracles: \
Lanctot et al. 2017) |

With `[best_response]` an exchange ends early: when neither player's best response gains anything distinguishable from
0 (`harness.campaign.execution.equilibrium_stop`), there is nothing to do for what would follow.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from harness.campaign.plan.best_responses import plan_responses, response_arms
from harness.campaign.plan.paper_rounds import ego_of, learned, learns
from harness.campaign.plan.search_rounds import reconfigured
from harness.campaign.plan.stages import AssessmentStage, Drives, Gate, Stage, TrainingStage, arm_of, stage_id
from harness.config.campaign import Campaign
from harness.game.state import EGO, NON_EGO

PAPER_ROUNDS = 2


@dataclass(frozen=True)
class Strategy:
    """What a player may do: the driver that a round made of it."""

    name: str
    persona: str
    round: int
    drives: Drives
    unless: tuple[Gate, ...] = ()


def ego_name(persona: str, round_: int) -> str:
    """What the ego of an even round is called."""
    return "naive" if round_ == 0 else f"retrained_{persona}" + (f"_round{round_}" if round_ > PAPER_ROUNDS else "")


def non_ego_name(persona: str, round_: int) -> str:
    """What the non-ego of an odd round is called."""
    return persona if round_ == 1 else f"{persona}_round{round_}"


@dataclass(frozen=True)
class Exchange:
    """One persona's exchange with the ego, for one seed."""

    egos: tuple[Strategy, ...]
    non_egos: tuple[Strategy, ...]
    stages: tuple[Stage, ...]
    """Those of the rounds after the paper's, and the best responses that may end the exchange before."""


def exchange(campaign: Campaign, persona: str, seed: int, tunable: bool = False) -> Exchange:
    """All rounds of a persona. The stages of rounds 0 to 2 are `paper_rounds`'s, or for a given ego that is `tunable`
    those of `search_rounds`."""
    egos = [Strategy("naive", persona, 0, ego_of(campaign, seed))]
    non_egos = [Strategy(persona, persona, 1, learned(campaign, persona, seed, persona))]
    if not learns(campaign):
        tuned = Strategy(f"reconfigured_{persona}", persona, PAPER_ROUNDS, reconfigured(persona, seed))
        return Exchange((*egos, tuned) if tunable else tuple(egos), tuple(non_egos), ())
    stages: list[Stage] = []
    gates: tuple[Gate, ...] = ()
    goes_on = not campaign.rounds.personas or persona in campaign.rounds.personas
    last = campaign.rounds.count if goes_on else PAPER_ROUNDS
    for round_ in range(PAPER_ROUNDS, last + 1):
        if round_ % 2 == 0:
            name = ego_name(persona, round_)
            egos.append(Strategy(name, persona, round_, learned(campaign, name, seed), gates))
        else:
            name = non_ego_name(persona, round_)
            non_egos.append(Strategy(name, persona, round_, learned(campaign, name, seed, persona), gates))
        if round_ > PAPER_ROUNDS:
            stages += _round(campaign, persona, seed, round_, egos, non_egos)
        if campaign.stops_early and round_ % 2 == 0 and round_ < last:
            pair = arm(egos[-1], non_egos[-1], seed)
            stages += plan_responses(campaign, pair)
            gates = (*gates, Gate(pair.id, *response_arms(pair.arm, seed)))
    return Exchange(tuple(egos), tuple(non_egos), tuple(stages))


def _round(
    campaign: Campaign, persona: str, seed: int, round_: int, egos: Sequence[Strategy], non_egos: Sequence[Strategy]
) -> list[Stage]:
    learner = EGO if round_ % 2 == 0 else NON_EGO
    latest = egos[-1] if learner == EGO else non_egos[-1]
    others = list(non_egos if learner == EGO else egos)
    how = campaign.retraining if learner == EGO else campaign.non_ego_training
    initial = stage_id("naive", seed) if how.warm_start else None
    attentive = campaign.non_ego_training.attentive_share if learner == NON_EGO else 0.0
    stages: list[Stage] = []
    opponent = others[-1].drives
    if campaign.rounds.against != "latest" and len(others) > 1:
        weighed_by: tuple[tuple[str, ...], ...] = ()
        if campaign.rounds.against == "equilibrium":
            rows = list(egos[:-1] if learner == EGO else egos)
            columns = list(non_egos if learner == EGO else non_egos[:-1])
            stages += [arm(ego, non_ego, seed) for ego in rows for non_ego in columns]
            weighed_by = tuple(tuple(stage_id(arm_of(e.name, n.name), seed) for n in columns) for e in rows)
        shares = () if weighed_by else (1.0,) * len(others)
        opponent = Drives("mixture", members=tuple(o.drives for o in others), shares=shares, weighed_by=weighed_by)
    name, unless = latest.name, latest.unless
    training = (name, seed, persona, learner, opponent, initial, how.alone_share, attentive)
    stages.append(TrainingStage(*training, unless=unless))
    stages.append(arm(egos[-1], non_egos[-1], seed))
    ego, non_ego = (latest.drives, None) if learner == EGO else (None, latest.drives)
    stages.append(AssessmentStage(f"{name}_alone", seed, persona, ego, non_ego, unless))
    return stages


def arm(ego: Strategy, non_ego: Strategy, seed: int) -> AssessmentStage:
    """The arm of two strategies."""
    # of one exchange a later round has the gates of the earlier ones; of two, each has its own
    one = ego.persona == non_ego.persona
    unless = max(ego.unless, non_ego.unless, key=len) if one else (*ego.unless, *non_ego.unless)
    return AssessmentStage(arm_of(ego.name, non_ego.name), seed, non_ego.persona, ego.drives, non_ego.drives, unless)
