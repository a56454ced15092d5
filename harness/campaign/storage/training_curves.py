"""Learning curves in a run folder: those of trainings that are done, and of one that goes on, from its checkpoint."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict

import pandas as pd
from pydantic import TypeAdapter, ValidationError
from safetensors import SafetensorError, safe_open

from harness.campaign.plan.stages import Stage, TrainingStage
from harness.campaign.storage.run_folder import RunFolder
from harness.config.training import CurvePoint
from harness.errors import UsageError
from harness.evaluation.tables import joined, read_csv, table_of

CHECKPOINT = "checkpoint.safetensors"
"""The file of a training between two segments, in the folder of its work."""


_POINTS = TypeAdapter(list[CurvePoint])


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
        points = _POINTS.validate_python(progress["curve"])
    except (UsageError, OSError, SafetensorError, LookupError, TypeError, ValueError, RecursionError, ValidationError):
        return table_of("training")
    named = {"stage": stage.name, "persona": stage.persona, "seed": stage.seed, "stopped": ""}
    return table_of("training", [{**named, **asdict(each)} for each in points])
