"""Atomic writing and bounded reading of files."""

from __future__ import annotations

import hashlib
import os
import tracemalloc
from pathlib import Path

import pytest

from harness.errors import UsageError
from harness.files import check_new_file, content_of, digest_of_file, drop_scratch, new_folder, write_atomically


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


def test_new_folder__fills_an_empty_folder_and_leaves_it_where_it_is(tmp_path: Path) -> None:
    folder = tmp_path / "empty"
    folder.mkdir()
    before = folder.stat().st_ino
    with new_folder(folder) as scratch:
        (scratch / "a.txt").touch()
        assert list(folder.iterdir()) == []
    assert folder.stat().st_ino == before
    assert list(tmp_path.rglob("*")) == [folder, folder / "a.txt"]


def test_new_folder__that_somebody_fills_meanwhile_is_left_as_it_is(tmp_path: Path) -> None:
    folder = tmp_path / "out"

    def fill(scratch: Path) -> None:
        (scratch / "a.txt").touch()
        folder.mkdir()
        (folder / "a.txt").write_text("mine")

    with pytest.raises(UsageError, match="is there already, and not empty"), new_folder(folder) as scratch:
        fill(scratch)
    assert [each.name for each in tmp_path.iterdir()] == ["out"]
    assert (folder / "a.txt").read_text() == "mine"


def test_new_folder__says_why_it_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "nowhere").symlink_to(tmp_path / "gone")
    for name, message in (
        ("nowhere", "is a file, not a folder"),
        ("no/out", "there is no folder"),
        ("x" * 255, "can't"),
    ):
        with pytest.raises(UsageError, match=message), new_folder(tmp_path / name):
            pass


def test_drop_scratch__removes_files_and_folders_of_killed_processes(tmp_path: Path) -> None:
    (tmp_path / "a" / ".b.1.part" / ".c.part").mkdir(parents=True)
    (tmp_path / "a" / ".d.part").touch()
    (tmp_path / "a" / ".link.part").symlink_to(tmp_path)
    drop_scratch(tmp_path)
    assert list(tmp_path.rglob("*")) == [tmp_path / "a"]


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
