"""Makes the drivers that a plan names: reads policies, chooses the best of several."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from harness.assessment.rollout import assess_batches
from harness.assessment.seated_arm import SeatedArm
from harness.campaign.execution.mixture_weights import equilibrium_of
from harness.campaign.execution.stage_run import RunContext
from harness.campaign.plan.planned_drivers import (
    BestOf,
    EquilibriumMixture,
    External,
    FixedMixture,
    Learned,
    PlannedDriver,
    PlannedMember,
    Reconfigured,
    Shielded,
    Shipped,
    Side,
    SumoDriven,
    Trained,
    TrainedBefore,
    borrowed_of,
    by_control,
    driver_in,
    persona_of,
    without_shipped,
)
from harness.campaign.plan.stages import AssessmentStage
from harness.campaign.trained_policies import DRIVER
from harness.config.driver import read_driver
from harness.config.persona import Persona
from harness.config.traits import with_trait_of
from harness.config.tunable import Adjustable
from harness.drivers.car import car_of
from harness.drivers.mixture import Member, Mixture, mixture_of
from harness.drivers.policy_file import LearnedDriver, read_policy
from harness.drivers.protocol import Driver
from harness.drivers.shield import ShieldedDriver
from harness.drivers.sumo import SumoDriver
from harness.errors import StageFailed
from harness.game.roles import EGO
from harness.road.scene.open_scene import OpenScene

_LEAST_SHARE = 1e-6  # members of a mixture with a smaller share are left out


@dataclass(frozen=True, kw_only=True)
class PlayerFactory:
    """Makes players from planned drivers. A policy that can't be read raises UsageError, a driver that can't be made
    DriverError, and arms that weigh a mixture and have no equilibrium StageFailed."""

    context: RunContext
    scene: OpenScene

    def arm(self, stage: AssessmentStage) -> SeatedArm:
        """The arm of an assessment. A `BestOf` in it has to be `chosen` first."""
        return self.seated(stage.name, stage.ego, stage.non_ego)

    def seated(self, name: str, ego: Side, non_ego: Side) -> SeatedArm:
        """The two sides of an arm, with drivers that are made anew."""
        drivers = (self.player(driver_in(ego, 0)), *self.people(non_ego))
        return SeatedArm(name=name, scene=self.scene, drivers=drivers, seed=self.context.document.start_seed)

    def people(self, side: Side) -> tuple[Mixture | None, ...]:
        """The drivers in each place of the non-egos, each made anew."""
        return tuple(self.player(driver_in(side, place)) for place in range(len(self.scene.world.roles) - 1))

    def player(self, planned: PlannedDriver | None) -> Mixture | None:
        """The player of a planned driver; None for none."""
        match planned:
            case None:
                return None
            case FixedMixture(members=members, shares=shares):
                return self._mixture(members, shares)
            case EquilibriumMixture(members=members):
                return self._mixture(members, equilibrium_of(planned, self.context.folder))
            case Shielded(members=(member,)):
                return mixture_of(ShieldedDriver(self.driver(member), self.scene.world), self.persona(member))
            case BestOf():
                raise TypeError("choose the best with `chosen` first")
            case _:
                return self._mixture((planned,), (1.0,))

    def chosen(self, stage: AssessmentStage) -> tuple[AssessmentStage, dict[str, Any]]:
        """An assessment with the best driver in place of a `BestOf`, by its mean payoff in games beside the arm's own;
        and the facts of the choice. Other assessments are unchanged.

        Raises StageFailed where none of the games of a driver could be played.
        """
        planned = next((each for each in stage.drivers if isinstance(each, BestOf)), None)
        learner, episodes = stage.arm.best_response_of, self.context.document.assessment.episodes
        if planned is None or learner is None:
            return stage, {}
        games, candidates, earned = range(episodes, 2 * episodes), [], []
        for member in planned.members:
            sides = [*stage.sides]
            sides[learner] = (member,)
            candidates.append(replace(stage, ego=sides[0], non_ego=sides[1]))
            payoffs = (game.payoff_of(learner) for game in assess_batches(self.arm(candidates[-1]), [games]))
            measured = [payoff for payoff in payoffs if np.isfinite(payoff)]
            if not measured:
                raise StageFailed(f"{stage.id}: none of the games that choose the best response could be played")
            earned.append(float(np.mean(measured)))
        stages = [each.stage for each in planned.members if isinstance(each, Trained)]
        best = int(np.argmax(earned))
        return candidates[best], {"chosen": stages[best], "earned": dict(zip(stages, earned, strict=True))}

    def policy_folder(self, planned: Learned) -> Path:
        """The folder of a policy, of this run or of another."""
        if isinstance(planned, Trained):
            return self.context.folder.policy(planned.stage)
        assert self.context.policies is not None
        return self.context.policies / planned.stage

    def sides(self, opponent: Side) -> list[tuple[tuple[Mixture | None, ...], float]]:
        """An opponent of the ego as it plays in this scene: one or two sides, of which the harness drives all members
        or SUMO does, each with its share of the games. The drivers in each place are made anew."""
        has_people = self.scene.document.name in self.context.shipped
        sides = by_control(opponent if has_people else without_shipped(opponent))
        total = sum(share for _, share in sides)
        return [(self.people(side), share / total) for side, share in sides]

    def _mixture(self, members: tuple[PlannedMember, ...], shares: tuple[float, ...]) -> Mixture:
        found = list[Member]()
        for each, share in zip(members, shares, strict=True):
            if isinstance(each, Shipped):
                people = self.context.shipped[self.scene.document.name]
                for person in people:
                    found += person.members(each.without, share / len(people))
            elif share > _LEAST_SHARE:
                found.append(Member(driver=self.driver(each), persona=self.persona(each), share=share))
        return Mixture(tuple(found))

    def persona(self, planned: PlannedMember) -> Persona:
        """The persona with which a driver drives, with the trait that it borrows."""
        persona, borrowed = self.context.persona(persona_of(planned)), borrowed_of(planned)
        if borrowed is None:
            return persona
        return with_trait_of(persona, borrowed.trait, self.context.persona(borrowed.of) if borrowed.of else None)

    def driver(self, planned: PlannedMember) -> Driver:
        """The driver itself, without its persona."""
        sampled = self.persona(planned).decisions == "sampled"
        match planned:
            case SumoDriven():
                return SumoDriver()
            case External(name=name):
                return self.context.external_driver(name).make(car_of(self.scene.world, EGO), sampled)
            case Reconfigured(stage=stage):
                ego, file = self.context.external_driver(), self.context.folder.policy(stage) / DRIVER
                document = read_driver(file)
                if not isinstance(document, Adjustable):
                    raise StageFailed(f"{file}: is not the result of a search")
                found = ego.tuned({key: document.numbers[key] for key in ego.numbers})
                return found.make(car_of(self.scene.world, EGO), sampled)
            case TrainedBefore(stage=stage) if stage in self.context.policy_drivers:
                car = car_of(self.scene.world, EGO + 1 if persona_of(planned) else EGO)
                return self.context.policy_drivers[stage].make(car, sampled)
            case Shipped():
                raise TypeError("are several drivers")
            case Learned():
                return LearnedDriver(read_policy(self.policy_folder(planned)), sampled)
