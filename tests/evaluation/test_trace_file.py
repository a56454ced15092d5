"""Trace files: written game by game, complete or absent, and read back unchanged."""

from __future__ import annotations

from errno import ENOSPC
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow.parquet as pq
import pytest

from harness.errors import UsageError
from harness.evaluation import trace_file
from harness.evaluation.trace_file import SCHEMA, TraceReader, join_traces, trace_writer
from tests.support.traces import along, rows


def game(episode: int, steps: int = 3) -> dict[str, list[Any]]:
    driven = pd.DataFrame(rows("ego", along(1 / 3, -1.6, 0.1, 10.0, steps), end="goal", lapsed=[1]))
    driven = driven.assign(episode=episode, steers=True, station_m=20.0 + driven["step"], payoff=0.25, friction=0.9)
    signals, signal_s = ["crossing=Gr"] * (steps - 1) + ["crossing=yr"], ["4.5 0.0"] + [""] * (steps - 1)
    return driven.assign(signals=signals, signal_s=signal_s, limit_share=1.0)[SCHEMA.names].to_dict("list")


def write(path: Path, *games: dict[str, list[Any]]) -> None:
    with trace_writer(path, SCHEMA) as add_trace:
        for each in games:
            add_trace(each)


def test_trace__is_read_back_unchanged(tmp_path: Path) -> None:
    file = tmp_path / "naive_alone-seed1.parquet"
    write(file, game(0), game(1, steps=5), game(2))
    trace = TraceReader().read(file, 1)
    assert list(trace.columns) == SCHEMA.names
    pd.testing.assert_frame_equal(trace, pd.DataFrame(game(1, steps=5)), check_dtype=False)
    assert trace["player"].tolist() == ["ego"] * 5
    assert trace["outcome"].tolist()[-2:] == ["", "goal"]
    assert trace["lapsed"].dtype == bool


@pytest.mark.parametrize("games", [[game(0)], []])
def test_trace__an_episode_that_is_not_there_is_refused(games: list[dict[str, list[Any]]], tmp_path: Path) -> None:
    write(tmp_path / "t.parquet", *games)
    with pytest.raises(UsageError, match="no trace of episode 7"):
        TraceReader().read(tmp_path / "t.parquet", 7)


@pytest.mark.parametrize("most_rows", [4, 1_000])
def test_reader__keeps_segments_unchanged(most_rows: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trace_file, "MOST_KEPT_ROWS", most_rows)
    parts, arm = [tmp_path / name for name in ("0", "1")], tmp_path / "arm.parquet"
    write(parts[0], game(0), game(1, steps=5))
    write(parts[1], game(2, steps=4), game(3))
    join_traces(parts, arm, {"arm": "naive_alone", "seed": 1})
    reader = TraceReader()
    for episode in (3, 0, 1, 2, 3):
        found = reader.read(arm, episode)
        pd.testing.assert_frame_equal(found, TraceReader().read(arm, episode))
        found["x_m"] = 0.0  # a caller may change its copy


def test_trace__of_an_arm_says_whose_it_is(tmp_path: Path) -> None:
    write(tmp_path / "0", game(0), game(1))
    join_traces([tmp_path / "0"], tmp_path / "arm.parquet", {"arm": "naive_alone", "seed": 1})
    assert pd.read_parquet(tmp_path / "arm.parquet").attrs == {"arm": "naive_alone", "seed": 1}
    metadata = pq.read_schema(tmp_path / "arm.parquet").metadata
    assert (metadata[b"arm"], metadata[b"seed"]) == (b"naive_alone", b"1")
    assert len(TraceReader().read(tmp_path / "arm.parquet", 1)) == len(game(1)["step"])


def test_trace__equal_games_are_equal_bytes(tmp_path: Path) -> None:
    write(tmp_path / "a.parquet", game(0), game(1))
    write(tmp_path / "b.parquet", game(0), game(1))
    assert (tmp_path / "a.parquet").read_bytes() == (tmp_path / "b.parquet").read_bytes()


def test_trace_writer__an_interrupted_arm_keeps_the_old_file(tmp_path: Path) -> None:
    file = tmp_path / "t.parquet"
    write(file, game(0))
    before = file.read_bytes()

    def cut_short() -> None:
        with trace_writer(file, SCHEMA) as add_trace:
            add_trace(game(0))
            raise RuntimeError("cut short")

    with pytest.raises(RuntimeError, match="cut short"):
        cut_short()
    assert file.read_bytes() == before
    assert [each.name for each in tmp_path.iterdir()] == ["t.parquet"]


def test_trace_writer__a_column_that_is_missing_is_an_error(tmp_path: Path) -> None:
    incomplete = game(0)
    del incomplete["speed_mps"]
    with pytest.raises(KeyError):
        write(tmp_path / "t.parquet", incomplete)
    assert list(tmp_path.iterdir()) == []


def test_trace_writer__a_full_disk_names_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def disk_full(*_: object) -> None:
        raise OSError(ENOSPC, "No space left on device")

    monkeypatch.setattr(pq.ParquetWriter, "write_table", disk_full)
    with pytest.raises(OSError, match="No space left") as error:
        write(tmp_path / "t.parquet", game(0))
    assert error.value.filename == str(tmp_path / "t.parquet")
    assert not list(tmp_path.iterdir())
