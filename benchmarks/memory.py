"""How much memory a training worker takes, and whether it goes on taking more."""

from __future__ import annotations

import importlib
import resource
import sys
from pathlib import Path
from statistics import median
from typing import Any

from benchmarks.budget import Budget
from benchmarks.sides import Pace, Side, Tell, opened

_STATUS = Path("/proc/self/status")
_EVERY_S = 1.0
_OF_EACH_END = 5  # laps whose median is taken: what is freed and taken again between two updates is no growth


def memory_mb() -> tuple[float, float]:
    """Resident memory of this process in MB: now, and at its most. Where the system doesn't tell, both are the most."""
    if _STATUS.is_file():
        fields = dict(line.split(":", 1) for line in _STATUS.read_text().splitlines() if ":" in line)
        now, most = (int(fields[name].split()[0]) * 1024 / 1e6 for name in ("VmRSS", "VmHWM"))
        return now, most
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    most = peak / 1e6 if sys.platform == "darwin" else peak * 1024 / 1e6
    return most, most


def worker_side(pace: Pace) -> None:
    """Training in a process that has loaded what a campaign's worker has loaded."""
    importlib.import_module("harness.campaign.execution.worker_pool")
    from benchmarks.training import endless, train_in_laps

    def weigh() -> dict[str, float]:
        now, most = memory_mb()
        return {"now_mb": now, "most_mb": most}

    train_in_laps(pace, endless(), weigh)


def worker_memory(budget: Budget, tell: Tell) -> tuple[dict[str, float], dict[str, Any]]:
    """Peak and growth of a training worker's memory."""
    wanted = budget.memory_warm_up_steps + budget.memory_steps
    steps, weighed = 0.0, []
    with opened({"worker": Side(worker_side)}, _EVERY_S) as runners:
        while steps < wanted:
            lap = runners["worker"].lap()
            steps += lap.units
            weighed.append((steps, lap.values["now_mb"], lap.values["most_mb"]))
            tell(min(steps / wanted, 1.0))
    warm = [now for done, now, _ in weighed if done >= budget.memory_warm_up_steps]
    grown = median(warm[-_OF_EACH_END:]) - median(warm[:_OF_EACH_END])
    details = {"unit": "MB", "after_warm_up_mb": warm[0], "steps_now_most_mb": weighed}
    return {"worker_peak_mb": weighed[-1][2], "worker_growth_mb": grown}, details
