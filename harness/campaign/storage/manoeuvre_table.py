"""The manoeuvres of an arm as a table beside its records: `manoeuvres.csv` among the stage's files."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from harness.campaign.storage.run_folder import RunFolder
from harness.evaluation.manoeuvres import find_manoeuvres, rows_of
from harness.evaluation.tables import MANOEUVRE_COLUMNS, read_csv, typed, write_csv
from harness.evaluation.trace_file import read_traces
from harness.traffic.scene import OpenScene

EPISODES, MANOEUVRES = "episodes.csv", "manoeuvres.csv"


def name_manoeuvres(episodes: pd.DataFrame, traces: Path, scene: OpenScene) -> pd.DataFrame:
    """The manoeuvres of games, named from their traces; `episodes` has a row per game."""
    sizes_m = {name: (kind.length_m, kind.width_m) for name, kind in scene.routes.types.items()}
    games = {game.episode: game for game in episodes.itertuples() if not game.error}
    rows = []
    for episode, trace in read_traces(traces):
        if (game := games.get(episode)) is not None:
            cells = {"arm": game.arm, "persona": game.persona, "seed": game.seed, "episode": game.episode}
            rows += rows_of(find_manoeuvres(trace, scene.world, sizes_m), **cells)
    return typed(pd.DataFrame(rows, columns=list(MANOEUVRE_COLUMNS)))


def manoeuvres_of(folder: RunFolder, stage: str, scene: OpenScene) -> pd.DataFrame:
    """The manoeuvres of an arm. They are named now if the table is not there."""
    file = folder.work(stage) / MANOEUVRES
    if file.is_file():
        return read_csv(file)
    table = name_manoeuvres(read_csv(folder.work(stage) / EPISODES), folder.traces(stage), scene)
    write_csv(table, file)
    return table
