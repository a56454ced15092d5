"""The manoeuvres of an arm as a table beside its records: `manoeuvres.csv` among what the stage keeps."""

from __future__ import annotations

import pandas as pd

from harness.manoeuvres import find_manoeuvres, rows_of
from harness.run_folder import RunFolder
from harness.tables import MANOEUVRE_COLUMNS, read_csv, typed, write_csv
from harness.trace_file import read_trace
from harness.traffic.opening import OpenScene

MANOEUVRES = "manoeuvres.csv"


def name_manoeuvres(folder: RunFolder, stage: str, scene: OpenScene) -> pd.DataFrame:
    """Name the manoeuvres of all games of an arm from its traces, and keep them with its stage."""
    sizes_m = {name: (kind.length_m, kind.width_m) for name, kind in scene.routes.types.items()}
    rows = []
    for game in read_csv(folder.work(stage) / "episodes.csv").itertuples():
        if not game.error:
            trace = read_trace(folder.traces(stage), game.episode)
            cells = {"arm": game.arm, "persona": game.persona, "seed": game.seed, "episode": game.episode}
            rows += rows_of(find_manoeuvres(trace, scene.world, sizes_m), **cells)
    table = typed(pd.DataFrame(rows, columns=list(MANOEUVRE_COLUMNS)))
    write_csv(table, folder.work(stage) / MANOEUVRES)
    return table


def manoeuvres_of(folder: RunFolder, stage: str, scene: OpenScene) -> pd.DataFrame:
    """The manoeuvres of an arm; named now, where the stage was carried out before there were any."""
    file = folder.work(stage) / MANOEUVRES
    return read_csv(file) if file.is_file() else name_manoeuvres(folder, stage, scene)
