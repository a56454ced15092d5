"""The figures: what each is called, what it says, what it is to reach, and which measurement brings it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from typing import Any

from benchmarks.budget import Budget
from benchmarks.sides import Tell


@dataclass(frozen=True)
class Figure:
    """One number of the results."""

    key: str
    what: str
    unit: str = ""
    target: float | None = None
    at_least: bool = False
    """Whether the target is the least it may be; otherwise it is the most."""

    def reached(self, value: float | None) -> bool | None:
        """Whether the target is reached; None where there is none, and never by what was not measured."""
        if self.target is None:
            return None
        return value is not None and (value >= self.target if self.at_least else value <= self.target)

    def written(self, value: float | None) -> str:
        """The value for people."""
        if value is None:
            return "not measured"
        digits = 2 if abs(value) < 10 else 1 if abs(value) < 100 else 0
        return f"{value:.{digits}f}{self.unit}"

    def written_target(self) -> str:
        """The target for people."""
        if self.target is None:
            return "reported"
        return f"{'≥' if self.at_least else '≤'} {self.target:g}{self.unit}"


FIGURES = (
    Figure(
        "arena_vs_libsumo",
        "game-steps/s of an arena (64 games, two learners, everything counted), as a share of a bare libsumo loop's",
        target=0.55,
        at_least=True,
    ),
    Figure(
        "training_vs_free_env",
        "training steps/s on the arena, as a share of those on an environment that costs nothing",
        target=0.70,
        at_least=True,
    ),
    Figure("vs_highway_env", "game-steps/s of one process, in multiples of highway-env's merge", "×", 30.0, True),
    Figure("vs_subproc", "training steps/s, in multiples of SubprocVecEnv's on all cores", "×", 5.0, True),
    Figure("libsumo_vs_traci", "steps/s of one game in libsumo, in multiples of TraCI's over a socket", "×"),
    Figure(
        "traffic_overhead_50", "what the harness adds to SUMO's step, as a share of it, with 50 others a game", "", 0.25
    ),
    Figure("traffic_overhead_200", "the same with 200 others a game", "", 0.25),
    Figure("cost_256_over_64", "cost of a game-step with 256 games at once, in multiples of that with 64", "×", 1.3),
    Figure(
        "campaign_minutes",
        "five trainings of 3 million steps and all arms on two workers, extrapolated from a tenth of the steps",
        " min",
        20.0,
    ),
    Figure("assessment_seconds", "an arm of 100 episodes with traces and metrics, on one core", " s", 10.0),
    Figure("help_seconds", "harness --help", " s", 0.4),
    Figure("check_seconds", "harness check campaigns/merge.toml", " s", 1.5),
    Figure("worker_peak_mb", "most memory of a training worker", " MB", 1000.0),
    Figure("worker_growth_mb", "what it grows by over a million training steps", " MB", 20.0),
)
KEYS = tuple(figure.key for figure in FIGURES)

Measured = tuple[dict[str, float], dict[str, Any]]
"""The figures by their keys, and the raw numbers."""


@dataclass(frozen=True)
class Measurement:
    """What brings one or more figures."""

    name: str
    keys: Sequence[str]
    module: str
    function: str
    seconds: Callable[[Budget], float]
    """About how long it takes, for the time left."""

    def measure(self, budget: Budget, tell: Tell) -> Measured:
        """Measure. Raises SideFailed."""
        # Each is imported by need: what a measurement loads is in nobody else's memory.
        measure: Callable[[Budget, Tell], Measured] = getattr(import_module(f"benchmarks.{self.module}"), self.function)
        return measure(budget, tell)


def _turns(sides: int, stretches: str, budget: Budget) -> float:
    return sides * (budget.repeats * float(getattr(budget, stretches)) + 3.0)


_SHORT, _LONG = "stretch_s", "training_stretch_s"
MEASUREMENTS = (
    Measurement("commands", ("help_seconds", "check_seconds"), "commands", "waiting", lambda b: 2.0 * b.starts),
    Measurement("arena", ("arena_vs_libsumo",), "arena", "arena_vs_libsumo", partial(_turns, 2, _SHORT)),
    Measurement("traci", ("libsumo_vs_traci",), "arena", "libsumo_vs_traci", partial(_turns, 2, _SHORT)),
    Measurement("games", ("cost_256_over_64",), "arena", "cost_of_games", partial(_turns, 4, _SHORT)),
    Measurement("highway-env", ("vs_highway_env",), "rivals", "vs_highway_env", partial(_turns, 2, _SHORT)),
    Measurement(
        "traffic",
        ("traffic_overhead_50", "traffic_overhead_200"),
        "traffic",
        "traffic_overhead",
        lambda b: 60.0 + 0.1 * b.traffic_repeats * b.traffic_steps,
    ),
    Measurement("training", ("training_vs_free_env",), "training", "training_vs_free_env", partial(_turns, 2, _LONG)),
    Measurement("subprocesses", ("vs_subproc",), "training", "vs_subproc", lambda b: 60.0 + _turns(3, _LONG, b)),
    Measurement(
        "memory",
        ("worker_peak_mb", "worker_growth_mb"),
        "memory",
        "worker_memory",
        lambda b: 5.0 + (b.memory_warm_up_steps + b.memory_steps) / 10_000,
    ),
    Measurement("assessment", ("assessment_seconds",), "campaign", "assessment_seconds", lambda b: 9.0 * (b.arms + 1)),
    Measurement(
        "campaign",
        ("campaign_minutes",),
        "campaign",
        "campaign_minutes",
        lambda b: 40.0 + 1200.0 * b.campaign_share + 0.6 * b.episodes,
    ),
)


def needed_for(keys: Sequence[str]) -> list[Measurement]:
    """The measurements that bring these figures."""
    return [each for each in MEASUREMENTS if set(each.keys) & set(keys)]


def missed(values: Mapping[str, float | None], keys: Sequence[str]) -> list[str]:
    """Those of the figures whose target is not reached."""
    return [each.key for each in FIGURES if each.key in keys and each.reached(values.get(each.key)) is False]
