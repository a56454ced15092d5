"""Checksums match as long as every file is there as it was written."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from harness.campaign.storage.checksums import mismatches, read_checksums, write_checksums


@pytest.fixture
def finished(tmp_path: Path) -> Path:
    (tmp_path / "deep").mkdir()
    (tmp_path / "a.csv").write_bytes(b"one,two\n")
    (tmp_path / "deep" / "b.parquet").write_bytes(bytes(range(200)))
    write_checksums(
        tmp_path / "checksums.json", tmp_path, [tmp_path / "a.csv", tmp_path / "deep" / "b.parquet"], {"of": "x"}
    )
    return tmp_path


def mismatches_in(folder: Path) -> list[str]:
    record = read_checksums(folder / "checksums.json")
    assert record is not None
    return [file.relative_to(folder).as_posix() for file in mismatches(record, folder)]


def test_checksums__match_and_keep_their_facts_also_after_the_folder_has_moved(finished: Path) -> None:
    record = read_checksums(finished / "checksums.json")
    assert record is not None
    assert record["of"] == "x"
    assert mismatches_in(finished) == []
    assert mismatches_in(finished.rename(finished.with_name("moved"))) == []


TEARS: dict[str, Callable[[Path], object]] = {
    "gone": Path.unlink,
    "empty": lambda file: file.write_bytes(b""),
    "cut short": lambda file: file.write_bytes(file.read_bytes()[:-1]),
    "longer": lambda file: file.write_bytes(file.read_bytes() + b"\0"),
    "zeros of its old length": lambda file: file.write_bytes(bytes(file.stat().st_size)),
    "a folder": lambda file: (file.unlink(), file.mkdir()),
}


@pytest.mark.parametrize("tear", TEARS)
@pytest.mark.parametrize("name", ["a.csv", "deep/b.parquet"])
def test_checksums__a_torn_file_is_a_mismatch(name: str, tear: str, finished: Path) -> None:
    TEARS[tear](finished / name)
    assert mismatches_in(finished) == [name]


@pytest.mark.parametrize("content", ["", "[]", "7", '{"files": ', "\udcff", "[" * 100_000])
def test_checksums__that_are_torn_themselves_are_none(content: str, finished: Path) -> None:
    (finished / "checksums.json").write_bytes(content.encode(errors="surrogateescape"))
    assert read_checksums(finished / "checksums.json") is None


@pytest.mark.parametrize("files", [7, {"a.csv": 7}, {"a.csv": {}}, {"a.csv": {"bytes": 8}}, {"\0": {"bytes": 8}}])
def test_checksums__without_meaning_match_nothing(files: object, finished: Path) -> None:
    (finished / "checksums.json").write_text(json.dumps({"files": files}))
    assert len(mismatches(read_checksums(finished / "checksums.json") or {}, finished)) == 1


def test_checksums__of_a_missing_file_are_not_written(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        write_checksums(tmp_path / "checksums.json", tmp_path, [tmp_path / "nothing"], {})
    assert not (tmp_path / "checksums.json").exists()
