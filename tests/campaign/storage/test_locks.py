"""One at a time, and a lock ends with its process, however that ends."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from harness.campaign.storage.locks import InUse, only_one, share, wait_for_all
from tests.support.repository import REPOSITORY

HOLD = """
import sys
from pathlib import Path
from harness.campaign.storage.locks import only_one, share
file = Path(sys.argv[2])
if sys.argv[1] == "share":
    share(file)
    print("has it", flush=True)
    sys.stdin.read()
else:
    with only_one(file):
        print("has it", flush=True)
        sys.stdin.read()
"""


def holder(kind: str, file: Path) -> subprocess.Popen[str]:
    command = [sys.executable, "-c", HOLD, kind, str(file)]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=REPOSITORY)
    assert process.stdout is not None
    assert process.stdout.readline() == "has it\n"
    return process


def test_only_one__one_after_the_other(tmp_path: Path) -> None:
    for _ in range(2):
        with only_one(tmp_path / "lock"):
            pass


def test_only_one__who_has_it_is_named_and_a_killed_one_leaves_nothing(tmp_path: Path) -> None:
    other = holder("hold", tmp_path / "lock")
    try:
        with pytest.raises(InUse, match=f"^process {other.pid}$"), only_one(tmp_path / "lock"):
            pytest.fail("two at once")
    finally:
        other.send_signal(signal.SIGKILL)
        other.communicate()
    with only_one(tmp_path / "lock"):
        assert (tmp_path / "lock").read_text() == f"process {os.getpid()}\n"


def test_wait_for_all__until_every_sharer_has_ended(tmp_path: Path) -> None:
    descriptor = share(tmp_path / "workers")
    os.close(descriptor)
    wait_for_all(tmp_path / "workers", 0.0)
    others = [holder("share", tmp_path / "workers") for _ in range(2)]
    for other in others:
        with pytest.raises(InUse, match="a worker"):
            wait_for_all(tmp_path / "workers", 0.1)
        other.send_signal(signal.SIGKILL)
        other.communicate()
    wait_for_all(tmp_path / "workers", 0.0)
