"""The folder of the policies that a finished run read, found again by their checksums.

A manifest names the folder as the campaign's file wrote it. That path is not trusted: folders that may be meant are
compared with the checksums of the manifest, and only one that has every policy as it was read is taken.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from pathlib import Path, PurePosixPath

from harness.files import content_of
from harness.shipped_documents import shipped

_FILES = ("policy.json", "policy.safetensors")
_MOST_BYTES = 1_000_000_000


def policies_of_run(run: Path, written: str | None, hashes: Mapping[str, str]) -> Path | None:
    """The folder that a run's campaign wrote as `written`; None if there is none with the policies of `hashes`.

    Shipped policies are searched, then the path from a folder beside the run folder, such as `campaigns/` beside
    `reports/`, and from the current folder.
    """
    read = {_place(name): digest for name, digest in hashes.items() if PurePosixPath(name).name in _FILES}
    if written is None or not read:
        return None
    return next((folder for folder in _candidates(run, written) if _holds(folder, read)), None)


def _place(name: str) -> str:
    """The path of a policy's file within the folder of policies."""
    return "/".join(PurePosixPath(name).parts[-2:])


def _candidates(run: Path, written: str) -> Iterator[Path]:
    ours = shipped("policies")
    yield from sorted(each for each in ours.iterdir() if each.is_dir()) if ours.is_dir() else ()
    if not PurePosixPath(written).is_absolute():
        yield from (start / written for start in (run.absolute().parent, run.absolute().parent.parent, Path.cwd()))


def _holds(folder: Path, read: Mapping[str, str]) -> bool:
    try:
        return all(
            hashlib.sha256(content_of(folder / place, _MOST_BYTES)).hexdigest() == digest
            for place, digest in read.items()
        )
    except OSError:
        return False
