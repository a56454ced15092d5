"""What the log of an arm tells, as tables: games with all metrics, causes of failures, manoeuvres, conduct of players.

<run>/.stages/<arm>/played.csv         what was stored when the games were played: outcomes, and errors
<run>/traces/<arm>.parquet             the games
<run>/.stages/<arm>/episodes.csv       made from these two, as are causes.csv, manoeuvres.csv and conduct.csv
<run>/.stages/<arm>/tables.json        what they were made from: checksums of the log and of the sources that read it

The tables are made again when the log or the sources have changed: a new metric needs no game to be played again.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from harness.campaign.storage.checksums import checksums_of, digest_of, intact_record, write_checksums
from harness.campaign.storage.run_folder import RunFolder
from harness.campaign.storage.versions import digest_of_sources
from harness.environments.recorded import recorded_game
from harness.errors import UsageError
from harness.evaluation.measured_game import conduct_of, measured
from harness.evaluation.people import people_in
from harness.evaluation.rule_book.causes import cause_of
from harness.evaluation.rule_book.course import Course
from harness.evaluation.rule_book.named_manoeuvres import find_manoeuvres
from harness.evaluation.tables import read_csv, table_of, write_csv
from harness.evaluation.trace_file import TraceReader
from harness.road.scene.open_scene import OpenScene, open_scene

PLAYED = "played.csv"
_READ_BY = ("environments/recorded.py", "evaluation", "game", "road")


@dataclass(frozen=True, kw_only=True)
class ArmTables:
    episodes: pd.DataFrame
    causes: pd.DataFrame
    manoeuvres: pd.DataFrame
    conduct: pd.DataFrame


def arm_tables(folder: RunFolder, stage: str, scene: OpenScene | None = None) -> ArmTables:
    """The tables of an arm: as they are stored, or made now. `scene` is the run's; None: it is opened if it is needed.

    Raises UsageError for a damaged log.
    """
    work, record = folder.work(stage), folder.work(stage) / "tables.json"
    key = _key(folder, stage)
    stored = intact_record(record, folder.path, key=key)
    if stored is not None and stored.get("files"):
        return ArmTables(**{name: read_csv(work / f"{name}.csv") for name in ArmTables.__dataclass_fields__})
    made = _made(folder, stage, scene or open_scene(folder.scene))
    for name, table in vars(made).items():
        write_csv(table, work / f"{name}.csv")
    write_checksums(record, folder.path, [work / f"{name}.csv" for name in vars(made)], {"key": key})
    return made


def _key(folder: RunFolder, stage: str) -> str:
    log = [folder.work(stage) / PLAYED, folder.traces(stage), *sorted(folder.scene.glob("*"))]
    try:
        made_from = [checksums_of(folder.path, log), digest_of_sources(*_READ_BY)]
    except OSError as error:
        message = f"can't be read: {error.strerror}"
        raise UsageError.of(Path(str(error.filename)), "", message, "run the campaign again") from None
    return digest_of(made_from)


def _made(folder: RunFolder, stage: str, scene: OpenScene) -> ArmTables:
    played = read_csv(folder.work(stage) / PLAYED)
    episodes, reader = list[Mapping[str, Any]](), TraceReader()
    causes, manoeuvres, conduct = (list[Mapping[str, Any]]() for _ in range(3))
    for row in played.to_dict("records"):
        if row["error"]:
            episodes.append(row)
            continue
        game = recorded_game(reader.read(folder.traces(stage), int(row["episode"])), scene)
        course, labels = Course(game=game), {name: row[name] for name in ("arm", "persona", "seed", "episode")}
        episodes.append({**row, **measured(game)})
        manoeuvres += [labels | each for each in find_manoeuvres(course)]
        conduct += [labels | each for each in conduct_of(game)]
        if (cause := cause_of(course)) is not None:
            causes.append(labels | {"ego_outcome": row["ego_outcome"]} | cause)
    return ArmTables(
        episodes=table_of("episodes", episodes, len(people_in(played.columns))),
        causes=table_of("causes", causes),
        manoeuvres=table_of("manoeuvres", manoeuvres),
        conduct=table_of("conduct", conduct),
    )
