"""One command at a time in a run folder, and a lock ends with its process, however that ends."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from harness.campaign.storage.locks import InUse, held_by_worker, is_held, only_one, wait_for_workers
from tests.support.repository import REPOSITORY

HOLD = """
import sys
from pathlib import Path
from harness.campaign.storage.locks import held_by_worker, only_one
path, stage = Path(sys.argv[1]), sys.argv[2]
with held_by_worker(path, stage, 0.0) if stage else only_one(path):
    print("has it", flush=True)
    sys.stdin.read()
"""


@contextmanager
def holder(path: Path, stage: str = "") -> Iterator[int]:
    """The id of a process that holds a lock: a command's, or the worker's of a stage. It is killed after the block."""
    command = [sys.executable, "-c", HOLD, str(path), stage]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=REPOSITORY)
    try:
        assert process.stdout is not None
        assert process.stdout.readline() == "has it\n"
        yield process.pid
    finally:
        process.kill()
        process.communicate()


def test_only_one__the_holder_is_named_and_a_killed_one_leaves_nothing(tmp_path: Path) -> None:
    with holder(tmp_path / "lock") as pid:
        with pytest.raises(InUse, match=f"^process {pid}$"), only_one(tmp_path / "lock"):
            pytest.fail("two at once")
        (tmp_path / "lock.owner").unlink()
        with pytest.raises(InUse, match=r"^another process$"), only_one(tmp_path / "lock"):
            pytest.fail("two at once")
    for _ in range(2):
        with only_one(tmp_path / "lock"):
            assert (tmp_path / "lock.owner").read_text() == f"process {os.getpid()}"


def test_workers__are_waited_for_and_one_at_a_time_has_a_stage(tmp_path: Path) -> None:
    """As where the process of a lost node still writes: the next one waits, and the command counts it as a worker."""
    workers = tmp_path / "workers"
    wait_for_workers(workers, 0.0)
    for stage in ("a-seed1", "c-seed1"):
        with holder(workers, stage):
            expected = rf"^{stage}: a process that was lost still has its lock, after 0\.1 s$"
            with pytest.raises(InUse, match=expected), held_by_worker(workers, stage, 0.1):
                pytest.fail("two at once")
            with held_by_worker(workers, "b-seed1", 0.1):
                pass
            with pytest.raises(InUse, match="a worker"):
                wait_for_workers(workers, 0.1)
    with held_by_worker(workers, "a-seed1", 0.1):
        pass
    wait_for_workers(workers, 0.0)
    assert not list(workers.iterdir())


def test_is_held__says_whether_a_process_has_a_lock(tmp_path: Path) -> None:
    assert not is_held(tmp_path / "lock")
    with holder(tmp_path / "lock"):
        assert is_held(tmp_path / "lock")
    assert not is_held(tmp_path / "lock")
