"""Playing pinned games against an ego: each passes if the ego does not fail, as a test does."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from harness.assessment.seated_arm import SeatedArm
from harness.assessment.start_trials import StartTrials
from harness.config.campaign import SUMO, resolve
from harness.config.persona import Persona
from harness.config.pinned_game import PinnedGame, PinnedPerson
from harness.config.toml_reading import read_document
from harness.drivers.car import car_of
from harness.drivers.external import find_driver
from harness.drivers.mixture import Mixture, mixture_of
from harness.drivers.policy_file import LearnedDriver, policy_files, read_policy
from harness.drivers.protocol import Driver
from harness.drivers.sumo import SumoDriver
from harness.errors import Problem, UsageError, collect
from harness.files import has_digest
from harness.game.roles import EGO
from harness.road.scene.open_scene import OpenScene, open_scene


@dataclass(frozen=True, kw_only=True)
class PlayedAgain:
    """A pinned game, and how it ended for the ego."""

    name: str
    game: PinnedGame
    outcome: str
    error: str
    """Why it could not be played; empty if it was."""
    seconds: float

    @property
    def passed(self) -> bool:
        return self.outcome == "goal" and not self.error


class Regression:
    """The pinned games of a folder. Raises UsageError with every problem found in them, and if there are none."""

    def __init__(self, folder: Path, ego: str, allow_code: bool) -> None:
        files = sorted(folder.glob("*.toml"))
        if not files:
            remedy = "write some: harness minimise RUN --all"
            raise UsageError.of(folder, "", "contains no pinned game", remedy)
        self._ego = None if ego == SUMO else find_driver(ego, Path("--ego"), "", allow_code)
        problems: list[Problem] = []
        self._scenes: dict[Path, OpenScene] = {}
        opened = [collect(problems, partial(self._open, file)) for file in files]
        if problems:
            raise UsageError(problems)
        self._games = [(file.stem, *game) for file, game in zip(files, opened, strict=True) if game is not None]

    def play(self) -> Iterator[PlayedAgain]:
        """Play the games one after the other. Raises SimulationError if SUMO can't load a scene."""
        for name, game, persona, arm in self._games:
            started_s = time.monotonic()
            ego: Driver = SumoDriver()
            if self._ego is not None:
                ego = self._ego.make(car_of(arm.scene.world, EGO), persona.decisions == "sampled")
            drivers = (mixture_of(ego, persona), *arm.drivers[1:])
            with StartTrials(replace(arm, drivers=drivers), game.episode) as trials:
                record = trials.play(np.array([*game.start.position_m, *game.start.speed_mps])).record
            yield PlayedAgain(
                name=name,
                game=game,
                outcome=str(record["ego_outcome"]),
                error=str(record["error"]),
                seconds=time.monotonic() - started_s,
            )

    def _open(self, file: Path) -> tuple[PinnedGame, Persona, SeatedArm]:
        """A pinned game, the ego's persona, and the arm without an ego."""
        game = read_document(file, PinnedGame)
        scene_folder = resolve(file, game.scene)
        if scene_folder not in self._scenes:
            vehicle_type = self._ego.vehicle_type if self._ego is not None else None
            self._scenes[scene_folder] = open_scene(scene_folder, vehicle_type)
        scene = self._scenes[scene_folder]
        _check_scene(file, game.scene_sha256, scene)
        if len(game.people) != len(scene.world.roles) - 1:
            message = f"has {len(game.people)} people, but the scene has {len(scene.world.roles) - 1}"
            raise UsageError.of(file, "people", message, "pin the game again")
        persona = read_document(resolve(file, game.ego_persona), Persona)
        drivers = (None, *(_person(file, each) for each in game.people))
        start_seed = game.seed if game.start_seed is None else game.start_seed
        errors = None if game.ego_perception is None else game.ego_perception.errors
        if errors is not None and (self._ego is None or self._ego.vehicle_type is not None):
            message = "the ego drives with perception errors, and SUMO's driver models know what is there"
            raise UsageError.of(file, "ego_perception", message, "name another --ego, or leave out this game")
        scene = replace(scene, perception_errors=errors)
        return game, persona, SeatedArm(name=game.arm, scene=scene, drivers=drivers, seed=start_seed)


def _check_scene(file: Path, hashes: Mapping[str, str], scene: OpenScene) -> None:
    files = set(scene.document.files)
    same = {name for name in files & hashes.keys() if has_digest(scene.folder / name, [hashes[name]])}
    if changed := sorted((files | hashes.keys()) - same):
        message = f"is not the scene of this game: {', '.join(changed)} differs"
        raise UsageError.of(file, "scene", message, "pin the game again, or restore the scene")


def _person(file: Path, person: PinnedPerson) -> Mixture:
    persona = read_document(resolve(file, person.persona), Persona)
    if person.policy is None:
        return mixture_of(SumoDriver(), persona)
    folder = resolve(file, person.policy)
    policy = read_policy(folder)
    if not has_digest(policy_files(folder)[1], [person.policy_sha256 or ""]):
        message = f"{person.policy!r} is not the policy of this game"
        raise UsageError.of(file, "people.policy_sha256", message, "pin the game again, or restore the policy")
    return mixture_of(LearnedDriver(policy, persona.decisions == "sampled"), persona)
