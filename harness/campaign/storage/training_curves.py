"""Learning curves in a run folder: those of trainings that are done, and of one that goes on, from its checkpoint."""

from __future__ import annotations

import json
from collections.abc import Sequence

import pandas as pd
from pydantic import Field, ValidationError
from safetensors import SafetensorError, safe_open

from harness.campaign.plan.stages import Stage, TrainingStage
from harness.campaign.storage.run_folder import RunFolder
from harness.config.toml_reading import Document
from harness.errors import UsageError
from harness.evaluation.tables import joined, read_csv, table_of

CHECKPOINT = "checkpoint.safetensors"
"""The file of a training between two segments, in the folder of its work."""


class _Point(Document):
    steps: int = Field(ge=0, le=10**15)
    mean_payoff: float
    failure_rate: float
    games: int = Field(ge=0, le=10**12)
    mean_duration_s: float
    mean_regret: float | None = None


def curves_so_far(folder: RunFolder, stages: Sequence[Stage]) -> pd.DataFrame:
    """The table `training` of all trainings that have a curve. A file that can't be read has none: the campaign may be
    writing it."""
    trainings = [each for each in stages if isinstance(each, TrainingStage)]
    return joined("training", [_curve(folder, each) for each in trainings])


def _curve(folder: RunFolder, stage: TrainingStage) -> pd.DataFrame:
    table = folder.work(stage.id) / "training.csv"
    try:
        if table.is_file():
            return read_csv(table)
        with safe_open(folder.work(stage.id) / CHECKPOINT, framework="np") as file:
            progress = json.loads((file.metadata() or {})["progress"])
        points = [_Point.model_validate(each).model_dump() for each in progress["curve"]]
    except (UsageError, OSError, SafetensorError, LookupError, TypeError, ValueError, RecursionError, ValidationError):
        return table_of("training")
    named = {"stage": stage.name, "persona": stage.persona, "seed": stage.seed, "stopped": ""}
    return table_of("training", [{**named, **each} for each in points])
