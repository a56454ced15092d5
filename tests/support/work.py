"""Bounds on processor time, which are meant for an ordinary machine: on a slower one, they are that much longer."""

from __future__ import annotations

import resource
import subprocess
from functools import cache

from tests.support.repository import REPOSITORY
from tests.support.tiny import HARNESS

CHECK_S = 1.6  # processor time of a `harness check` on an idle machine with two cores, on which bounds were set


def assert_work(took_s: float, most_s: float) -> None:
    """Assert that what took `took_s` of processor time takes less than `most_s` on an ordinary machine."""
    if took_s >= most_s:
        most_s *= slowness()
    assert took_s < most_s, f"it took {took_s:.1f} s of work; the bound on this machine is {most_s:.1f} s"


@cache
def slowness() -> float:
    """How much longer than on an ordinary machine a command takes here: 1 at least."""
    before = children_s()
    campaign = str(REPOSITORY / "campaigns" / "paper_merge.toml")
    subprocess.run([str(HARNESS), "check", campaign], check=True, timeout=600.0, stdout=subprocess.DEVNULL)
    return max(1.0, (children_s() - before) / CHECK_S)


def children_s() -> float:
    """The processor time of the processes that this one has started and that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
