"""Memory of a training worker: its peak, and its growth over many steps."""

from __future__ import annotations

import importlib
import resource
import sys
from pathlib import Path
from statistics import median

from benchmarks.budget import Budget
from benchmarks.figures import Measured
from benchmarks.sides import LapTimer, OnProgress, Side, running_sides

_STATUS = Path("/proc/self/status")
_LAP_S = 1.0
_LAPS_PER_END = 5  # a median of several laps: memory that is freed and taken again between two updates is no growth


def memory_mb() -> tuple[float, float]:
    """Resident memory of this process in MB: now, and its peak. Without /proc/self/status both are the peak."""
    if _STATUS.is_file():
        fields = dict(line.split(":", 1) for line in _STATUS.read_text().splitlines() if ":" in line)
        now, peak = (int(fields[name].split()[0]) * 1024 / 1e6 for name in ("VmRSS", "VmHWM"))
        return now, peak
    max_rss = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss  # bytes on macOS, KiB elsewhere
    peak = max_rss / 1e6 if sys.platform == "darwin" else max_rss * 1024 / 1e6
    return peak, peak


def worker_side(timer: LapTimer) -> None:
    """Training in a process that has loaded the same modules as a campaign's worker."""
    importlib.import_module("harness.campaign.execution.worker_pool")
    from benchmarks.training import endless_training, train_in_laps

    def read_memory() -> dict[str, float]:
        now, peak = memory_mb()
        return {"now_mb": now, "most_mb": peak}

    train_in_laps(timer, endless_training(), read_memory)


def worker_memory(budget: Budget, on_progress: OnProgress) -> Measured:
    """Peak and growth of a training worker's memory."""
    total_steps = budget.memory_warm_up_steps + budget.memory_steps
    steps, readings = 0.0, []
    with running_sides({"worker": Side(run=worker_side)}, lap_s=_LAP_S) as runners:
        while steps < total_steps:
            lap = runners["worker"].lap()
            steps += lap.units
            readings.append((steps, lap.values["now_mb"], lap.values["most_mb"]))
            on_progress(min(steps / total_steps, 1.0))
    warm = [now for done, now, _ in readings if done >= budget.memory_warm_up_steps]
    growth = median(warm[-_LAPS_PER_END:]) - median(warm[:_LAPS_PER_END])
    details = {"unit": "MB", "after_warm_up_mb": warm[0], "steps_now_most_mb": readings}
    return {"worker_peak_mb": readings[-1][2], "worker_growth_mb": growth}, details
