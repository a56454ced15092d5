"""The CSV tables of a run folder: their columns, and writing and reading them exactly.

An empty cell means "can't be measured", never 0. Equal tables are equal bytes: floats are written as the
shortest text that reads back as the same number, whole numbers without a point, truth values as true/false,
lines end in a line feed. A table is recognised by its columns, which are declared here only (those of
`comparisons.csv` and of the findings on equilibria are declared beside their computation).
"""

from __future__ import annotations

import csv
import io
import shutil
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from harness.errors import UsageError
from harness.evaluation.causes.columns import CAUSE_COLUMNS
from harness.evaluation.comparison import COMPARISON_COLUMNS
from harness.evaluation.game_theory.columns import GAME_TABLES
from harness.evaluation.people import columns_for, people_in
from harness.evaluation.reference_columns import REFERENCE_TABLES
from harness.evaluation.severity.columns import SEVERITY_COLUMNS
from harness.files import content_of, replace_durably, scratch_beside, write_atomically

PLAYED_COLUMNS = {
    "arm": "object",
    "persona": "object",
    "seed": "int64",
    "episode": "int64",
    "ego_outcome": "object",
    "ego_failed": "Int64",
    "ego_mean_speed_mps": "float64",
    "ego_trailing_distance_m": "float64",
    "ego_min_ttc_s": "float64",
    "ego_max_deceleration_mps2": "float64",
    "ego_max_lateral_acceleration_mps2": "float64",
    "ego_time_to_goal_s": "float64",
    "ego_red_lights": "float64",
    "ego_wrong_way_s": "float64",
    "ego_min_pet_s": "float64",
    "ego_pet_priority": "object",
    "ego_accepted_gap_s": "float64",
    "ego_payoff": "float64",
    "non_ego_outcome": "object",
    "non_ego_mean_speed_mps": "float64",
    "non_ego_red_lights": "float64",
    "non_ego_latest_red_s": "float64",
    "non_ego_wrong_way_s": "float64",
    "non_ego_payoff": "float64",
    "duration_s": "float64",
    "error": "object",
}
"""Columns of the records of played games in order, each with its pandas dtype (Int64: whole numbers or empty). With
several people, those of the non-ego occur for each of them (`people.columns_for`)."""

EPISODE_COLUMNS = {name: dtype for name, dtype in PLAYED_COLUMNS.items() if name != "error"}
EPISODE_COLUMNS |= {**SEVERITY_COLUMNS, "error": PLAYED_COLUMNS["error"]}
"""Columns of `episodes.csv`: those of the records, and what the traces tell besides. `columns.EPISODES` describes each
of them."""

SEVERITY_TABLE = {name: PLAYED_COLUMNS[name] for name in ("arm", "seed", "episode")} | dict(SEVERITY_COLUMNS)
"""Columns of a stage's table of severity."""

RECONFIGURATION_COLUMNS = {
    "stage": "object",
    "persona": "object",
    "seed": "int64",
    "trial": "int64",
    "parameter": "object",
    "value": "float64",
    "low": "float64",
    "high": "float64",
    "mean_payoff": "float64",
    "failure_rate": "float64",
    "best_payoff": "float64",
    "chosen": "bool",
    "error": "object",
}
"""Columns of `reconfiguration.csv`. `low` and `high` are the bounds of the search, `best_payoff` is the best mean
payoff so far, `chosen` is true for the trial that was taken; a trial that could not be played has an `error`."""

SUMMARY_COLUMNS = {
    "arm": "object",
    "persona": "object",
    "seed": "int64",
    "episodes": "int64",
    "errors": "int64",
    "failure_rate": "float64",
    "failure_rate_low": "float64",
    "failure_rate_high": "float64",
    "collisions": "Int64",
    "rails": "Int64",
    "timeouts": "Int64",
    "mean_speed_mps": "float64",
    "mean_speed_low_mps": "float64",
    "mean_speed_high_mps": "float64",
    "trailing_distance_m": "float64",
    "min_ttc_s": "float64",
    "max_deceleration_mps2": "float64",
    "max_lateral_acceleration_mps2": "float64",
    "ego_payoff": "float64",
    "non_ego_goal_rate": "float64",
    "non_ego_goal_rate_low": "float64",
    "non_ego_goal_rate_high": "float64",
    "non_ego_mean_speed_mps": "float64",
    "non_ego_payoff": "float64",
    "near_miss_rate": "float64",
    "near_miss_rate_low": "float64",
    "near_miss_rate_high": "float64",
}
"""Columns of `summary.csv`."""

TRAINING_COLUMNS = {
    "stage": "object",
    "persona": "object",
    "seed": "int64",
    "steps": "int64",
    "mean_payoff": "float64",
    "failure_rate": "float64",
    "games": "int64",
    "mean_duration_s": "float64",
    "stopped": "object",
}
"""Columns of `training.csv`. `stopped` is filled in the last row of a training: `converged`, `budget` or
`did not learn`."""

MANOEUVRE_COLUMNS = {
    "arm": "object",
    "persona": "object",
    "seed": "int64",
    "episode": "int64",
    "player": "object",
    "manoeuvre": "object",
    "time_s": "float64",
    "until_s": "float64",
    "gap_m": "float64",
    "ttc_s": "float64",
    "text": "object",
}
"""Columns of `manoeuvres.csv`."""

POPULATION_COLUMNS = {
    "arm": "object",
    "population": "object",
    "seed": "int64",
    "persona": "object",
    "episodes": "int64",
    "errors": "int64",
    "failure_rate": "float64",
    "failure_rate_low": "float64",
    "failure_rate_high": "float64",
    "mean_speed_mps": "float64",
    "ego_payoff": "float64",
    "non_ego_payoff": "float64",
}
"""Columns of `populations.csv`: the arms against a population, by the persona that drove."""

TABLES = {
    "episodes": EPISODE_COLUMNS,
    "played": PLAYED_COLUMNS,
    "severity": SEVERITY_TABLE,
    "causes": CAUSE_COLUMNS,
    "summary": SUMMARY_COLUMNS,
    "comparisons": COMPARISON_COLUMNS,
    "training": TRAINING_COLUMNS,
    "manoeuvres": MANOEUVRE_COLUMNS,
    "populations": POPULATION_COLUMNS,
    "reconfiguration": RECONFIGURATION_COLUMNS,
    **GAME_TABLES,
    **REFERENCE_TABLES,
}

_MOST_BYTES = 500_000_000
_TRUTH = {"true": True, "false": False}


def typed(frame: pd.DataFrame) -> pd.DataFrame:
    """The frame as one of `TABLES`: columns in its order and of its dtypes, rows counted from 0.

    Missing text becomes "". Raises ValueError when the columns are not those of a table, a whole
    number has a fraction, or a required cell is empty.
    """
    columns = _columns_of(frame.columns)
    return pd.DataFrame({name: _cast(frame[name], dtype) for name, dtype in columns.items()})


def _columns_of(names: Iterable[str]) -> Mapping[str, str]:
    names = list(names)
    people = len(people_in(names))
    of_games = (columns_for(people, columns) for columns in (EPISODE_COLUMNS, PLAYED_COLUMNS))
    for columns in (*of_games, *TABLES.values()):
        if sorted(names) == sorted(columns):
            return columns
    nearest, columns = max(TABLES.items(), key=lambda table: len(set(names) & set(table[1])))
    missing, unknown = sorted(set(columns) - set(names)), sorted(set(names) - set(columns))
    raise ValueError(f"not a table of a run; nearest is {nearest}: missing {missing}, unknown {unknown}")


def _cast(column: pd.Series, dtype: str) -> pd.Series:
    column = column.reset_index(drop=True)
    try:
        if dtype == "object":
            text = column.astype(object).where(column.notna(), "")
            # str.__str__ gives the text of an enum's member, and a TypeError for a value that is not text
            return pd.Series([str.__str__(cell) for cell in text], dtype=object)
        if dtype == "bool" and not all(cell in (True, False) for cell in column):
            raise ValueError("neither true nor false")
        if dtype == "int64":
            column = column.astype("Int64")  # refuses a fraction, which the next cast would truncate
        if dtype == "float64":
            column = column.astype("Float64")  # takes every kind of missing number
        return column.astype(dtype)
    except (TypeError, ValueError) as error:
        raise ValueError(f"column {column.name!r} can't be {dtype}: {error}") from error


def write_csv(frame: pd.DataFrame, path: Path) -> None:
    """Write one of `TABLES`. The replacement is atomic: the file is complete at every moment, old or new.

    Raises ValueError as `typed` does, and OSError when the folder can't be written.
    """
    table = typed(frame)
    cells = [[_text(cell) for cell in table[name].tolist()] for name in table.columns]
    lines = [list(table.columns), *zip(*cells, strict=True)]
    text = "".join(",".join(line) + "\n" for line in lines)
    # an error message of another program may not be valid Unicode; it must not prevent the table
    write_atomically(path, text.encode("utf-8", errors="backslashreplace"))


def join_csv(parts: Sequence[Path], path: Path) -> None:
    """Concatenate tables with the same columns, each a file of `write_csv`. The bytes are those of one table."""
    scratch = scratch_beside(path)
    try:
        with scratch.open("wb") as target:
            for number, part in enumerate(parts):
                with part.open("rb") as lines:
                    header = lines.readline()
                    target.write(b"" if number else header)
                    shutil.copyfileobj(lines, target)
        replace_durably(scratch, path)
    finally:
        scratch.unlink(missing_ok=True)


def _text(cell: object) -> str:
    if isinstance(cell, str):
        quoted = any(character in cell for character in ',"\r\n')
        return '"' + cell.replace('"', '""') + '"' if quoted else cell
    if isinstance(cell, bool):
        return "true" if cell else "false"
    return "" if pd.isna(cell) else repr(cell)


def read_csv(path: Path) -> pd.DataFrame:
    """The table `write_csv` wrote, equal to it in every value and dtype (empty text is "", not NaN).

    Raises UsageError when the file is missing or is not such a table.
    """
    remedy = "run the campaign again: it rewrites its tables"
    try:
        text = content_of(path, _MOST_BYTES).decode("utf-8")
        reader = csv.reader(io.StringIO(text, newline=""), strict=True)
        header, lines = next(reader, []), list(reader)
        columns = _columns_of(header)
        cells = list(zip(*lines, strict=True)) if lines else [()] * len(header)
        if len(cells) != len(header):
            raise ValueError("rows are not as long as the header")
        return typed(
            pd.DataFrame({name: _parse(column, columns[name]) for name, column in zip(header, cells, strict=True)})
        )
    except OSError as error:
        raise UsageError.of(path, "", f"can't be read: {error.strerror}", remedy) from error
    except (ValueError, OverflowError, csv.Error) as error:
        raise UsageError.of(path, "", f"is not a table of this harness: {error}", remedy) from error


def _parse(cells: Iterable[str], dtype: str) -> pd.Series:
    if dtype == "object":
        return pd.Series(list(cells), dtype=object)
    if dtype == "bool":
        return pd.Series([_TRUTH.get(cell) for cell in cells], dtype=object)
    if dtype == "float64":
        return pd.Series([float(cell) if cell else np.nan for cell in cells], dtype="float64")
    return pd.Series([int(cell) if cell else pd.NA for cell in cells], dtype="Int64")


def is_of_a_search(trials: pd.DataFrame) -> bool:
    """Whether the trials of a stage contain the ego as given (trial 0) with a payoff, and exactly one chosen trial."""
    payoffs = trials.groupby("trial")["mean_payoff"].first()
    return 0 in payoffs.index and payoffs.notna()[0] and trials.loc[trials["chosen"], "trial"].nunique() == 1
