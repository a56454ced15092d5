"""What traces tell of an arm's games, as tables beside its records: how severe each game is, and why the ego failed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from harness.campaign.storage.manoeuvre_table import EPISODES
from harness.campaign.storage.run_folder import RunFolder
from harness.errors import UsageError
from harness.evaluation.causes.columns import CAUSE_COLUMNS, cells_of
from harness.evaluation.causes.find import cause_of
from harness.evaluation.severity.measures import Kind, severity_of
from harness.evaluation.tables import SEVERITY_TABLE, read_csv, typed, write_csv
from harness.evaluation.trace_file import read_traces
from harness.traffic.scene import OpenScene

SEVERITY, CAUSES = "severity-2.csv", "causes-2.csv"
"""The number is raised when a definition changes: the tables of earlier ones are not used."""
_GAME = ["arm", "seed", "episode"]


def severity_table(folder: RunFolder, stage: str, scene: OpenScene) -> pd.DataFrame:
    """The severity of an arm's games. It is worked out now if the stage has no such table, or a damaged one."""
    return _kept_or_made(folder, stage, SEVERITY, lambda: _severity(folder, stage, scene))


def cause_table(folder: RunFolder, stage: str, scene: OpenScene) -> pd.DataFrame:
    """The causes of an arm's failures of the ego, as `severity_table`."""
    return _kept_or_made(folder, stage, CAUSES, lambda: _causes(folder, stage, scene))


def make_tables(folder: RunFolder, stage: str, scene: OpenScene) -> list[Path]:
    """Work out both tables of an arm and return their files. Those of an earlier run, in which other games could not be
    played, are replaced."""
    files = [folder.work(stage) / name for name in (SEVERITY, CAUSES)]
    for file in files:
        file.unlink(missing_ok=True)
    severity_table(folder, stage, scene)
    cause_table(folder, stage, scene)
    return files


def with_severity(episodes: pd.DataFrame, tables: Sequence[pd.DataFrame]) -> pd.DataFrame:
    """The records of games with the columns of severity, from the tables of their arms."""
    rows = [row for table in tables for row in table.to_dict("records")]
    severity = typed(pd.DataFrame(rows, columns=list(SEVERITY_TABLE)))
    return typed(episodes.merge(severity, on=_GAME, how="left"))


def _kept_or_made(folder: RunFolder, stage: str, name: str, make: Callable[[], pd.DataFrame]) -> pd.DataFrame:
    file = folder.work(stage) / name
    if file.is_file():
        try:
            return read_csv(file)
        except UsageError:
            pass
    table = make()
    write_csv(table, file)
    return table


def _severity(folder: RunFolder, stage: str, scene: OpenScene) -> pd.DataFrame:
    kinds = kinds_of(scene)
    rows = [
        {"arm": game.arm, "seed": game.seed, "episode": game.episode, **severity_of(trace, scene.world, kinds)}
        for game, trace in _games(folder, stage)
    ]
    return typed(pd.DataFrame(rows, columns=list(SEVERITY_TABLE)))


def _causes(folder: RunFolder, stage: str, scene: OpenScene) -> pd.DataFrame:
    kinds = kinds_of(scene)
    rows = []
    for game, trace in _games(folder, stage, failed=True):
        cause = cause_of(trace, scene.world, kinds)
        if cause is not None:
            labels = {name: getattr(game, name) for name in ("arm", "persona", "seed", "episode", "ego_outcome")}
            rows.append({**labels, **cells_of(cause)})
    return typed(pd.DataFrame(rows, columns=list(CAUSE_COLUMNS)))


def _games(folder: RunFolder, stage: str, failed: bool = False) -> Iterator[tuple[Any, pd.DataFrame]]:
    """The games of an arm that were played, each with its trace; only those that the ego failed, if `failed`."""
    episodes = read_csv(folder.work(stage) / EPISODES)
    episodes = episodes[episodes["error"] == ""]
    if failed:
        episodes = episodes[episodes["ego_failed"].fillna(0) == 1]
    games = {int(game.episode): game for game in episodes.itertuples()}
    if games:
        for episode, trace in read_traces(folder.traces(stage)):
            if episode in games:
                yield games[episode], trace


def kinds_of(scene: OpenScene) -> Mapping[str, Kind]:
    """What contacts and causes depend on, of each of the scene's vehicle types."""
    return {
        name: Kind(length_m=kind.length_m, width_m=kind.width_m, vehicle_class=kind.vehicle_class)
        for name, kind in scene.routes.types.items()
    }
