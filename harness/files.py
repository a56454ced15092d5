"""Writing files so that they are there whole or not at all, even if the power fails.

A file on its way has a name of its own beside the one it will get; a process that is killed leaves it behind, and
`drop_scratch` takes it away.
"""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

_SCRATCH = ".part"


def write_atomically(path: Path, content: bytes) -> None:
    """Write a file by way of a temporary one beside it. Raises OSError; then the old file, if any, is untouched."""
    handle, scratch = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.", suffix=_SCRATCH)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        os.chmod(scratch, 0o644)
        replace_durably(Path(scratch), path)
    except BaseException:
        Path(scratch).unlink(missing_ok=True)
        raise


def scratch_beside(path: Path) -> Path:
    """Where a file that is written piece by piece is until it is whole."""
    return path.with_name(f".{path.name}{_SCRATCH}")


def replace_durably(scratch: Path, path: Path) -> None:
    """Give a whole file its name: after a power cut there is the old file or this one, with all that is in it."""
    sync_file(scratch)
    os.replace(scratch, path)
    sync_folder(path.parent)


def drop_scratch(folder: Path) -> None:
    """Take away what killed processes left half written, in a folder and below."""
    for left in folder.rglob(f".*{_SCRATCH}"):
        left.unlink(missing_ok=True)


def make_folder(folder: Path) -> None:
    """Make a folder, and what it lies in, so that they outlast a power cut as the files in them do."""
    if not folder.is_dir():
        make_folder(folder.parent)
        folder.mkdir(exist_ok=True)
        sync_folder(folder.parent)


def sync_file(path: Path) -> None:
    """Make sure that a file's content outlasts a power cut."""
    with path.open("rb") as file:
        os.fsync(file.fileno())


def sync_folder(folder: Path) -> None:
    """Make sure that the names in a folder, new ones and replaced ones, outlast a power cut."""
    if os.name == "posix":
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
