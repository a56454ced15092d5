"""Where the time of a training goes, in microseconds per training step.

Each part is timed on its own, without the time of the parts inside it.
"""

from __future__ import annotations

import tempfile
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

from benchmarks.profiler import Profiler
from benchmarks.training import endless_training, training_spec
from harness.drivers.policy_file import LearnedDriver
from harness.environments.arena import Arena
from harness.environments.auto_reset import AutoReset
from harness.sumo.libsumo_simulation import LibsumoSimulation
from harness.training import compiled_ppo
from harness.training.ppo import train

_WARM_UP_STEPS = 20_000
_PARTS = (
    ("SUMO: placements, its step, readings", LibsumoSimulation, "place"),
    ("SUMO: placements, its step, readings", LibsumoSimulation, "step"),
    ("the opponent's policy", LearnedDriver, "decide"),
    ("the rest of the arena's step", Arena, "place"),
    ("the rest of the arena's step", Arena, "advance"),
    ("ended games are reset", AutoReset, "reset"),
    ("the learner's policy in the rollout", compiled_ppo._ActorCritic, "sample"),
    ("the rest of the rollout: buffer, advantages, callbacks", compiled_ppo.CompiledPPO, "collect_rollouts"),
    ("the update: gradient steps", compiled_ppo, "epoch"),
    ("the rest of the update: copies, logging", compiled_ppo.CompiledPPO, "train"),
)


class _Over(Exception):
    """The time is up."""


def training_table(seconds: float) -> str:
    """The parts of a training in Markdown. The classes stay patched: call this once per process."""
    profiler = Profiler()
    for words, owner, name in _PARTS:
        setattr(owner, name, profiler.wrap(words, getattr(owner, name)))
    first = [0, 0.0]
    last = [0, 0.0]

    def on_progress(done: int, total: int) -> None:
        profiler.commit()
        if done < _WARM_UP_STEPS:
            profiler.total_s.clear()
            first[:] = [done, time.perf_counter()]
        last[:] = [done, time.perf_counter()]
        if last[1] - first[1] > seconds:
            raise _Over

    spec: Any = training_spec(endless_training())
    with tempfile.TemporaryDirectory(prefix="benchmark-") as scratch, suppress(_Over):
        train(spec, checkpoint=Path(scratch) / "checkpoint", key="benchmark", card={}, on_progress=on_progress)
    steps, whole_us = last[0] - first[0], 1e6 * (last[1] - first[1]) / (last[0] - first[0])
    rows = [(words, 1e6 * profiler.total_s[words] / steps) for words, *_ in _PARTS]
    rows.append(("the rest: segments, checkpoints", whole_us - sum(part_us for _, part_us in rows)))
    lines = ["| part | µs per training step | share |", "| --- | ---: | ---: |"]
    lines += [f"| {words} | {part_us:.2f} | {part_us / whole_us:.0%} |" for words, part_us in rows]
    return "\n".join([*lines, f"| all | {whole_us:.2f} | {1e6 / whole_us:,.0f} training steps/s |"])
