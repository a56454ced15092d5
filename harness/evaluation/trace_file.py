"""The traces of an arm as one Parquet file: the games of a segment are one of its row groups.

A segment's file has the same format, and an arm's file is the concatenation of its segments' row groups: the bytes do
not depend on whether the segments were played in one run.
"""

from __future__ import annotations

import json
import math
from collections import OrderedDict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute
import pyarrow.dataset
import pyarrow.parquet as pq

from harness.errors import UsageError
from harness.evaluation.column import COUNT, FLAG, NUMBER, TEXT
from harness.evaluation.trace_columns import PERCEIVED, SHIELDED, TRACE_COLUMNS
from harness.files import check_file, errors_naming, replace_durably, scratch_beside
from harness.game.arrays import FloatArray

_MOST_BYTES = 10**12
MOST_KEPT_ROWS = 1_000_000
"""Of segments in memory: about 150 MB."""
_LARGEST, _MOST_STEPS = 1e8, 1_000_000

_TEXT = pa.dictionary(pa.int32(), pa.string())
_TYPES = {COUNT: pa.int32(), NUMBER: pa.float64(), FLAG: pa.bool_(), TEXT: _TEXT}
SCHEMA = pa.schema([(column.name, _TYPES[column.dtype]) for column in TRACE_COLUMNS])


def schema_of(*, shielded: bool, perceiving: bool) -> pa.Schema:
    """The columns of the traces of an arm: with a shield, with perception errors."""
    more = [*([SHIELDED] if shielded else []), *(PERCEIVED if perceiving else ())]
    return pa.schema([*SCHEMA, *((column.name, _TYPES[column.dtype]) for column in more)])


_SCHEMAS = [schema_of(shielded=shield, perceiving=errors) for shield in (False, True) for errors in (False, True)]
_NUMBERS = [field.name for field in SCHEMA if field.type == pa.float64()]


@contextmanager
def trace_writer(path: Path, schema: pa.Schema) -> Iterator[Callable[[Mapping[str, Sequence[Any]]], None]]:
    """Writes the games of a segment: a function that adds one, as columns of its trace. The file appears only when all
    games are in it. `schema`: as `schema_of`."""
    games: list[pa.Table] = [schema.empty_table()]

    def add(columns: Mapping[str, Sequence[Any]]) -> None:
        games.append(
            pa.table({name: pa.array(columns[name], schema.field(name).type) for name in schema.names}, schema)
        )

    yield add
    _write([pa.concat_tables(games).unify_dictionaries().combine_chunks()], path, schema)


def join_traces(parts: Sequence[Path], path: Path, labels: Mapping[str, str | int]) -> None:
    """Concatenate the traces of segments in one file.

    `labels` (the arm and its seed) are the file's metadata: `pandas.read_parquet(path).attrs` has them.
    """
    metadata: dict[bytes | str, bytes | str] = {name: str(label) for name, label in labels.items()}
    metadata["PANDAS_ATTRS"] = json.dumps(dict(labels))
    names = pq.read_schema(parts[0]).names
    schema = schema_of(shielded=SHIELDED.name in names, perceiving=PERCEIVED[0].name in names)
    _write((group for part in parts for group in _row_groups(part)), path, schema.with_metadata(metadata))


_Segment = tuple[float, float, pyarrow.dataset.ParquetFileFragment]
"""The lowest and highest episode of a row group, and where it is in its file."""


class TraceReader:
    """Reads many games, of several files, in any order. A file's footer is read once. A segment stays in memory as long
    as the segments that were read last have no more than `MOST_KEPT_ROWS` rows; it is kept as it is in the file, since
    rows become a frame much faster for one game than for all."""

    def __init__(self) -> None:
        self._segments: dict[Path, list[_Segment]] = {}
        self._kept: OrderedDict[tuple[str, int], pa.Table] = OrderedDict()

    def read(self, path: Path, episode: int) -> pd.DataFrame:
        """One game's trace.

        Raises UsageError if it is not a file of traces, contains values that no game can have, or has no trace of that
        episode.
        """
        try:
            if path not in self._segments:
                self._segments[path] = _segments_of(path)
            segments = self._segments[path]
            tables = [self._table(segment) for low, high, segment in segments if low <= episode <= high]
            rows = pa.concat_tables(tables or [SCHEMA.empty_table()])
            rows = rows.filter(pyarrow.compute.equal(rows["episode"], episode))
            if not len(rows):
                raise ValueError(f"it has no trace of episode {episode}")
            frame = rows.cast(_with_strings(rows.schema)).to_pandas()
            _check_game(rows, frame)
        except (OSError, ValueError, MemoryError, pa.ArrowException) as error:
            raise _damaged(path, error) from None
        return frame

    def _table(self, segment: pyarrow.dataset.ParquetFileFragment) -> pa.Table:
        place = (segment.path, segment.row_groups[0].id)
        if place not in self._kept:
            self._kept[place] = segment.to_table()
        self._kept.move_to_end(place)
        while len(self._kept) > 1 and sum(map(len, self._kept.values())) > MOST_KEPT_ROWS:
            self._kept.popitem(last=False)
        return self._kept[place]


def _segments_of(path: Path) -> list[_Segment]:
    """The row groups of a file. Raises ValueError, OSError or ArrowException unless this is a file of traces."""
    check_file(path, _MOST_BYTES)
    (file,) = pyarrow.dataset.dataset(path, format="parquet").get_fragments()
    _check_schema(file.physical_schema)
    everything = {"min": -math.inf, "max": math.inf}
    spans = [
        ((each.row_groups[0].statistics or {}).get("episode", everything), each) for each in file.split_by_row_group()
    ]
    return [(span["min"], span["max"], segment) for span, segment in spans]


def _write(groups: Iterable[pa.Table], path: Path, schema: pa.Schema) -> None:
    scratch = scratch_beside(path)
    try:
        with errors_naming(path):
            with pq.ParquetWriter(scratch, schema, compression="zstd") as writer:
                for group in groups:
                    if group.num_rows:
                        writer.write_table(group.replace_schema_metadata(schema.metadata))
            replace_durably(scratch, path)
    finally:
        scratch.unlink(missing_ok=True)


def _row_groups(path: Path) -> Iterator[pa.Table]:
    with pq.ParquetFile(path) as file:
        for number in range(file.num_row_groups):
            yield file.read_row_group(number)


def _with_strings(schema: pa.Schema) -> pa.Schema:
    """With strings in place of dictionaries."""
    return pa.schema([field.with_type(pa.string()) if field.type == _TEXT else field for field in schema])


def check_traces(path: Path, episodes: Iterable[int]) -> None:
    """Raise UsageError unless this is a file of traces with plausible numbers and all these episodes."""
    missing = set(episodes)
    try:
        check_file(path, _MOST_BYTES)
        with pq.ParquetFile(path) as file:
            _check_schema(file.schema_arrow)
            for batch in file.iter_batches(columns=["episode", *_NUMBERS]):
                _check_numbers(np.stack([batch.column(name).to_numpy(False) for name in _NUMBERS]))
                missing.difference_update(np.unique(batch.column("episode").to_numpy(False)).tolist())
    except (OSError, ValueError, MemoryError, pa.ArrowException) as error:
        raise _damaged(path, error) from None
    if missing:
        raise _damaged(path, ValueError(f"it has no trace of episode {min(missing)}"))


def _check_schema(schema: pa.Schema) -> None:
    if not any(map(schema.equals, _SCHEMAS)):
        different = sorted(set(schema.names) ^ set(SCHEMA.names)) or ["types"]
        raise ValueError(f"its columns are not those of a trace: {', '.join(different)[:200]}")


def _check_game(rows: pa.Table, frame: pd.DataFrame) -> None:
    _check_numbers(frame[_NUMBERS].to_numpy(float))
    steps = frame["step"]
    if any(column.null_count for column in rows.columns) or not (0 <= steps.min() <= steps.max() <= _MOST_STEPS):
        raise ValueError("it has empty cells, or steps out of range")
    if frame.duplicated(["step", "player"]).any():
        raise ValueError("a road user has two rows in one step")


def _check_numbers(numbers: FloatArray) -> None:
    if not (np.abs(numbers) <= _LARGEST).all():  # never true of NaN
        raise ValueError("it contains numbers that are missing or out of range")


def _damaged(path: Path, error: Exception) -> UsageError:
    text = (error.strerror or error) if isinstance(error, OSError) else error
    return UsageError.of(path, "", f"is not a file of traces: {text}", "run the campaign again: it replays the games")
