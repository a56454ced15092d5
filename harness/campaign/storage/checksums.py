"""Seals: which files somebody finished, each with its size and SHA-256, as a JSON file that is written last.

Where a seal holds, everything it vouches for is on the disk as it was written. A file that is gone, torn by a power
cut or changed since breaks it: then the work is done again, and never taken for done.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from harness.files import content_of, sync_file, sync_folder, write_atomically

_MOST_BYTES = 50_000_000


def write_checksums(seal: Path, top: Path, files: Iterable[Path], facts: Mapping[str, Any]) -> None:
    """Vouch for files below `top`, and say `facts` of them."""
    vouched = {}
    for file in files:
        sync_file(file)
        sync_folder(file.parent)
        vouched[file.relative_to(top).as_posix()] = _print_of(file)
    write_atomically(seal, (json.dumps({**facts, "files": vouched}, indent=2) + "\n").encode())


def read_checksums(seal: Path) -> dict[str, Any] | None:
    """What a seal says; None where there is none that can be read."""
    try:
        said = json.loads(content_of(seal, _MOST_BYTES))
    except (OSError, ValueError, RecursionError):
        return None
    return said if isinstance(said, dict) else None


def broken(said: Mapping[str, Any], top: Path) -> list[Path]:
    """The files that are not as a seal says."""
    vouched = said.get("files", {})
    if not isinstance(vouched, dict):
        return [top]
    return [top / name for name, expected in vouched.items() if not _is(top / name, expected)]


def _is(file: Path, expected: Any) -> bool:
    try:
        return file.stat().st_size == expected["bytes"] and _print_of(file) == expected
    except (OSError, LookupError, TypeError, ValueError):
        return False


def _print_of(file: Path) -> dict[str, Any]:
    with file.open("rb") as content:
        digest, size = hashlib.sha256(), 0
        while piece := content.read(1 << 20):
            digest.update(piece)
            size += len(piece)
    return {"bytes": size, "sha256": digest.hexdigest()}
