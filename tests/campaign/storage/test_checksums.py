"""A seal holds as long as every file it vouches for is there as it was written."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from harness.campaign.storage.checksums import broken, read_checksums, write_checksums


@pytest.fixture
def sealed(tmp_path: Path) -> Path:
    (tmp_path / "deep").mkdir()
    (tmp_path / "a.csv").write_bytes(b"one,two\n")
    (tmp_path / "deep" / "b.parquet").write_bytes(bytes(range(200)))
    write_checksums(
        tmp_path / "seal.json", tmp_path, [tmp_path / "a.csv", tmp_path / "deep" / "b.parquet"], {"of": "x"}
    )
    return tmp_path


def broken_in(folder: Path) -> list[str]:
    said = read_checksums(folder / "seal.json")
    assert said is not None
    return [file.relative_to(folder).as_posix() for file in broken(said, folder)]


def test_seal__holds_and_says_what_it_was_told(sealed: Path) -> None:
    said = read_checksums(sealed / "seal.json")
    assert said is not None
    assert said["of"] == "x"
    assert broken_in(sealed) == []


def test_seal__holds_where_its_folder_has_moved(sealed: Path) -> None:
    assert broken_in(sealed.rename(sealed.with_name("moved"))) == []


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
def test_seal__a_torn_file_breaks_it(name: str, tear: str, sealed: Path) -> None:
    TEARS[tear](sealed / name)
    assert broken_in(sealed) == [name]


@pytest.mark.parametrize("content", ["", "[]", "7", '{"files": ', "\udcff", "[" * 100_000])
def test_seal__that_is_torn_itself_is_none(content: str, sealed: Path) -> None:
    (sealed / "seal.json").write_bytes(content.encode(errors="surrogateescape"))
    assert read_checksums(sealed / "seal.json") is None


@pytest.mark.parametrize("files", [7, {"a.csv": 7}, {"a.csv": {}}, {"a.csv": {"bytes": 8}}, {"\0": {"bytes": 8}}])
def test_seal__that_says_nothing_sensible_vouches_for_nothing(files: object, sealed: Path) -> None:
    (sealed / "seal.json").write_text(json.dumps({"files": files}))
    assert len(broken(read_checksums(sealed / "seal.json") or {}, sealed)) == 1


def test_write_seal__what_is_not_there_can_not_be_vouched_for(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        write_checksums(tmp_path / "seal.json", tmp_path, [tmp_path / "nothing"], {})
    assert not (tmp_path / "seal.json").exists()
