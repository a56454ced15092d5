"""The judgement of the failures of a run's arms: which of them reference drivers prevent, and how many these are."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd

from harness.campaign.storage.run_folder import JUDGED, RunFolder
from harness.errors import UsageError
from harness.evaluation.preventability import count_prevented
from harness.evaluation.tables import read_csv, typed


def preventability_tables(
    folder: RunFolder, done: Mapping[str, Mapping[str, Any]], episodes: pd.DataFrame
) -> dict[str, pd.DataFrame]:
    """The tables `reference_drivers` and `preventability` of the stages that are done; none where no arm is judged.

    Raises UsageError for a damaged table.
    """
    judged = [name for name, entry in done.items() if entry["kind"] == "preventability"]
    if not judged:
        return {}
    frames = [_games_of(folder, name, done[name]) for name in judged]
    games = typed(pd.concat(frames, ignore_index=True))
    return {"reference_drivers": games, "preventability": count_prevented(games, episodes)}


def _games_of(folder: RunFolder, stage: str, entry: Mapping[str, Any]) -> pd.DataFrame:
    file = folder.work(stage) / JUDGED
    games = read_csv(file)
    belong = (games["arm"] + "_preventability" == entry["name"]) & (games["seed"] == entry["seed"])
    if not belong.all():
        raise UsageError.of(file, "", f"has rows that are not of {stage}", "run the campaign again")
    return games
