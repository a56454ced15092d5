"""Writing and reading the CSV tables of a run folder exactly (`columns.TABLES`).

An empty cell means "can't be measured", never 0. Equal tables are equal bytes: floats are written as the shortest text
that reads back as the same number, whole numbers without a point, truth values as true/false, lines end in a line feed.
A table is recognised by its columns.
"""

from __future__ import annotations

import csv
import gzip
import io
import math
import zlib
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from harness.errors import UsageError
from harness.evaluation.column import COUNT, FLAG, NUMBER, TEXT, Column
from harness.evaluation.columns import TABLES
from harness.evaluation.people import columns_for, people_in
from harness.files import content_of, write_atomically

_MOST_BYTES = 500_000_000
_TRUTH = {"true": True, "false": False}


def table_of(name: str, rows: Iterable[Mapping[str, Any]] = (), people: int = 1) -> pd.DataFrame:
    """Rows as a table of this name in `TABLES`; a missing cell is empty, another one is dropped. `people`: of
    a game."""
    rows, columns = list(rows), columns_for(people, TABLES[name])
    measured = {each for each in columns if columns[each].optional and any(pd.notna(row.get(each)) for row in rows)}
    there = [each for each, column in columns.items() if not column.optional or each in measured]
    return typed(pd.DataFrame(rows, columns=there))


def joined(name: str, frames: Iterable[pd.DataFrame]) -> pd.DataFrame:
    """Tables with the same columns as one; without rows an empty one of this name."""
    filled = [frame for frame in frames if len(frame)]
    return typed(pd.concat(filled, ignore_index=True)) if filled else table_of(name)


def typed(frame: pd.DataFrame) -> pd.DataFrame:
    """The frame as one of `TABLES`: columns in its order and of its dtypes, rows counted from 0.

    Missing text becomes "". Raises ValueError when the columns are not those of a table, a whole
    number has a fraction, or a required cell is empty.
    """
    columns = columns_of(frame.columns)
    return pd.DataFrame({name: _cast(frame[name], column.dtype) for name, column in columns.items()})


def columns_of(names: Iterable[str]) -> Mapping[str, Column]:
    """The columns of the table that has these; optional ones may be missing. Raises ValueError where there is none."""
    names = list(names)
    people = len(people_in(names))
    for columns in (columns_for(people, TABLES["episodes"]), columns_for(people, TABLES["played"]), *TABLES.values()):
        there = {name: column for name, column in columns.items() if not column.optional or name in names}
        if sorted(names) == sorted(there):
            return there
    nearest, columns = max(TABLES.items(), key=lambda table: len(set(names) & set(table[1])))
    missing = sorted(name for name, column in columns.items() if name not in names and not column.optional)
    unknown = sorted(set(names) - set(columns))
    raise ValueError(f"not a table of a run; nearest is {nearest}: missing {missing}, unknown {unknown}")


def _cast(column: pd.Series, dtype: str) -> pd.Series:
    column = column.reset_index(drop=True)
    if column.dtype == dtype != TEXT:
        return column
    try:
        if dtype == TEXT:
            text = column.astype(object).where(column.notna(), "")
            # str.__str__ gives the text of an enum's member, and a TypeError for a value that is not text
            lines = (str.__str__(cell).replace("\r\n", "\n").replace("\r", "\n") for cell in text)
            return pd.Series(list(lines), dtype=object)
        if dtype == FLAG and not all(cell in (True, False) for cell in column):
            raise ValueError("neither true nor false")
        if dtype == COUNT:
            column = column.astype("Int64")  # refuses a fraction, which the next cast would truncate
        if dtype == NUMBER:
            column = column.astype("Float64")  # takes every kind of missing number
        return column.astype(dtype)
    except (TypeError, ValueError) as error:
        raise ValueError(f"column {column.name!r} can't be {dtype}: {error}") from error


def write_csv(frame: pd.DataFrame, path: Path) -> None:
    """Write one of `TABLES`. The replacement is atomic: the file is complete at every moment, old or new.

    Raises ValueError as `typed` does, and OSError when the folder can't be written.
    """
    table, text = typed(frame), io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(table.columns)
    writer.writerows(zip(*(map(exact, table[name].tolist()) for name in table.columns), strict=True))
    # an error message of another program may not be valid Unicode; it must not prevent the table
    write_atomically(path, text.getvalue().encode("utf-8", errors="backslashreplace"))


def exact(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return value if isinstance(value, str) else "" if pd.isna(value) else repr(value)


def read_csv(path: Path) -> pd.DataFrame:
    """The table `write_csv` wrote, equal to it in every value and dtype (empty text is "", not NaN). Where a file is
    missing, it is read from the compressed one of the same name and `.gz`: long tables are published so.

    Raises UsageError when the file is missing or is not such a table.
    """
    remedy = "run the campaign again: it rewrites its tables"
    try:
        text = _content(path).decode("utf-8")
        if "\0" in text:
            raise ValueError("it contains NUL bytes")
        reader = csv.reader(io.StringIO(text, newline=""), strict=True)
        header, lines = next(reader, []), list(reader)
        columns = columns_of(header)
        cells = list(zip(*lines, strict=True)) if lines else [()] * len(header)
        if len(cells) != len(header):
            raise ValueError("rows are not as long as the header")
        parsed = {name: _parse(column, columns[name].dtype) for name, column in zip(header, cells, strict=True)}
        return typed(pd.DataFrame(parsed))
    except OSError as error:
        raise UsageError.of(path, "", f"can't be read: {error.strerror}", remedy) from error
    except (ValueError, OverflowError, EOFError, zlib.error, csv.Error) as error:
        raise UsageError.of(path, "", f"is not a table of this harness: {error}", remedy) from error


def rows_in_json(table: pd.DataFrame) -> list[dict[str, Any]]:
    """The rows of a table as JSON can have them: null where a cell is empty or infinite."""
    written = table.astype(object).where(table.notna() & ~table.isin([math.inf, -math.inf]), None)
    return [{str(name): cell for name, cell in row.items()} for row in written.to_dict("records")]


def _content(path: Path) -> bytes:
    packed = path.with_name(f"{path.name}.gz")
    if path.exists() or not packed.exists():
        return content_of(path, _MOST_BYTES)
    with gzip.GzipFile(fileobj=io.BytesIO(content_of(packed, _MOST_BYTES))) as file:
        content = file.read(_MOST_BYTES + 1)
    if len(content) > _MOST_BYTES:
        raise ValueError(f"it has more than {_MOST_BYTES:,} bytes")
    return content


def _parse(cells: Iterable[str], dtype: str) -> pd.Series:
    if dtype == TEXT:
        return pd.Series(list(cells), dtype=object)
    readers: Mapping[str, Callable[[str], object]] = {FLAG: _TRUTH.get, NUMBER: float}
    read = readers.get(dtype, int)
    return pd.Series([read(cell) if cell else None for cell in cells], dtype=object)


def is_of_a_search(trials: pd.DataFrame) -> bool:
    """Whether the trials of a stage contain the ego as given (trial 0) with a payoff, and exactly one chosen trial."""
    payoffs = trials.groupby("trial")["mean_payoff"].first()
    return 0 in payoffs.index and payoffs.notna()[0] and trials.loc[trials["chosen"], "trial"].nunique() == 1
