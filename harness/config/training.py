"""How a campaign trains its players, and searches the parameters of an ego that does not learn."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from pydantic import ConfigDict, Field, model_validator

from harness.config.scene import Name
from harness.config.toml_reading import Document

ATTENTIVE_SHARE = 0.5
"""Share of the budget of a person's training, at its start, without lapses of attention: people learn to drive before
they text."""


class Training(Document):
    """Training of the players with PPO. The defaults are those of table 1 of the paper."""

    steps: int = Field(3_000_000, ge=1_000, le=1_000_000_000)
    """Budget of each training, in steps of the player."""
    early_convergence: bool = True
    """Stop when the learning curve has converged (the manifest states the rule)."""
    learning_rate: float = Field(1e-4, gt=0.0, le=1.0)
    """Step size of Adam, the optimiser of PPO."""
    discount: float = Field(0.99, gt=0.0, le=1.0)
    """Gamma: factor of the payoff of the next step."""
    clip: float = Field(0.1, gt=0.0, le=1.0)
    """Epsilon: in an update, the probability ratio of an action is clipped to 1 - epsilon and 1 + epsilon."""
    entropy_coefficient: float = Field(0.02, ge=0.0, le=1.0)
    """Weight of the policy's entropy in the loss of PPO, which keeps the policy exploring."""
    buffer: int = Field(2048, ge=64, le=1_000_000)
    """Steps collected, over all games, between two updates."""
    games: int = Field(64, ge=1, le=1024)
    """Games played in parallel."""
    minibatch: int = Field(512, ge=8, le=1_000_000)
    """Steps per gradient step; at most the buffer. The last of a pass is smaller if it does not divide the buffer."""
    epochs: int = Field(10, ge=1, le=100)
    """Passes over the buffer per update."""
    network: list[Annotated[int, Field(ge=1, le=1024)]] = Field([64, 64], min_length=1, max_length=6)
    """Sizes of the hidden layers of the actor, and of the critic."""
    demonstration_steps: int = Field(38_400, ge=0, le=10_000_000)
    """Steps, over all games, in which a rule-based driver (adaptive cruise control and lane keeping; on foot an
    ordinary walker) shows a new policy the way; at most a fifth of `steps`. The policy imitates it before its
    training, and the critic learns the payoffs of these games. A person is shown its route alone: what it does about
    other players it learns from its payoff. 0: the policy begins with random parameters."""
    initial_deviation: float = Field(0.25, gt=0.0, le=2.0)
    """Standard deviation of the actions of a new policy. With a wide deviation nearly all games end at the rail at
    first, and the player learns to stand still, or to crash early, before it learns to drive."""
    max_deviation: float = Field(0.5, gt=0.0, le=2.0)
    """Upper bound of that standard deviation. Without it, the entropy term raises the standard deviation without limit
    once little is left to learn."""
    final_deviation: float = Field(0.1, gt=0.0, le=2.0)
    """Upper bound at the end of a training. A player that drives by the mean action meets other situations than one
    that explores; with a narrow deviation, the last updates are made where it drives."""
    narrowing_share: float = Field(0.1, ge=0.0, le=1.0)
    """Share of the budget in which the upper bound falls from `max_deviation` to `final_deviation`: the last part of
    the training, before its budget ends or after it has converged."""
    payoff_scale: float = Field(0.1, gt=0.0, le=1000.0)
    """Factor of the payoffs that PPO receives; tables show the payoffs without it. The gradients of actor and critic
    are clipped together: with large payoffs, the errors of the critic would leave little of the step to the actor."""
    segment_steps: int = Field(131_072, ge=1_024, le=100_000_000)
    """A checkpoint is written, and the learning curve evaluated, each time after this many steps."""
    learner: Literal["compiled", "stable_baselines3"] = "compiled"
    """`compiled`: Stable-Baselines3's PPO with its gradient steps in machine code, several times as fast.
    `stable_baselines3`: the reference; the numbers of an update are the same but for rounding."""

    @model_validator(mode="after")
    def _sizes_are_consistent(self) -> Training:
        if self.buffer % self.games:
            raise ValueError(f"buffer ({self.buffer}) must be a multiple of games ({self.games})")
        for small, large in (
            ("initial_deviation", "max_deviation"),
            ("final_deviation", "max_deviation"),
            ("minibatch", "buffer"),
        ):
            least, most = getattr(self, small), getattr(self, large)
            if least > most:
                raise ValueError(f"{small} ({least:g}) must not exceed {large} ({most:g})")
        return self


class NaiveTraining(Document):
    """Training of the ego in round 0."""

    alone_share: float = Field(0.3, ge=0.0, le=1.0)
    """Share of games without the non-ego. In the others SUMO's driver has its place, on foot an ordinary walker: the
    ego learns to cope with people who keep the rules, before it is tested with those who do not. The paper's is 1."""


class NonEgoTraining(Document):
    """Training of the non-ego in round 1."""

    alone_share: float = Field(0.5, ge=0.0, le=1.0)
    """Share of games without the ego: people learn to drive on empty roads as well."""
    together: bool = False
    """All personas learn in one training for each seed, one of them in each game, in equal shares: one network, which
    has the persona as a further input. Its budget is that of a training times the number of personas. Of each persona,
    the policy with this input fixed is written. With `policies`, the network is read from there. Left out: a training
    for each persona."""


class Retraining(Document):
    """Retraining of the ego in round 2."""

    alone_share: float = Field(0.25, ge=0.0, le=1.0)
    """Share of games without the non-ego, so that the ego does not forget what it has learned."""
    warm_start: bool = False
    """Start from the parameters of the naive ego, instead of random ones."""
    starts: Literal["uniform", "regret"] = "uniform"
    """Starts of the games against the non-ego. `uniform`: drawn from the scene's ranges. `regret`: half of them are
    replays of starts in which the ego earns less than a reference driver or the naive ego did."""
    against: list[Name] = Field([], max_length=50)
    """Names of personas; `sumo`: SUMO's own driver; `shipped`: the shipped people of the scene, and of each of `roads`.
    One more ego, `robust`, is retrained against all of them, in equal shares of its games, and with a budget multiplied
    by the number of names. It meets the people who learned with the other `seeds`, so that those against which it is
    assessed are new to it; with a single seed, those of this seed. It is assessed against the other personas of the
    campaign, too. Of the shipped people, one training of each is left out: the first of them for the first of `seeds`,
    and so on. Where a scene has none, the others have their games, or SUMO's driver."""


class Reconfiguration(Document):
    """Round 2 of an external ego with tunable parameters: the search of these parameters."""

    trials: int = Field(40, ge=2, le=10_000)
    """Number of trials of the search. The first has the parameters of the ego's document."""
    games: int = Field(64, ge=1, le=100_000)
    """Games of each trial, the same for all trials. The search maximises the ego's mean payoff in them."""
    alone_share: float = Field(0.25, ge=0.0, le=1.0)
    """Share of these games without the non-ego, so that the ego still drives well alone."""
    games_at_once: int = Field(64, ge=1, le=1024)
    """Games played in parallel."""


@dataclass(frozen=True, kw_only=True)
class CurvePoint:
    """A window of the learning curve of a training, and the games that ended in it."""

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid", allow_inf_nan=False)

    steps: Annotated[int, Field(ge=0, le=10**15)]
    """Steps of the training at the end of the window."""
    mean_payoff: float
    failure_rate: float
    games: Annotated[int, Field(ge=0, le=10**12)]
    mean_duration_s: float
    mean_regret: float | None = None
    """Over the preventable starts that the learner has replayed; None without any."""
