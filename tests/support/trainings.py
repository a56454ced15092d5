"""Tiny trainings."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.game.roles import EGO
from harness.traffic.scene import OpenScene
from harness.training.ppo import Trained, train
from harness.training.training_games import TrainingSpec
from tests.support.tiny import CAREFUL, SPEEDY, settings


def naive_ego(scene: OpenScene) -> TrainingSpec:
    """The naive ego's spec, tiny: three segments."""
    careful, speedy = (read_document(file, Persona) for file in (CAREFUL, SPEEDY))
    return TrainingSpec(
        scene=scene,
        learner=EGO,
        personas=(careful, speedy),
        opponent=None,
        alone_share=1.0,
        attentive_share=0.0,
        initial=None,
        settings=settings(steps=3072),
        parts=("training", 1, "naive"),
    )


def in_one_go(spec: TrainingSpec, folder: Path, **options: Any) -> Trained:
    """Train from the start to the end, with a checkpoint in `folder`."""
    return train(spec, checkpoint=folder / "checkpoint.safetensors", key="key", card={}, **options)
