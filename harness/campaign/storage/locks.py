"""One command at a time in a run folder. The system releases a lock when its process ends, however it ends."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Iterator
from pathlib import Path

from filelock import FileLock, Timeout

from harness.errors import HarnessError
from harness.files import make_folder


class InUse(HarnessError):
    """Another process has the lock; the message names it, as far as it is known."""


@contextlib.contextmanager
def only_one(file: Path) -> Iterator[None]:
    """Hold a lock during the block. Raises InUse, at once, if another process holds it."""
    owner, name = file.with_name(f"{file.name}.owner"), ""
    with contextlib.suppress(OSError, UnicodeDecodeError):
        name = owner.read_text(encoding="utf-8")[:200].strip()
    with _held(file, 0.0, name or "another process"):
        owner.write_text(f"process {os.getpid()}", encoding="utf-8")
        try:
            yield
        finally:
            owner.unlink(missing_ok=True)


def held_by_worker(folder: Path, name: str, timeout_s: float) -> contextlib.AbstractContextManager[None]:
    """Register this process in a folder under a name, during the block: `wait_for_workers` waits for that.

    At most one process at a time has a name. Raises InUse if another one still has it after `timeout_s`.
    """
    make_folder(folder)
    lost = f"{name}: a process that was lost still has its lock, after {timeout_s:g} s"
    return _held(folder / f"{name}.lock", timeout_s, lost)


def is_held(file: Path) -> bool:
    """Whether a process has a lock, as far as this machine can see."""
    try:
        with _held(file):
            return False
    except InUse:
        return True
    except OSError:
        return False


def wait_for_workers(folder: Path, timeout_s: float) -> None:
    """Wait until no process is registered in a folder. Raises InUse if one still is after `timeout_s`."""
    until = time.monotonic() + timeout_s
    for file in sorted(folder.glob("*.lock")):
        with _held(file, max(until - time.monotonic(), 0.0), "a worker of an earlier command"):
            file.unlink(missing_ok=True)


@contextlib.contextmanager
def _held(file: Path, timeout_s: float = 0.0, holder: str = "") -> Iterator[None]:
    """Raises InUse, with these words, if another process holds the lock. On a file system without locks it is always
    free."""
    lock = FileLock(file, fallback_to_soft=False)  # a soft lock would outlive a process that is killed
    try:
        with contextlib.suppress(NotImplementedError):
            lock.acquire(timeout=timeout_s)
    except Timeout:
        raise InUse(holder) from None
    try:
        yield
    finally:
        lock.release()
