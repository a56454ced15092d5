"""A campaign: which ego meets which personas on which scene, how they learn, and how they are judged."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from harness.config.scene import Name
from harness.config.toml_reading import Document, Mistakes

LEARNED, SUMO = "learned", "sumo"  # drivers an ego can have by name
ROBUST = "robust"  # what the ego is called that is retrained against several personas at once
OF_TRAINING = ("training", "non_ego_training", "retraining")  # the tables that say how players learn

Seed = Annotated[int, Field(ge=0, lt=2**31)]
CampaignName = Annotated[str, Field(min_length=1, max_length=40, pattern=r"^[A-Za-z][A-Za-z0-9_-]*$")]
DocumentPath = Annotated[str, Field(min_length=1, max_length=500, pattern=r"^[^\x00-\x1f]*$")]


class Ego(Document):
    """The vehicle under study."""

    driver: DocumentPath = LEARNED
    """`learned` by the campaign, `sumo` for SUMO's own models, or the folder of a policy."""
    persona: DocumentPath = "../personas/careful.toml"
    """The ego's own payoff."""


class Training(Document):
    """How players learn: PPO with the paper's table 1 as defaults."""

    steps: int = Field(3_000_000, ge=1_000, le=1_000_000_000)
    """Budget of each training, in steps of its player."""
    early_convergence: bool = True
    """Stop when the learning curve has settled (the rule is in the manifest)."""
    learning_rate: float = Field(1e-4, gt=0.0, le=1.0)
    """Step size of PPO's optimiser, Adam."""
    discount: float = Field(0.99, gt=0.0, le=1.0)
    """Gamma: what a payoff one step later is worth now."""
    clip: float = Field(0.1, gt=0.0, le=1.0)
    """Epsilon: how far an update may shift the odds of an action, as a share."""
    entropy_coefficient: float = Field(0.02, ge=0.0, le=1.0)
    """What a varied policy is worth in PPO's loss, so that it goes on exploring."""
    buffer: int = Field(2048, ge=64, le=1_000_000)
    """Steps gathered, over all games, between two updates."""
    games: int = Field(64, ge=1, le=1024)
    """Games played at once."""
    minibatch: int = Field(512, ge=8, le=1_000_000)
    """Steps in one gradient step; at most the buffer."""
    epochs: int = Field(10, ge=1, le=100)
    """Passes over the buffer in an update."""
    network: list[Annotated[int, Field(ge=1, le=1024)]] = Field([64, 64], min_length=1, max_length=6)
    """Sizes of the hidden layers, of actor and critic each."""
    initial_deviation: float = Field(0.5, gt=0.0, le=2.0)
    """Standard deviation of a new policy's actions."""
    max_deviation: float = Field(0.5, gt=0.0, le=2.0)
    """The greatest it may become: the entropy term raises it for ever where little is left to learn."""
    payoff_scale: float = Field(0.1, gt=0.0, le=1000.0)
    """What payoffs are multiplied by where PPO sees them (tables show them as they are): its step is bounded by the
    gradient of actor and critic together, and the errors of a critic of large payoffs leave the actor little of it."""
    segment_steps: int = Field(131_072, ge=1_024, le=100_000_000)
    """Training is kept on disk and its learning curve judged this often."""

    @model_validator(mode="after")
    def _divides(self) -> Training:
        if self.buffer % self.games:
            raise ValueError(f"buffer ({self.buffer}) must be a multiple of games ({self.games})")
        if self.initial_deviation > self.max_deviation:
            raise ValueError(
                f"initial_deviation ({self.initial_deviation:g}) must not exceed max_deviation ({self.max_deviation:g})"
            )
        if self.minibatch > self.buffer:
            raise ValueError(f"minibatch ({self.minibatch}) must not exceed buffer ({self.buffer})")
        return self


class NonEgoTraining(Document):
    """Round 1: how the non-ego learns."""

    alone_share: float = Field(0.7, ge=0.0, le=1.0)
    """Share of games without the ego: people learn on roads where mostly nobody is beside them."""
    attentive_share: float = Field(0.5, ge=0.0, le=1.0)
    """Share of the budget in which its attention does not lapse yet: people learn to drive before they text."""
    warm_start: bool = False
    """Begin from the naive ego's parameters, a driver who knows the empty road, rather than from nothing."""


class Retraining(Document):
    """Round 2: how the ego is retrained."""

    alone_share: float = Field(0.25, ge=0.0, le=1.0)
    """Share of games without the non-ego, so that nothing is forgotten."""
    warm_start: bool = False
    """Begin from the naive ego's parameters, rather than from nothing."""

    against: list[Name] = Field([], max_length=50)
    """Personas, by name, against all of whom one ego more is retrained, `robust`, in equal shares of its games and with
    as many times the budget. It meets those of the campaign who are left out as well: drivers whom it never met."""


class Population(Document):
    """A kind of traffic: drivers of several personas, one of whom a game has."""

    name: Name
    """What it is called, in stages, arms and tables."""
    shares: dict[Name, Annotated[float, Field(gt=0.0, le=1000.0)]] = Field(min_length=2, max_length=50)
    """Each persona's share of the games, by name. Shares are relative: 1 and 3 are a quarter and three quarters."""


class Rounds(Document):
    """How often non-ego and ego answer one another."""

    count: int = Field(2, ge=2, le=20)
    """The last round. In odd rounds the non-ego learns, in even rounds the ego; the paper ends after 2."""
    personas: list[Name] = Field([], max_length=50)
    """The personas, by name, whose exchange goes on after round 2. Left out: all."""
    against: Literal["latest", "all", "equilibrium"] = "latest"
    """Whom a player answers from round 3 on: the other player's latest strategy, all it has had so far in equal shares
    (fictitious play), or the equilibrium's mixture of them (policy-space response oracles)."""
    stop_early: bool | None = None
    """Whether an exchange ends when neither player's best response gains anything distinguishable from 0: it does, if
    it is left out and there is a table [best_response]."""


class BestResponse(Document):
    """How much each player of an arm could still gain by changing its strategy alone (equation 2): the last arm of each
    exchange is measured, and the arms that are named."""

    steps: int = Field(500_000, ge=1_000, le=1_000_000_000)
    """Budget of each training of a best response."""
    starts: int = Field(2, ge=1, le=20)
    """Trainings of each best response: the first begins from the player's own policy, the others from nothing."""
    choice_episodes: int = Field(100, ge=2, le=100_000)
    """Games, beside the assessment's, by which the best of them is chosen."""
    arms: list[Annotated[str, Field(min_length=1, max_length=200)]] = Field([], max_length=200)
    """Further arms to measure, by name."""


class CrossPlay(Document):
    """Every ego of the campaign meets every non-ego."""

    egos: list[DocumentPath] = Field([], max_length=50)
    """Other drivers who meet them too: as in `[ego] driver`, `sumo`, a driver document or the folder of a policy."""


class Reconfiguration(Document):
    """Round 2 of an ego that is given and has something to tune: how its parameters are searched."""

    trials: int = Field(40, ge=2, le=10_000)
    """Drivers tried, the first with the parameters that the ego has."""
    games: int = Field(64, ge=1, le=100_000)
    """Games of each trial, the same for all: the ego's mean payoff in them is what the search is for."""
    alone_share: float = Field(0.25, ge=0.0, le=1.0)
    """Share of those games without the non-ego, so that what worked is not lost."""
    games_at_once: int = Field(64, ge=1, le=1024)
    """Games played at once."""


class Assessment(Document):
    """How players are judged."""

    episodes: int = Field(100, ge=2, le=1_000_000)
    """Games of each arm; game k starts alike in every arm."""
    significance: float = Field(0.01, gt=0.0, lt=1.0)
    """The p-value, after Holm's correction, below which a difference is called real."""


class Campaign(Document):
    """One document, one command, one run folder."""

    name: CampaignName
    """What it is called; its run folder is reports/<name> if no other is given."""
    scene: DocumentPath
    """Folder of the scene: a path from this file."""
    personas: list[DocumentPath] = Field(min_length=1, max_length=50)
    """The people whom the ego meets, one after the other: paths of their files from this file."""
    seeds: list[Seed] = Field([1], min_length=1, max_length=100)
    """Training seeds: everything is trained and assessed once for each."""
    policies: DocumentPath | None = None
    """Folder of policies trained before, laid out as a run folder's `policies/`: nothing is trained, every learned
    player is read from it."""
    ego: Ego = Ego()
    training: Training = Training()
    non_ego_training: NonEgoTraining = NonEgoTraining()
    retraining: Retraining = Retraining()
    reconfiguration: Reconfiguration = Reconfiguration()
    population: list[Population] = Field([], max_length=50)
    """Kinds of traffic that the ego meets as it meets a persona, and is retrained against."""
    rounds: Rounds = Rounds()
    best_response: BestResponse | None = None
    crossplay: CrossPlay | None = None
    assessment: Assessment = Assessment()

    @field_validator("seeds")
    @classmethod
    def _distinct(cls, seeds: list[int]) -> list[int]:
        if len(set(seeds)) < len(seeds):
            raise ValueError("a seed stands twice")
        return seeds

    @model_validator(mode="after")
    def _nothing_is_ignored(self) -> Campaign:
        if self.policies is not None and (given := self._of_no_use()):
            message = "with `policies` nothing is trained: this table would be ignored"
            raise Mistakes([(name, message, "leave out this table or `policies`") for name in given])
        if self.rounds.stop_early and self.best_response is None:
            message = "without [best_response] nobody knows when an exchange has settled"
            raise Mistakes([("rounds.stop_early", message, "add [best_response] or leave it out")])
        if self.ego.driver != LEARNED and self.rounds.count > Rounds().count:
            message = "an ego that does not learn answers nobody: there is nothing after round 1"
            raise Mistakes([("rounds.count", message, "leave it out, or let the ego be learned")])
        if self.ego.driver != LEARNED and self.retraining.against:
            message = "an ego that does not learn can't be retrained"
            raise Mistakes([("retraining.against", message, "leave it out, or let the ego be learned")])
        return self

    def _of_no_use(self) -> list[str]:
        """The tables given that say how players learn, though none learns so."""
        given = [name for name in OF_TRAINING if name in self.model_fields_set]
        if self.retraining.model_fields_set <= {"against"} and "retraining" in given:
            given.remove("retraining")  # who met whom counts without a training as well
        return given if self.best_response is None else [name for name in given if name == "retraining"]

    @property
    def stops_early(self) -> bool:
        """Whether an exchange may end before its last round."""
        return self.best_response is not None and self.rounds.stop_early is not False

    def recorded(self) -> dict[str, Any]:
        """Every key that counts with its value, as a manifest holds it: how players learn or are tuned only where some
        may be."""
        unused: dict[str, Any] = {"reconfiguration": True} if self.ego.driver in (LEARNED, SUMO) else {}
        if self.policies is None:
            return self.model_dump(mode="json", exclude=unused)
        unused["retraining"] = {"alone_share", "warm_start"} if self.retraining.against else True
        if self.best_response is None:
            unused |= {"training": True, "non_ego_training": True}
        return self.model_dump(mode="json", exclude=unused)


def resolve(campaign_file: Path, written: str) -> Path:
    """A path in a campaign is relative to the campaign's own file."""
    return Path(os.path.realpath(campaign_file.parent / written))
