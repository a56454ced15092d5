"""Who plays in an arm of a run that is finished: read from the run folder alone."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from harness.campaign.execution.player_factory import PlayerFactory
from harness.campaign.execution.policies_of_run import policies_of_run
from harness.campaign.execution.run_context import RunContext
from harness.campaign.plan.plan import plan
from harness.campaign.plan.planned_drivers import (
    BestOf,
    Crowd,
    EquilibriumMixture,
    External,
    Mixture,
    PlannedDriver,
    PlannedMember,
    Reconfigured,
    Trained,
    TrainedBefore,
    persona_of,
)
from harness.campaign.plan.stages import AssessmentStage
from harness.campaign.storage.manifest import is_tuned
from harness.campaign.storage.run_folder import MANIFEST, RunFolder
from harness.config.campaign import Campaign
from harness.config.persona import Persona
from harness.config.toml_reading import nearest
from harness.drivers.car import car_of
from harness.drivers.external import find_driver
from harness.drivers.protocol import Driver
from harness.environments.rollout import Arm, parts_of
from harness.errors import UsageError
from harness.game.initial_state import draw_member
from harness.game.roles import EGO
from harness.traffic.scene import OpenScene, open_scene


@dataclass(frozen=True, kw_only=True)
class Seated:
    """A driver in a seat, with its persona; `policy` is the folder of its policy, None if it has none."""

    driver: Driver
    persona: Persona
    policy: Path | None = None


class RunPlayers:
    """The players of a run's arms. Raises UsageError for a damaged run, and for an ego that can't be made."""

    def __init__(
        self, folder: RunFolder, policies: Path | None = None, ego: str | None = None, allow_code: bool = False
    ) -> None:
        """`policies` is the folder of policies that the campaign read; None: it is searched by their checksums.
        `ego` is the campaign's external ego; None: it had none."""
        manifest = folder.manifest()
        driver = None if ego is None else find_driver(ego, Path("--ego"), "", allow_code)
        folder.check_whole(manifest)
        self.scene: OpenScene = open_scene(folder.scene, driver.vehicle_type if driver is not None else None)
        self._folder, self._ego = folder, driver
        document = Campaign.model_validate(manifest["campaign"], strict=False)
        self._stages = plan(document, manifest["personas"], is_tuned(manifest))
        self._context = RunContext(
            folder=folder.path,
            scene_folder=folder.scene,
            document=document,
            ego_persona=Persona.from_record(manifest["ego_persona"]),
            personas={name: Persona.from_record(each) for name, each in manifest["persona_documents"].items()},
            ego_driver=driver,
            other_egos={},
            policies=policies or policies_of_run(folder.path, document.policies, manifest["hashes"]),
            keys={},
        )

    def arms(self) -> list[AssessmentStage]:
        """The arms in which an ego meets people, with a driver each that this run can make again."""
        arms = [each for each in self._stages if isinstance(each, AssessmentStage)]
        return [each for each in arms if each.ego is not None and each.non_ego is not None and not _chosen(each)]

    def arm(self, name: str, seed: int) -> AssessmentStage:
        """An arm by name. Raises UsageError if there is none, or if its drivers were chosen by other arms."""
        arms = {(each.name, each.seed): each for each in self.arms()}
        if (name, seed) not in arms:
            names = [each for each, _ in arms] or ["(no arm)"]
            remedy = f"name an arm of an ego against people; {nearest(name, names)}"
            raise UsageError.of(self._folder.path, name, f"has no such arm of seed {seed}", remedy)
        return arms[name, seed]

    def ego(self, stage: AssessmentStage) -> Seated:
        """The ego of an arm. Raises UsageError if it can't be made."""
        persona = self._context.ego_persona
        assert stage.ego is not None
        if isinstance(stage.ego, External | Reconfigured):
            if self._ego is None or isinstance(stage.ego, Reconfigured) or stage.ego.name:
                raise UsageError.of(
                    self._folder.path / MANIFEST, stage.name, "its ego is no policy of this run", "name it with --ego"
                )
            driver = self._ego.make(car_of(self.scene.world, EGO), persona.decisions == "sampled")
            return Seated(driver=driver, persona=persona)
        return self._seated(stage.ego, persona)

    def people(self, stage: AssessmentStage, episode: int) -> tuple[Seated, ...]:
        """Each person of an arm in one episode. Raises UsageError if a policy can't be read."""
        assert stage.non_ego is not None
        count = len(self.scene.world.roles) - 1
        planned = stage.non_ego.members if isinstance(stage.non_ego, Crowd) else (stage.non_ego,) * count
        return tuple(
            self._seated(
                member := _member(each, player, stage.seed, episode), self._context.persona(persona_of(member))
            )
            for player, each in enumerate(planned, start=1)
        )

    def _seated(self, planned: PlannedDriver, persona: Persona) -> Seated:
        players = PlayerFactory(context=self._context, folder=self._folder, scene=self.scene)
        policy = None
        if isinstance(planned, TrainedBefore) and self._context.policies is None:
            message = f"{planned.stage!r} was read from {self._context.document.policies!r}"
            raise UsageError.of(self._folder.path, planned.stage, message, "it is not found: name it with --policies")
        if isinstance(planned, Trained | TrainedBefore):
            policy = players.policy_folder(planned)
        driver = players.player(planned)
        assert isinstance(driver, Driver)
        return Seated(driver=driver, persona=persona, policy=policy)


def seated_arm(scene: OpenScene, name: str, seed: int, ego: Seated, people: tuple[Seated, ...]) -> Arm:
    """The arm of an ego and people."""
    seats = (ego, *people)
    return Arm(
        name=name,
        scene=scene,
        drivers=tuple(each.driver for each in seats),
        personas=tuple(each.persona for each in seats),
        seed=seed,
    )


def _chosen(stage: AssessmentStage) -> bool:
    """Whether a driver of an arm was chosen or weighed by other arms, so that its policy alone does not tell it."""
    return any(isinstance(each, BestOf | EquilibriumMixture) for each in stage.drivers)


def _member(planned: PlannedDriver, player: int, seed: int, episode: int) -> PlannedMember:
    """Who of a mixture drives in an episode; the driver itself where there is one."""
    if isinstance(planned, Mixture):
        return planned.members[draw_member(planned.shares, player, *parts_of(seed, episode))]
    assert not isinstance(planned, BestOf | Crowd | EquilibriumMixture), "left out of `arms`"
    return planned
