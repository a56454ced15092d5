"""Reading files that others wrote: plain files of a size that makes sense, never a pipe to wait on."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path

_KINDS = {
    stat.S_IFDIR: "is a folder, not a file",
    stat.S_IFIFO: "is a pipe, not a file",
    stat.S_IFSOCK: "is a socket, not a file",
    stat.S_IFCHR: "is a device, not a file",
    stat.S_IFBLK: "is a device, not a file",
}


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
