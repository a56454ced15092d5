"""Reading files that others wrote, and writing files whole or not at all, even if the power fails.

Reading takes plain files of a limited size, never a pipe. Writing goes through a temporary file beside the final name;
a process that is killed leaves it behind, and `drop_scratch` removes it.
"""

from __future__ import annotations

import errno
import os
import stat
import tempfile
from pathlib import Path

_SCRATCH = ".part"
_KINDS = {
    stat.S_IFDIR: "is a folder, not a file",
    stat.S_IFIFO: "is a pipe, not a file",
    stat.S_IFSOCK: "is a socket, not a file",
    stat.S_IFCHR: "is a device, not a file",
    stat.S_IFBLK: "is a device, not a file",
}


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


def check_file(path: Path, most_bytes: int) -> None:
    """Raise OSError, with what is wrong in its `strerror`, unless this is a plain file of at most so many bytes."""
    status = os.stat(path)
    kind = stat.S_IFMT(status.st_mode)
    if kind != stat.S_IFREG:
        raise OSError(errno.EINVAL, _KINDS.get(kind, "is no plain file"), str(path))
    if status.st_size > most_bytes:
        raise OSError(errno.EFBIG, _too_large(status.st_size, most_bytes), str(path))


def content_of(path: Path, most_bytes: int) -> bytes:
    """The bytes of a plain file. Raises OSError, with what is wrong in its `strerror`, for anything else."""
    check_file(path, most_bytes)
    # it may have become something else in the meantime: a pipe that nobody writes to must not be waited for
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    with os.fdopen(descriptor, "rb") as file:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise OSError(errno.EINVAL, "is no plain file", str(path))
        content = file.read(most_bytes + 1)
    if len(content) > most_bytes:
        raise OSError(errno.EFBIG, _too_large(len(content), most_bytes), str(path))
    return content


def leads_out(path: Path, folder: Path) -> bool:
    """Whether a path below a folder is, through symbolic links, a place outside it."""
    return not Path(os.path.realpath(path)).is_relative_to(os.path.realpath(folder))


def _too_large(size_bytes: int, most_bytes: int) -> str:
    return f"is too large: {size_bytes / 1e6:,.0f} MB, at most {most_bytes / 1e6:,.0f} MB are read"
