"""Checksums of finished work: a JSON file, written last, with size and SHA-256 of every file that the work made.

Where all files match, the work is on the disk as it was written. A file that is missing, torn by a power cut or changed
since is a mismatch: the work is done again.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from harness.files import content_of, digest_of_file, sync_file, sync_folder, write_atomically

_MOST_BYTES = 50_000_000


def write_checksums(path: Path, top: Path, files: Iterable[Path], facts: Mapping[str, Any]) -> None:
    """Write the checksums of files below `top`, beside `facts` about them, once the files are safely on the disk."""
    files = list(files)
    for file in files:
        sync_file(file)
        sync_folder(file.parent)
    write_atomically(path, (json.dumps({**facts, "files": checksums_of(top, files)}, indent=2) + "\n").encode())


def checksums_of(top: Path, files: Iterable[Path]) -> dict[str, dict[str, Any]]:
    """The checksum of each file, by its path below `top`. Raises OSError."""
    return {file.relative_to(top).as_posix(): _checksum(file) for file in files}


def read_checksums(path: Path) -> dict[str, Any] | None:
    """The facts and checksums of a file; None where there is none that can be read."""
    try:
        record = json.loads(content_of(path, _MOST_BYTES))
    except (OSError, ValueError, RecursionError):
        return None
    return record if isinstance(record, dict) else None


def intact_record(path: Path, top: Path, **facts: Any) -> dict[str, Any] | None:
    """The record of a file, where it has these facts and the files below `top` are as it says; None otherwise."""
    record = read_checksums(path)
    if record is None or any(record.get(name) != fact for name, fact in facts.items()) or mismatches(record, top):
        return None
    return record


def mismatches(record: Mapping[str, Any], top: Path, names: Iterable[str] | None = None) -> list[Path]:
    """The files below `top` that are not as their checksums say: all that have one, or those of these names, each of
    which must have one."""
    checksums = record.get("files", {})
    if not isinstance(checksums, dict):
        return [top]
    names = checksums if names is None else names
    return [top / name for name in names if not _matches(top / name, checksums.get(name))]


def digest_of(inputs: Any) -> str:
    """SHA-256 of a JSON value: the key of what is made from these inputs."""
    return hashlib.sha256(json.dumps(inputs, sort_keys=True).encode()).hexdigest()


def _matches(file: Path, expected: Any) -> bool:
    try:
        return file.is_file() and file.stat().st_size == expected["bytes"] and _checksum(file) == expected
    except (OSError, LookupError, TypeError, ValueError):
        return False


def _checksum(file: Path) -> dict[str, Any]:
    return {"bytes": file.stat().st_size, "sha256": digest_of_file(file, math.inf)}
