"""Makes the drivers that a plan names: reads policies, weighs mixtures, chooses the best of several."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.campaign.execution.run_context import RunContext
from harness.campaign.plan.planned_drivers import (
    BestOf,
    Crowd,
    EquilibriumMixture,
    External,
    Mixture,
    PlannedDriver,
    PlannedMember,
    Reconfigured,
    SumoDriven,
    Trained,
    TrainedBefore,
    description,
    persona_of,
)
from harness.campaign.plan.stages import AssessmentStage
from harness.campaign.storage.run_folder import RunFolder
from harness.config.persona import Persona
from harness.drivers.car import car_of
from harness.drivers.mixture import Member, Player
from harness.drivers.mixture import Mixture as DriverMixture
from harness.drivers.policy import LearnedDriver
from harness.drivers.policy_file import read_policy
from harness.drivers.protocol import Driver
from harness.drivers.sumo import SumoDriver
from harness.environments.rollout import Arm, assess
from harness.errors import StageFailed
from harness.evaluation.game_theory.nash import NoEquilibrium, equilibrium_shares
from harness.evaluation.tables import read_csv
from harness.game.roles import EGO, ROLES
from harness.traffic.scene import OpenScene

_LEAST_SHARE = 1e-6  # members of a mixture with a smaller share are left out


@dataclass(frozen=True, kw_only=True)
class Choice:
    """Of several drivers the one that was chosen, and the mean payoff of each, in their order."""

    stages: tuple[str, ...]
    mean_payoffs: tuple[float, ...]

    @property
    def best(self) -> int:
        """The place of the chosen one."""
        return int(np.argmax(self.mean_payoffs))


@dataclass(frozen=True, kw_only=True)
class PlayerFactory:
    """Makes players from planned drivers."""

    context: RunContext
    folder: RunFolder
    scene: OpenScene

    def player(self, planned: PlannedDriver | None) -> Player:
        """The player of a planned driver; None for none. Not for `BestOf`, which has to be chosen first, and not for
        `Crowd`, which is several players (`people.people_of`).

        Raises UsageError where a policy can't be read, DriverError where a driver can't be made, StageFailed where the
        arms that weigh a mixture have no equilibrium.
        """
        match planned:
            case None:
                return None
            case Mixture(members=members, shares=shares):
                return self._mixture(members, shares)
            case EquilibriumMixture(members=members):
                return self._mixture(members, equilibrium_of(planned, self.folder))
            case BestOf():
                raise TypeError("choose the best with `choose` first")
            case Crowd():
                raise TypeError("a crowd is several players")
            case _:
                return self._driver(planned)

    def choose(self, stage: AssessmentStage, personas: tuple[Persona, Persona], learner: int) -> tuple[Driver, Choice]:
        """The best of the drivers planned for a player of an arm, by its mean payoff in games beside the arm's own.

        Raises as `player` does, and StageFailed where none of these games could be played.
        """
        planned = stage.drivers[learner]
        assert isinstance(planned, BestOf)
        other = self.player(stage.drivers[1 - learner])
        episodes = self.context.document.assessment.episodes
        games = range(episodes, 2 * episodes)
        candidates = [self._driver(each) for each in planned.members]
        mean_payoffs = []
        for candidate in candidates:
            drivers = (candidate, other) if learner == EGO else (other, candidate)
            arm = Arm(name=stage.name, scene=self.scene, drivers=drivers, personas=personas, seed=stage.seed)
            payoffs = [game.record.get(f"{ROLES[learner]}_payoff") for game in assess(arm, games)]
            measured = [payoff for payoff in payoffs if payoff is not None]
            if not measured:
                raise StageFailed(f"{stage.id}: none of the games that choose the best response could be played")
            mean_payoffs.append(float(np.mean(measured)))
        stages = tuple(each.stage for each in planned.members if isinstance(each, Trained))
        choice = Choice(stages=stages, mean_payoffs=tuple(mean_payoffs))
        return candidates[choice.best], choice

    def policy_folder(self, planned: Trained | TrainedBefore) -> Path:
        """The folder of a policy, of this run or of another."""
        match planned:
            case Trained(stage=stage):
                return self.folder.policy(stage)
            case TrainedBefore(stage=stage):
                return self.context.policy_before(stage)

    def _mixture(self, members: tuple[PlannedMember, ...], shares: tuple[float, ...]) -> DriverMixture:
        return DriverMixture(
            tuple(
                Member(driver=self._driver(each), persona=self.context.persona(persona_of(each)), share=share)
                for each, share in zip(members, shares, strict=True)
                if share > _LEAST_SHARE
            )
        )

    def _driver(self, planned: PlannedMember) -> Driver:
        sampled = self.context.persona(persona_of(planned)).decisions == "sampled"
        match planned:
            case SumoDriven():
                return SumoDriver()
            case External(name=name):
                return self.context.external_driver(name).make(car_of(self.scene.world, EGO), sampled)
            case Reconfigured(stage=stage):
                from harness.campaign.execution.search_output import read_found  # Optuna is slow to import

                found = read_found(self.context.external_driver(), self.folder.policy(stage))
                return found.make(car_of(self.scene.world, EGO), sampled)
            case TrainedBefore(stage=stage) if stage in self.context.policy_drivers:
                car = car_of(self.scene.world, EGO + 1 if persona_of(planned) else EGO)
                return self.context.policy_drivers[stage].make(car, sampled)
            case Trained() | TrainedBefore():
                return LearnedDriver(read_policy(self.policy_folder(planned)), sampled)


def equilibrium_of(mixture: EquilibriumMixture, folder: RunFolder) -> tuple[float, ...]:
    """The shares of a mixture's members in the equilibrium of its arms.

    Raises StageFailed where there is none, or where no game of an arm could be played.
    """
    cells = [[_mean_payoffs(folder, arm) for arm in row] for row in mixture.arms]
    payoffs = np.array(cells, dtype=np.float64)  # [E, N, P]
    try:
        ego_shares, non_ego_shares = equilibrium_shares(payoffs[..., 0], payoffs[..., 1])
    except NoEquilibrium as error:
        raise StageFailed(f"the mixture of {description(mixture)} can't be weighed: {error}") from error
    are_egos = not any(persona_of(each) for each in mixture.members)
    return tuple(float(share) for share in (ego_shares if are_egos else non_ego_shares))


def _mean_payoffs(folder: RunFolder, arm: str) -> tuple[float, float]:
    episodes = read_csv(folder.work(arm) / "episodes.csv")
    played = episodes[episodes["error"] == ""]
    if played.empty:
        raise StageFailed(f"{arm}: none of its games could be played, so that it can't weigh a mixture")
    return float(played["ego_payoff"].mean()), float(played["non_ego_payoff"].mean())
