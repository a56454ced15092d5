"""Atomic writing and bounded reading of files."""

from __future__ import annotations

import hashlib
import os
import tracemalloc
from pathlib import Path

import pytest

from harness.errors import UsageError
from harness.files import check_new_file, content_of, digest_of_file, write_atomically


def test_write_atomically__writes_and_replaces(tmp_path: Path) -> None:
    file = tmp_path / "table.csv"
    write_atomically(file, b"old")
    write_atomically(file, b"new\x00")
    assert file.read_bytes() == b"new\x00"
    assert file.stat().st_mode & 0o777 == 0o644
    assert [each.name for each in tmp_path.iterdir()] == ["table.csv"]


def test_write_atomically__a_failure_leaves_only_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "table.csv"
    write_atomically(file, b"old")

    def disk_full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", disk_full)
    with pytest.raises(OSError, match="No space left") as error:
        write_atomically(file, b"new")
    assert error.value.filename == str(file)
    assert file.read_bytes() == b"old"
    assert [each.name for each in tmp_path.iterdir()] == ["table.csv"]


def test_write_atomically__a_missing_folder_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        write_atomically(tmp_path / "nowhere" / "table.csv", b"")


def test_check_new_file__wants_a_folder_that_is_there_and_a_file(tmp_path: Path) -> None:
    check_new_file(tmp_path / "results.xml")
    with pytest.raises(UsageError, match=r"--junit: .*results\.xml: there is no folder .*nowhere \(create it"):
        check_new_file(tmp_path / "nowhere" / "results.xml", "--junit")
    with pytest.raises(UsageError, match=r"is a folder \(name a file\)"):
        check_new_file(tmp_path)


def test_digest_of_file__reads_in_blocks(tmp_path: Path) -> None:
    file = tmp_path / "weights.bin"
    file.touch()
    os.truncate(file, 30_000_000)
    tracemalloc.start()
    try:
        digest = digest_of_file(file)
        assert tracemalloc.get_traced_memory()[1] < 5_000_000
    finally:
        tracemalloc.stop()
    assert digest == hashlib.sha256(bytes(30_000_000)).hexdigest()


def test_content_of__a_small_file_takes_little_memory_whatever_the_bound(tmp_path: Path) -> None:
    file = tmp_path / "table.csv"
    file.write_bytes(b"content")
    tracemalloc.start()
    try:
        assert content_of(file, 10**9) == b"content"
        assert tracemalloc.get_traced_memory()[1] < 10**6
    finally:
        tracemalloc.stop()


def test_content_of__a_larger_file_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "table.csv"
    file.write_bytes(b"content")
    assert content_of(file, 7) == b"content"
    with pytest.raises(OSError, match="is too large"):
        content_of(file, 6)
