"""One command at a time in a run folder, and a lock ends with its process, however that ends."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from harness.campaign.storage.locks import InUse, only_one, wait_for_workers
from tests.support.repository import REPOSITORY

HOLD = """
import sys
from pathlib import Path
from harness.campaign.storage.locks import only_one, register_worker
path = Path(sys.argv[2])
if sys.argv[1] == "worker":
    register_worker(path)
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
