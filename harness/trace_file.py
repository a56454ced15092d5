"""The traces of an arm as one Parquet file, written game by game."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from harness.files import sync_folder

_TEXT = pa.dictionary(pa.int32(), pa.string())
SCHEMA = pa.schema(
    [
        ("episode", pa.int32()),
        ("step", pa.int32()),
        ("time_s", pa.float64()),
        ("player", _TEXT),
        ("vehicle_type", _TEXT),
        *(
            (name, pa.float64())
            for name in ("x_m", "y_m", "heading_rad", "speed_mps", "acceleration_mps2", "steering_rad")
        ),
        ("lapsed", pa.bool_()),
        ("outcome", _TEXT),
    ]
)


class TraceWriter:
    """Writes an arm's traces; the file is there when all games are in it, or not at all."""

    def __init__(self, path: Path) -> None:
        self._path, self._scratch = path, path.with_name(f".{path.name}.part")
        self._writer = pq.ParquetWriter(self._scratch, SCHEMA, compression="zstd")

    def __enter__(self) -> TraceWriter:
        return self

    def add(self, columns: Mapping[str, Sequence[Any]]) -> None:
        """Add one game, as columns of its trace."""
        self._writer.write_table(
            pa.table({name: pa.array(columns[name], SCHEMA.field(name).type) for name in SCHEMA.names})
        )

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._writer.close()
        if kind is None:
            with self._scratch.open("rb") as file:
                os.fsync(file.fileno())
            os.replace(self._scratch, self._path)
            sync_folder(self._path.parent)
        else:
            self._scratch.unlink(missing_ok=True)


def read_trace(path: Path, episode: int) -> pd.DataFrame:
    """One game's trace; empty if the file has none of that episode."""
    frame = pq.read_table(path, filters=[("episode", "==", episode)]).to_pandas()
    for name in ("player", "vehicle_type", "outcome"):
        frame[name] = frame[name].astype(str)
    return frame
