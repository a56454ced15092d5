"""What is built once for a whole test session, whichever process asks first.

pytest-xdist runs tests in several processes. They ask for the same run folders, which take long to build:
`built_once` lets the first one build, under a lock, and gives the result to the others.
"""

from __future__ import annotations

import atexit
import fcntl
import os
import shutil
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

VARIABLE = "HARNESS_TESTS_SHARED"
"""Names the folder for the processes that the first one starts."""


@cache
def shared_folder() -> Path:
    """A folder of the test session. The process that makes it removes it when it ends."""
    if VARIABLE not in os.environ:
        folder = tempfile.mkdtemp(prefix="harness-tests-")
        os.environ[VARIABLE] = folder
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return Path(os.environ[VARIABLE])


def built_once(name: str, build: Callable[[Path], object]) -> Path:
    """The folder `name` of the session, filled by `build`. Tests read it; none may change it.

    A build that fails fails every test that asks for it, with the message of the first one.
    """
    folder = shared_folder() / name
    with (shared_folder() / f"{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        failure = folder.with_suffix(".failed")
        if failure.exists():
            pytest.fail(failure.read_text(encoding="utf-8"))
        if not folder.exists():
            folder.mkdir()
            try:
                build(folder)
            except BaseException as error:
                failure.write_text(f"{folder.name} could not be built: {error!r}", encoding="utf-8")
                raise
    return folder
