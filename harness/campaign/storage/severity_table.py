"""The severity of an arm's games as a table beside its records, worked out from its traces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from harness.campaign.storage.manoeuvre_table import EPISODES
from harness.campaign.storage.run_folder import RunFolder
from harness.errors import UsageError
from harness.evaluation.severity.measures import Kind, severity_of
from harness.evaluation.tables import SEVERITY_TABLE, read_csv, typed, write_csv
from harness.evaluation.trace_file import read_traces
from harness.traffic.scene import OpenScene

SEVERITY = "severity-1.csv"
"""The number is raised when a definition changes: the tables of earlier ones are not used."""
_GAME = ["arm", "seed", "episode"]


def kinds_of(scene: OpenScene) -> Mapping[str, Kind]:
    """The scene's vehicle types as severity needs them."""
    return {
        name: Kind(length_m=kind.length_m, width_m=kind.width_m, vehicle_class=kind.vehicle_class)
        for name, kind in scene.routes.types.items()
    }


def find_severity(episodes: pd.DataFrame, traces: Path, scene: OpenScene) -> pd.DataFrame:
    """The severity of the games of an arm that were played; `episodes` has a row per game."""
    kinds = kinds_of(scene)
    games = {game.episode: game for game in episodes.itertuples() if not game.error}
    rows = [
        {"arm": game.arm, "seed": game.seed, "episode": episode, **severity_of(trace, scene.world, kinds)}
        for episode, trace in read_traces(traces)
        if (game := games.get(episode)) is not None
    ]
    return typed(pd.DataFrame(rows, columns=list(SEVERITY_TABLE)))


def severity_table(folder: RunFolder, stage: str, scene: OpenScene) -> pd.DataFrame:
    """The severity of an arm's games. It is worked out now if the stage has no such table, or a damaged one."""
    file = folder.work(stage) / SEVERITY
    if file.is_file():
        try:
            return read_csv(file)
        except UsageError:
            pass
    table = find_severity(read_csv(folder.work(stage) / EPISODES), folder.traces(stage), scene)
    write_csv(table, file)
    return table


def with_severity(episodes: pd.DataFrame, tables: Sequence[pd.DataFrame]) -> pd.DataFrame:
    """The records of games with the columns of severity, from the tables of their arms."""
    found = pd.concat([pd.DataFrame(columns=list(SEVERITY_TABLE)), *tables], ignore_index=True)
    return typed(episodes.merge(found.astype({"seed": "int64", "episode": "int64"}), on=_GAME, how="left"))
