"""From who is planned to drive to drivers: policies are read, mixtures weighed, the best of several chosen."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.campaign.execution.run_context import RunContext
from harness.campaign.plan.stages import AssessmentStage, Drives
from harness.campaign.storage.run_folder import RunFolder
from harness.config.persona import Persona
from harness.drivers.car import car_of
from harness.drivers.mixture import Member, Mixture, Player
from harness.drivers.policy import LearnedDriver
from harness.drivers.policy_file import read_policy
from harness.drivers.protocol import Driver
from harness.drivers.sumo import SumoDriver
from harness.environments.rollout import Arm, assess
from harness.errors import StageFailed
from harness.evaluation.game_theory.nash import NoEquilibrium, equilibrium_shares
from harness.evaluation.tables import read_csv
from harness.game.state import EGO, ROLES
from harness.traffic.scene import OpenScene

_LEAST_SHARE = 1e-6  # of a mixture that is worth a driver


@dataclass(frozen=True)
class PlayerFactory:
    """What drivers are made from."""

    conditions: RunContext
    folder: RunFolder
    scene: OpenScene

    def player(self, drives: Drives | None) -> Player:
        """Who drives; not for the best of several, who has to be chosen.

        Raises UsageError where a policy can't be read, DriverError where a driver can't be made, StageFailed where the
        arms that weigh a mixture have no equilibrium.
        """
        if drives is None:
            return None
        if drives.kind != "mixture":
            return self._driver(drives)
        shares = drives.shares or equilibrium_of(drives, self.folder)
        members = zip(drives.members, shares, strict=True)
        return Mixture(
            tuple(
                Member(driver=self._driver(each), persona=self.conditions.persona(each.persona), share=share)
                for each, share in members
                if share > _LEAST_SHARE
            )
        )

    def best(
        self, stage: AssessmentStage, personas: tuple[Persona, Persona], learner: int
    ) -> tuple[Player, list[float]]:
        """Of the members of a player of an arm the one who earns most, in games beside the arm's own, and what each
        of them earned on average. Raises as `player` does, StageFailed where no game could be played."""
        planned = (stage.ego, stage.non_ego)[learner]
        assert planned is not None
        other = self.player((stage.non_ego, stage.ego)[learner])
        candidates = [self._driver(each) for each in planned.members]
        first = self.conditions.document.assessment.episodes
        assert self.conditions.document.best_response is not None
        games = range(first, first + self.conditions.document.best_response.choice_episodes)
        earned = []
        for each in candidates:
            drivers = (each, other) if learner == EGO else (other, each)
            arm = Arm(name=stage.arm, scene=self.scene, drivers=drivers, personas=personas, seed=stage.seed)
            payoffs = [game.record.get(f"{ROLES[learner]}_payoff") for game in assess(arm, games)]
            measured = [payoff for payoff in payoffs if payoff is not None]
            if not measured:
                raise StageFailed(f"{stage.id}: none of the games could be played that decide which response is best")
            earned.append(float(np.mean(measured)))
        return candidates[int(np.argmax(earned))], earned

    def _driver(self, drives: Drives) -> Driver:
        if drives.kind == "sumo":
            return SumoDriver()
        sampled = self.conditions.persona(drives.persona).decisions == "sampled"
        if drives.kind == "given":
            return self.conditions.given(drives.stage).make(car_of(self.scene.world, EGO), sampled)
        if drives.kind == "reconfigured":
            from harness.campaign.execution.search_output import read_found  # Optuna is slow to import

            found = read_found(self.conditions.given(""), self.folder.policy(drives.stage))
            return found.make(car_of(self.scene.world, EGO), sampled)
        return LearnedDriver(read_policy(self.policy(drives)), sampled)

    def policy(self, drives: Drives) -> Path:
        """The folder of the policy that drives."""
        if drives.kind == "before":
            return self.conditions.policy_before(drives.stage)
        return self.folder.policy(drives.stage)


def equilibrium_of(drives: Drives, folder: RunFolder) -> list[float]:
    """The shares of a mixture's members in the equilibrium of the arms between all strategies so far.

    Raises StageFailed where there is none, or an arm of which no game could be played.
    """
    of_players = [[_mean_payoffs(folder, arm) for arm in row] for row in drives.weighed_by]
    payoffs = np.array(of_players, dtype=np.float64)  # [E, N, P]
    try:
        of_ego, of_non_ego = equilibrium_shares(payoffs[..., 0], payoffs[..., 1])
    except NoEquilibrium as error:
        raise StageFailed(f"the mixture of {drives.in_words} can't be weighed: {error}") from error
    are_egos = not any(each.persona for each in drives.members)
    return [float(share) for share in (of_ego if are_egos else of_non_ego)]


def _mean_payoffs(folder: RunFolder, arm: str) -> tuple[float, float]:
    episodes = read_csv(folder.work(arm) / "episodes.csv")
    played = episodes[episodes["error"] == ""]
    if played.empty:
        raise StageFailed(f"{arm}: none of its games could be played, so that it can weigh no mixture")
    return float(played["ego_payoff"].mean()), float(played["non_ego_payoff"].mean())
