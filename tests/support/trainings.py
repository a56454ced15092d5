"""Tiny trainings."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.drivers.mixture import Mixture
from harness.game.roles import EGO, NON_EGO
from harness.road.scene.open_scene import OpenScene
from harness.training.ppo import TrainingResult, train
from harness.training.training_games import LearningPlace, TrainingSpec
from tests.support.tiny import CAREFUL, settings


def naive_ego(scene: OpenScene) -> TrainingSpec:
    """The naive ego's spec, tiny: three segments."""
    return TrainingSpec(
        personas=(read_document(CAREFUL, Persona),),
        places=(LearningPlace(scene=scene, player=EGO, drivers=(None, None)),),
        alone_share=1.0,
        attentive_share=0.0,
        initial=None,
        settings=settings(steps=3072),
        parts=("training", 1, "naive"),
    )


def beside(spec: TrainingSpec, player: int, other: Mixture | None, **changes: Any) -> TrainingSpec:
    """A training in another place, beside another driver."""
    drivers = (other, None) if player == NON_EGO else (None, other)
    return replace(spec, places=(LearningPlace(scene=spec.scene, player=player, drivers=drivers),), **changes)


def in_one_go(spec: TrainingSpec, folder: Path, **options: Any) -> TrainingResult:
    """Train from the start to the end, with a checkpoint in `folder`."""
    return train(spec, checkpoint=folder / "checkpoint.safetensors", key="key", card={}, **options)
