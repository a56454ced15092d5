"""One command at a time in a run folder. The system gives a lock back when its process ends, however it ends."""

from __future__ import annotations

import contextlib
import errno
import os
import time
from collections.abc import Iterator
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows: nobody is kept out
    fcntl = None  # type: ignore[assignment]

_TAKEN = (errno.EWOULDBLOCK, errno.EACCES)


class InUse(Exception):
    """Somebody else has the lock; the message says who, as far as is known."""


@contextlib.contextmanager
def only_one(file: Path) -> Iterator[None]:
    """Be the only one who is in this block, of all processes. Raises InUse, at once, if somebody is in it."""
    with file.open("a+b") as lock:
        if not _locked(lock.fileno(), exclusive=True):
            lock.seek(0)
            raise InUse(lock.read(200).decode(errors="replace").strip() or "another process")
        lock.truncate(0)
        lock.write(f"process {os.getpid()}\n".encode())
        lock.flush()
        try:
            yield
        finally:
            lock.truncate(0)


def share(file: Path) -> int:
    """Be one of many, until this process ends: `wait_for_all` of another process waits for that. The descriptor."""
    descriptor = os.open(file, os.O_RDWR | os.O_CREAT, 0o644)
    _locked(descriptor, exclusive=False)
    return descriptor


def wait_for_all(file: Path, patience_s: float) -> None:
    """Wait until nobody shares a file. Raises InUse if somebody still does after a while."""
    with file.open("a+b") as lock:
        until = time.monotonic() + patience_s
        while not _locked(lock.fileno(), exclusive=True):
            if time.monotonic() > until:
                raise InUse("a worker of an earlier command")
            time.sleep(0.05)


def _locked(descriptor: int, exclusive: bool) -> bool:
    """Whether the lock is ours now. On a file system that has no locks it always is."""
    if fcntl is not None:
        try:
            fcntl.flock(descriptor, (fcntl.LOCK_EX if exclusive else fcntl.LOCK_SH) | fcntl.LOCK_NB)
        except OSError as error:
            return error.errno not in _TAKEN
    return True
