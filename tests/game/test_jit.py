"""Turns of compilation: one thread of one process at a time, and no failure without a writable cache."""

from __future__ import annotations

import contextlib
import errno
import logging
import os
import subprocess
import sys
from pathlib import Path

import numba
import numpy as np
import pytest

from harness.game import jit
from tests.support.repository import REPOSITORY

HOLD_TURN = """
import sys
from pathlib import Path
from harness.game import jit
print("waiting", flush=True)
with jit._turn(Path(sys.argv[1])):
    print("in turn", flush=True)
    sys.stdin.readline()
"""


@pytest.fixture
def cache(tmp_path: Path) -> Path:
    """A folder of the cache that does not exist yet."""
    return tmp_path / "compiled"


def turn_holder(folder: Path) -> subprocess.Popen[str]:
    """A process that takes the turn and keeps it until its input ends."""
    return subprocess.Popen(
        [sys.executable, "-c", HOLD_TURN, folder],
        cwd=REPOSITORY,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )


def line_of(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    return process.stdout.readline().strip()


def test_turn__of_a_folder_passes_to_the_next_process_when_its_process_dies(tmp_path: Path) -> None:
    first = turn_holder(tmp_path)
    second = third = None
    try:
        assert [line_of(first), line_of(first)] == ["waiting", "in turn"]
        second = turn_holder(tmp_path)
        assert line_of(second) == "waiting"
        with pytest.raises(subprocess.TimeoutExpired):
            second.communicate(timeout=0.5)  # the end of its input does not end it: it is not in turn
        third = turn_holder(tmp_path / "another version")
        assert [line_of(third), line_of(third)] == ["waiting", "in turn"]
        first.kill()
        assert second.communicate(timeout=30)[0].split("\n")[-2] == "in turn"
    finally:
        for process in filter(None, (first, second, third)):
            process.kill()
            process.communicate()


def test_turn__a_fork_of_a_process_that_had_one_takes_its_own(cache: Path) -> None:
    with jit._turn(cache):
        pass
    child = os.fork()
    if child == 0:
        with contextlib.suppress(BaseException), jit._turn(cache):
            os._exit(0)
        os._exit(1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


def median_of_sorted(values: np.ndarray) -> float:
    return float(np.median(np.sort(values)))


def test_compiling__is_counted_by_own_functions(
    cache: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """numba compiles several of its own for this one."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(cache))
    monkeypatch.setattr(jit, "_functions", set())
    with caplog.at_level(logging.INFO, logger="harness.preparation"):
        assert jit.compiled(median_of_sorted)(np.array([3.0, 1.0, 2.0])) == 2.0
    counts = [(record.done, record.total) for record in caplog.records]  # type: ignore[attr-defined]
    assert len(counts) > 1
    assert set(counts) == {(0, 1)}


@pytest.mark.parametrize("lacking", ["a writable folder", "locks of the file system"])
def test_turn__does_not_need(lacking: str, cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_locks(*_: object) -> None:
        raise OSError(errno.ENOSYS, os.strerror(errno.ENOSYS))

    if lacking == "a writable folder":
        cache.write_text("a file, not a folder")
    else:
        monkeypatch.setattr(pytest.importorskip("fcntl"), "flock", no_locks)
    with jit._turn(cache), jit._turn(cache):  # a function and one that it calls
        pass
