"""One command at a time in a run folder, and a lock ends with its process, however that ends."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from harness.campaign.storage.locks import InUse, held_by_worker, is_held, only_one, wait_for_workers
from harness.errors import StageFailed
from tests.support.repository import REPOSITORY

HOLD = """
import sys
from pathlib import Path
from harness.campaign.storage.locks import held_by_worker, only_one, register_worker
path = Path(sys.argv[2])
if sys.argv[1] == "worker":
    register_worker(path)
    print("has it", flush=True)
    sys.stdin.read()
elif sys.argv[1] == "stage":
    with held_by_worker(path, "a-seed1", 0.0):
        print("has it", flush=True)
        sys.stdin.read()
else:
    with only_one(path):
        print("has it", flush=True)
        sys.stdin.read()
"""


def holder(kind: str, path: Path) -> subprocess.Popen[str]:
    command = [sys.executable, "-c", HOLD, kind, str(path)]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=REPOSITORY)
    assert process.stdout is not None
    assert process.stdout.readline() == "has it\n"
    return process


def test_only_one__one_after_the_other(tmp_path: Path) -> None:
    for _ in range(2):
        with only_one(tmp_path / "lock"):
            pass


def test_only_one__the_holder_is_named_and_a_killed_one_leaves_nothing(tmp_path: Path) -> None:
    other = holder("command", tmp_path / "lock")
    try:
        with pytest.raises(InUse, match=f"^process {other.pid}$"), only_one(tmp_path / "lock"):
            pytest.fail("two at once")
    finally:
        other.send_signal(signal.SIGKILL)
        other.communicate()
    with only_one(tmp_path / "lock"):
        assert (tmp_path / "lock.owner").read_text() == f"process {os.getpid()}"


def test_only_one__a_holder_that_left_no_name_is_another_process(tmp_path: Path) -> None:
    other = holder("command", tmp_path / "lock")
    try:
        (tmp_path / "lock.owner").unlink()
        with pytest.raises(InUse, match=r"^another process$"), only_one(tmp_path / "lock"):
            pytest.fail("two at once")
    finally:
        other.kill()
        other.communicate()


def test_wait_for_workers__until_every_worker_has_ended(tmp_path: Path) -> None:
    wait_for_workers(tmp_path / "workers", 0.0)
    workers = [holder("worker", tmp_path / "workers") for _ in range(2)]
    for worker in workers:
        with pytest.raises(InUse, match="a worker"):
            wait_for_workers(tmp_path / "workers", 0.1)
        worker.send_signal(signal.SIGKILL)
        worker.communicate()
    wait_for_workers(tmp_path / "workers", 0.0)
    assert not list((tmp_path / "workers").iterdir())


def test_held_by_worker__one_process_at_a_time_has_a_name(tmp_path: Path) -> None:
    """As where the process of a lost node still writes: the next one waits, and the command counts it as a worker."""
    other = holder("stage", tmp_path / "workers")
    try:
        with (
            pytest.raises(StageFailed, match=r"^a-seed1: a process that was lost still has its lock, after 0\.1 s$"),
            held_by_worker(tmp_path / "workers", "a-seed1", 0.1),
        ):
            pytest.fail("two at once")
        with held_by_worker(tmp_path / "workers", "b-seed1", 0.1):
            pass
        with pytest.raises(InUse, match="a worker"):
            wait_for_workers(tmp_path / "workers", 0.1)
    finally:
        other.send_signal(signal.SIGKILL)
        other.communicate()
    with held_by_worker(tmp_path / "workers", "a-seed1", 0.1):
        pass
    wait_for_workers(tmp_path / "workers", 0.0)


def test_is_held__says_whether_a_process_has_a_lock(tmp_path: Path) -> None:
    assert not is_held(tmp_path / "lock")
    other = holder("command", tmp_path / "lock")
    try:
        assert is_held(tmp_path / "lock")
    finally:
        other.kill()
        other.communicate()
    assert not is_held(tmp_path / "lock")
