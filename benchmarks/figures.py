"""The figures: key, meaning, unit and target of each, and the measurement that produces it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from typing import Any

from benchmarks.budget import Budget
from benchmarks.sides import OnProgress


@dataclass(frozen=True, kw_only=True)
class Figure:
    """One number of the results."""

    key: str
    meaning: str
    unit: str = ""
    target: float | None = None
    at_least: bool = False
    """Whether the target is a lower bound; otherwise it is an upper bound."""

    def reached(self, value: float | None) -> bool | None:
        """Whether the value reaches the target: None without a target, False for a figure that was not measured."""
        if self.target is None:
            return None
        return value is not None and (value >= self.target if self.at_least else value <= self.target)

    def format_value(self, value: float | None) -> str:
        """The value with its unit."""
        if value is None:
            return "not measured"
        digits = 2 if abs(value) < 10 else 1 if abs(value) < 100 else 0
        return f"{value:.{digits}f}{self.unit}"

    def format_target(self) -> str:
        """The target with its unit."""
        if self.target is None:
            return "reported"
        return f"{'≥' if self.at_least else '≤'} {self.target:g}{self.unit}"


FIGURES = (
    Figure(
        key="arena_vs_libsumo",
        meaning="game-steps/s of an arena (64 games, two learners, everything included), as a share of a bare "
        "libsumo loop's",
        target=0.60,
        at_least=True,
    ),
    Figure(
        key="arena_vs_libsumo_junction",
        meaning="the same at a crossing with traffic lights, where the players' ways cross",
        target=0.50,
        at_least=True,
    ),
    Figure(
        key="training_vs_sb3",
        meaning="training steps/s, in multiples of those with Stable-Baselines3's own learner",
        unit="×",
        target=1.8,
        at_least=True,
    ),
    Figure(
        key="update_vs_sb3",
        meaning="gradient steps/s of the learner, in multiples of Stable-Baselines3's own",
        unit="×",
        target=3.5,
        at_least=True,
    ),
    Figure(
        key="training_vs_free_env",
        meaning="training steps/s on the arena, as a share of those on an environment that costs nothing",
    ),
    Figure(
        key="vs_highway_env",
        meaning="game-steps/s of one process, in multiples of highway-env's merge",
        unit="×",
        target=300.0,
        at_least=True,
    ),
    Figure(
        key="vs_subproc",
        meaning="training steps/s, in multiples of SubprocVecEnv's on all cores",
        unit="×",
        target=5.0,
        at_least=True,
    ),
    Figure(
        key="libsumo_vs_traci",
        meaning="steps/s of one game in libsumo, in multiples of TraCI's over a socket",
        unit="×",
    ),
    Figure(
        key="traffic_overhead_50",
        meaning="what the harness adds to SUMO's step, as a share of it, with 50 background vehicles per game",
        target=0.25,
    ),
    Figure(key="traffic_overhead_200", meaning="the same with 200 background vehicles per game", target=0.25),
    Figure(
        key="cost_256_over_64",
        meaning="cost of a game-step with 256 games at once, in multiples of that with 64",
        unit="×",
        target=1.3,
    ),
    Figure(
        key="campaign_minutes",
        meaning="five trainings of 3 million steps and all arms on two workers, extrapolated from a tenth of the steps",
        unit=" min",
        target=9.0,
    ),
    Figure(
        key="ray_two_nodes",
        meaning="wall time of a small campaign on two local Ray nodes of one core, in multiples of that on two workers",
        unit="×",
        target=1.15,
    ),
    Figure(
        key="assessment_seconds",
        meaning="an arm of 100 episodes with traces and metrics, on one core",
        unit=" s",
        target=10.0,
    ),
    Figure(key="help_seconds", meaning="harness --help", unit=" s", target=0.4),
    Figure(key="check_seconds", meaning="harness check campaigns/merge.toml", unit=" s", target=1.5),
    Figure(
        key="first_line_seconds",
        meaning="harness campaign, from its start to the first text on the terminal",
        unit=" s",
        target=1.0,
    ),
    Figure(key="resume_seconds", meaning="a finished campaign of 100 arms, run again", unit=" s", target=3.0),
    Figure(key="report_100_arms_seconds", meaning="harness report of 100 arms of 20 episodes", unit=" s", target=90.0),
    Figure(key="worker_peak_mb", meaning="peak memory of a training worker", unit=" MB", target=1000.0),
    Figure(
        key="worker_growth_mb",
        meaning="growth of its memory over a million training steps",
        unit=" MB",
        target=20.0,
    ),
)
KEYS = tuple(figure.key for figure in FIGURES)

Measured = tuple[dict[str, float], dict[str, Any]]
"""The figures by key, and the raw numbers."""


@dataclass(frozen=True, kw_only=True)
class Measurement:
    """A function that measures one or more figures."""

    name: str
    keys: Sequence[str]
    """The figures it measures."""
    module: str
    function: str
    seconds: Callable[[Budget], float]
    """About how long it takes, for the progress bar."""

    def measure(self, budget: Budget, on_progress: OnProgress) -> Measured:
        """Measure. Raises SideFailed."""
        # Imported here: the modules of one measurement must not be in the memory of another.
        function = getattr(import_module(f"benchmarks.{self.module}"), self.function)
        measured: Measured = function(budget, on_progress)
        return measured


def _seconds_of_turns(sides: int, lap_s_of: Callable[[Budget], float], budget: Budget) -> float:
    return sides * (budget.repeats * lap_s_of(budget) + 3.0)


def _lap_s(budget: Budget) -> float:
    return budget.lap_s


def _training_lap_s(budget: Budget) -> float:
    return budget.training_lap_s


MEASUREMENTS = (
    Measurement(
        name="commands",
        keys=("help_seconds", "check_seconds"),
        module="commands",
        function="command_seconds",
        seconds=lambda budget: 2.0 * budget.starts,
    ),
    Measurement(
        name="first line",
        keys=("first_line_seconds",),
        module="commands",
        function="first_line_seconds",
        seconds=lambda budget: 1.0 * budget.starts,
    ),
    Measurement(
        name="many arms",
        keys=("resume_seconds", "report_100_arms_seconds"),
        module="commands",
        function="many_arms_seconds",
        seconds=lambda budget: 20.0 + 10.0 * budget.seeds * budget.personas,
    ),
    Measurement(
        name="arena",
        keys=("arena_vs_libsumo",),
        module="arena",
        function="arena_vs_libsumo",
        seconds=partial(_seconds_of_turns, 2, _lap_s),
    ),
    Measurement(
        name="arena at a junction",
        keys=("arena_vs_libsumo_junction",),
        module="arena",
        function="arena_vs_libsumo_junction",
        seconds=partial(_seconds_of_turns, 2, _lap_s),
    ),
    Measurement(
        name="traci",
        keys=("libsumo_vs_traci",),
        module="arena",
        function="libsumo_vs_traci",
        seconds=partial(_seconds_of_turns, 2, _lap_s),
    ),
    Measurement(
        name="games",
        keys=("cost_256_over_64",),
        module="arena",
        function="cost_of_games",
        seconds=partial(_seconds_of_turns, 4, _lap_s),
    ),
    Measurement(
        name="highway-env",
        keys=("vs_highway_env",),
        module="highway_env_merge",
        function="vs_highway_env",
        seconds=partial(_seconds_of_turns, 2, _lap_s),
    ),
    Measurement(
        name="traffic",
        keys=("traffic_overhead_50", "traffic_overhead_200"),
        module="traffic",
        function="traffic_overhead",
        seconds=lambda budget: 60.0 + 0.1 * budget.traffic_repeats * budget.traffic_steps,
    ),
    Measurement(
        name="training",
        keys=("training_vs_free_env",),
        module="training",
        function="training_vs_free_env",
        seconds=partial(_seconds_of_turns, 2, _training_lap_s),
    ),
    Measurement(
        name="learner",
        keys=("training_vs_sb3",),
        module="training",
        function="training_vs_sb3",
        seconds=partial(_seconds_of_turns, 2, _training_lap_s),
    ),
    Measurement(
        name="update",
        keys=("update_vs_sb3",),
        module="training",
        function="update_vs_sb3",
        seconds=partial(_seconds_of_turns, 2, _lap_s),
    ),
    Measurement(
        name="subprocesses",
        keys=("vs_subproc",),
        module="training",
        function="vs_subproc",
        seconds=lambda budget: 60.0 + _seconds_of_turns(3, _training_lap_s, budget),
    ),
    Measurement(
        name="memory",
        keys=("worker_peak_mb", "worker_growth_mb"),
        module="memory",
        function="worker_memory",
        seconds=lambda budget: 5.0 + (budget.memory_warm_up_steps + budget.memory_steps) / 10_000,
    ),
    Measurement(
        name="assessment",
        keys=("assessment_seconds",),
        module="campaign",
        function="assessment_seconds",
        seconds=lambda budget: 9.0 * (budget.arms + 1),
    ),
    Measurement(
        name="campaign",
        keys=("campaign_minutes",),
        module="campaign",
        function="campaign_minutes",
        seconds=lambda budget: 40.0 + 600.0 * budget.campaign_share + 0.6 * budget.episodes,
    ),
    Measurement(
        name="ray",
        keys=("ray_two_nodes",),
        module="ray_nodes",
        function="ray_two_nodes",
        seconds=lambda budget: 40.0 + budget.ray_steps / 1_500 + 2.0 * budget.ray_episodes,
    ),
)


def measurements_of(keys: Sequence[str]) -> list[Measurement]:
    """The measurements that produce these figures."""
    return [measurement for measurement in MEASUREMENTS if set(measurement.keys) & set(keys)]


def missed(values: Mapping[str, float | None], keys: Sequence[str]) -> list[str]:
    """The keys, among these, of the figures that miss their target."""
    return [figure.key for figure in FIGURES if figure.key in keys and figure.reached(values.get(figure.key)) is False]
