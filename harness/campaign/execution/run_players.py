"""Who plays in an arm of a run that is finished: read from the run folder alone."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath

from harness.assessment.seated_arm import SeatedArm
from harness.campaign.execution.player_factory import PlayerFactory
from harness.campaign.execution.stage_run import RunContext
from harness.campaign.plan.planned_drivers import (
    BestOf,
    EquilibriumMixture,
    External,
    FixedMixture,
    Learned,
    PlannedMember,
    Reconfigured,
    Shielded,
    TrainedBefore,
    driver_in,
    members_of,
)
from harness.campaign.plan.stages import AssessmentStage
from harness.campaign.storage.manifest import campaign_in, planned
from harness.campaign.storage.run_folder import MANIFEST, RunFolder
from harness.config.persona import Persona
from harness.config.toml_reading import nearest
from harness.drivers.external import find_driver
from harness.errors import UsageError
from harness.evaluation.strategies import ErrorFreeEgo
from harness.files import has_digest
from harness.game.initial_state import member_in_episode
from harness.game.roles import EGO
from harness.road.scene.open_scene import OpenScene, open_scene
from harness.shipped_documents import shipped


@dataclass(frozen=True, kw_only=True)
class SeatedDriver:
    """Who drives in a seat: its persona, and the folder of its policy; None if it has none."""

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
        self._folder, self._ego = folder, driver
        self.document = document = campaign_in(manifest)
        opened = open_scene(folder.scene, driver.vehicle_type if driver is not None else None)
        self.scene: OpenScene = replace(opened, perception_errors=document.ego.perception_errors)
        self._stages = planned(manifest)
        context = RunContext(
            folder=folder,
            document=document,
            ego_persona=Persona.from_record(manifest["ego_persona"]),
            people={name: Persona.from_record(each) for name, each in manifest["persona_documents"].items()},
            ego_driver=driver,
            policies=policies or self._found_policies(manifest["hashes"]),
        )
        self._players = PlayerFactory(context=context, scene=self.scene)

    def _found_policies(self, hashes: Mapping[str, str]) -> Path | None:
        names = {name for stage in self._stages for name in stage.reads}
        return policies_of_run(self._folder.path, self.document.policies, hashes, names)

    def arms(self) -> list[AssessmentStage]:
        """The arms in which an ego meets people, with a driver each that this run can make again: none that other arms
        chose or weighed, nor a shielded one, nor one without the perception errors of the campaign."""
        arms = [each for each in self._stages if isinstance(each, AssessmentStage) and each.ego and each.non_ego]
        left_out = BestOf | EquilibriumMixture | Shielded
        with_errors = [arm for arm in arms if not isinstance(arm.arm.ego, ErrorFreeEgo)]
        return [arm for arm in with_errors if not any(isinstance(each, left_out) for each in arm.drivers)]

    def arm(self, name: str, seed: int) -> AssessmentStage:
        """An arm by name. Raises UsageError if there is none, or if its drivers were chosen by other arms."""
        arms = {(each.name, each.seed): each for each in self.arms()}
        if (name, seed) not in arms:
            names = [each for each, _ in arms] or ["(no arm)"]
            remedy = f"name an arm of an ego against people; {nearest(name, names)}"
            raise UsageError.of(self._folder.path, name, f"has no such arm of seed {seed}", remedy)
        return arms[name, seed]

    def seated(self, stage: AssessmentStage) -> SeatedArm:
        """The players of an arm. Raises UsageError if one can't be made."""
        self.ego(stage)
        for member in members_of(*stage.non_ego):  # a policy that is missing is named
            self._seated(member, self._players.persona(member))
        return self._players.arm(stage)

    def ego(self, stage: AssessmentStage) -> SeatedDriver:
        """The ego of an arm. Raises UsageError if it is neither of this run nor named."""
        persona, planned = self._players.context.ego_persona, self._member(stage, EGO, episode=0)
        if isinstance(planned, External | Reconfigured):
            if self._ego is None or isinstance(planned, Reconfigured) or planned.name:
                raise UsageError.of(
                    self._folder.path / MANIFEST, stage.name, "its ego is no policy of this run", "name it with --ego"
                )
            return SeatedDriver(persona=persona)
        return self._seated(planned, persona)

    def people(self, stage: AssessmentStage, episode: int) -> tuple[SeatedDriver, ...]:
        """Each person of an arm in one episode. Raises UsageError if the folder of its policy is not found."""
        members = (self._member(stage, player, episode) for player in range(1, len(self.scene.world.roles)))
        return tuple(self._seated(each, self._players.persona(each)) for each in members)

    def _seated(self, planned: PlannedMember, persona: Persona) -> SeatedDriver:
        policy, context = None, self._players.context
        if isinstance(planned, TrainedBefore) and context.policies is None:
            message = f"{planned.stage!r} was read from {self.document.policies!r}"
            raise UsageError.of(self._folder.path, planned.stage, message, "it is not found: name it with --policies")
        if isinstance(planned, Learned):
            policy = self._players.policy_folder(planned)
        return SeatedDriver(persona=persona, policy=policy)

    def _member(self, stage: AssessmentStage, player: int, episode: int) -> PlannedMember:
        """Who of a mixture drives as a player in an episode; the driver itself where there is one."""
        planned = driver_in(stage.ego, 0) if player == EGO else driver_in(stage.non_ego, player - 1)
        if isinstance(planned, FixedMixture):
            return planned.members[member_in_episode(planned.shares, player, self.document.start_seed, episode)]
        assert planned is not None
        assert not isinstance(planned, BestOf | EquilibriumMixture | Shielded), "left out of `arms`"
        return planned


def policies_of_run(run: Path, written: str | None, hashes: Mapping[str, str], names: Collection[str]) -> Path | None:
    """The folder of policies that a run's campaign wrote as `written`, found again by the checksums of its manifest;
    None if there is none with the policies of `names`. The written path is not trusted. `hashes` may have other
    policies too: an ego's, which is not read from this folder.

    Shipped policies are searched, then the path from a folder beside the run folder, such as `campaigns/` beside
    `reports/`, and from the current folder.
    """
    read: dict[str, list[str]] = {}
    for file, digest in hashes.items():
        path = PurePosixPath(file)
        if path.parent.name in names and path.name in ("policy.json", "policy.safetensors"):
            read.setdefault(f"{path.parent.name}/{path.name}", []).append(digest)
    if written is None or not read:
        return None
    ours = shipped("policies")
    folders = sorted(each for each in ours.iterdir() if each.is_dir()) if ours.is_dir() else []
    if not PurePosixPath(written).is_absolute():
        folders += [start / written for start in (run.absolute().parent, run.absolute().parent.parent, Path.cwd())]
    return next((each for each in folders if all(has_digest(each / name, read[name]) for name in read)), None)
