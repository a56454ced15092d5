"""One command at a time in a run folder. The system releases a lock when its process ends, however it ends."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Iterator
from pathlib import Path

from filelock import FileLock, Timeout

_LOCK = "*.lock"


class InUse(Exception):
    """Another process has the lock; the message names it, as far as it is known."""


@contextlib.contextmanager
def only_one(file: Path) -> Iterator[None]:
    """Hold a lock during the block. Raises InUse, at once, if another process holds it."""
    lock, owner = FileLock(file), file.with_name(f"{file.name}.owner")
    try:
        lock.acquire(timeout=0)
    except Timeout:
        raise InUse(_text_of(owner) or "another process") from None
    try:
        owner.write_text(f"process {os.getpid()}", encoding="utf-8")
        yield
    finally:
        owner.unlink(missing_ok=True)
        lock.release()


def register_worker(folder: Path) -> None:
    """Register this process in a folder until it ends: `wait_for_workers` waits for that."""
    folder.mkdir(exist_ok=True)
    lock = FileLock(folder / f"{os.getpid()}.lock")
    lock.acquire()
    _registered.append(lock)


_registered: list[FileLock] = []  # a lock is released when its object is gone


def wait_for_workers(folder: Path, timeout_s: float) -> None:
    """Wait until no process is registered in a folder. Raises InUse if one still is after `timeout_s`."""
    until = time.monotonic() + timeout_s
    for file in sorted(folder.glob(_LOCK)):
        try:
            with FileLock(file).acquire(timeout=max(until - time.monotonic(), 0.0)):
                file.unlink(missing_ok=True)
        except Timeout:
            raise InUse("a worker of an earlier command") from None


def _text_of(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8")[:200].strip()
    except (OSError, UnicodeDecodeError):
        return ""
