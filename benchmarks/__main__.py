"""`python -m benchmarks`: measure, print and store. `python -m benchmarks table`: the stored results in Markdown.

`python -m benchmarks step` and `training`: where the time of a step and of a training goes. `python -m benchmarks
reads`: the cost of reading vehicles. `python -m benchmarks assessment`: games alone and side by side. `python -m
benchmarks scale`: what a large study would take.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from subprocess import SubprocessError
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from benchmarks.budget import FAST, FULL, Budget
from benchmarks.figures import KEYS, Measurement, measurements_of, missed
from benchmarks.machine import machine, versions
from benchmarks.results import RESULTS, read, results_to_extend, write
from benchmarks.sides import OnProgress, SideFailed
from benchmarks.table import described_machine, markdown_table, terminal_table

MISSED, USERS_MISTAKE, INTERRUPTED = 1, 2, 130

app = typer.Typer(
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Exit codes: 0 done, 1 a measurement failed, or a target is missed and --strict was given, 2 wrong "
    "arguments, 130 interrupted (finished measurements are stored).",
)


def _check_keys(keys: list[str]) -> list[str]:
    unknown = [key for key in keys if key not in KEYS]
    if unknown:
        raise typer.BadParameter(f"unknown figure {', '.join(unknown)}; the figures are {', '.join(KEYS)}")
    return keys


@app.callback(invoke_without_command=True)
def measure(
    context: typer.Context,
    only: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY",
            help="Measure only this figure; may be given several times. The others stay as they are in the file "
            "if the file is of this machine and these versions.  [default: every figure]",
            show_default=False,
        ),
    ] = None,
    out: Annotated[
        Path, typer.Option(metavar="FILE", help="The file for the results.", show_default="benchmarks/results.json")
    ] = RESULTS,
    fast: Annotated[
        bool, typer.Option("--fast", help="Only check that everything works, in a few minutes; figures mean little.")
    ] = False,
    strict: Annotated[bool, typer.Option("--strict", help="Exit with 1 if a target is missed.")] = False,
) -> None:
    """Measure the cost of the harness: ratios of two sides that take turns on this machine, and some absolute figures.

    A full run takes 15 to 20 minutes. Do not use the machine meanwhile: other work on its cores changes the figures.
    """
    if context.invoked_subcommand is not None:
        return
    console = Console()
    measurements = measurements_of(_check_keys(only or list(KEYS)))
    keys = [key for measurement in measurements for key in measurement.keys]
    results = results_to_extend(out, machine(), versions(), fast)
    try:
        failed = _measure_all(measurements, FAST if fast else FULL, results, out, console)
    except KeyboardInterrupt:
        console.print("Interrupted. Finished measurements are stored.")
        raise typer.Exit(INTERRUPTED) from None
    console.print(terminal_table(results, keys))
    console.print(described_machine(results), highlight=False, soft_wrap=True)
    console.print(f"Stored in {out}", highlight=False, soft_wrap=True)
    if failed or (strict and missed(results, keys)):
        raise typer.Exit(MISSED)


@app.command()
def table(
    file: Annotated[
        Path, typer.Argument(metavar="[FILE]", help="Stored results.", show_default="benchmarks/results.json")
    ] = RESULTS,
) -> None:
    """Print stored results as a table in Markdown, as in docs/performance.md."""
    try:
        print(markdown_table(read(file)))
    except (OSError, ValueError, KeyError) as error:
        typer.echo(f"{file}: can't be read as results: {error!r}", err=True)
        raise typer.Exit(USERS_MISTAKE) from None


@app.command()
def scale(
    file: Annotated[
        Path, typer.Argument(metavar="[FILE]", help="Stored results.", show_default="benchmarks/results.json")
    ] = RESULTS,
) -> None:
    """Print what a study of many campaigns would take on 2, 64 and 1,024 cores, by the times of stored results."""
    from benchmarks import scale

    try:
        print(scale.scale_text(read(file)))
    except (OSError, ValueError, KeyError) as error:
        typer.echo(f"{file}: can't be read as results with a campaign: {error!r}", err=True)
        raise typer.Exit(USERS_MISTAKE) from None


@app.command()
def step(
    seconds: Annotated[float, typer.Option(metavar="S", help="How long to measure.")] = 10.0,
    background: Annotated[
        int,
        typer.Option(metavar="N", min=0, help="Background vehicles per game, on the merge with longer roads."),
    ] = 0,
) -> None:
    """Print where the time of an arena's step goes, as a table in Markdown."""
    from benchmarks.step import step_table

    print(step_table(seconds, background))


@app.command()
def training(
    seconds: Annotated[float, typer.Option(metavar="S", help="How long to measure.")] = 20.0,
) -> None:
    """Print where the time of a training goes, as a table in Markdown."""
    from benchmarks.training_parts import training_table

    print(training_table(seconds))


@app.command()
def assessment() -> None:
    """Print how many games an assessment plays per second of processor time, alone and side by side, in Markdown."""
    from benchmarks.assessment import assessment_table

    print(assessment_table())


@app.command()
def reads(
    laps: Annotated[int, typer.Option(metavar="N", min=1, help="How often to measure each way of reading.")] = 8,
) -> None:
    """Print what it costs to read background vehicles out of SUMO, by each way that libsumo offers, in Markdown."""
    from benchmarks.reads import reads_table

    print(reads_table(laps))


@app.command()
def maps(
    folders: Annotated[list[Path], typer.Argument(metavar="FOLDER...", exists=True, file_okay=False)],
) -> None:
    """Print what `harness scene new` makes of the maps below folders, in Markdown: a scene that a rule-based driver can
    drive, or the reason for which it refuses the map."""
    from benchmarks.maps import maps_table

    for line in maps_table(folders):
        print(line, flush=True)


def _measure_all(
    measurements: Sequence[Measurement], budget: Budget, results: dict[str, Any], out: Path, console: Console
) -> list[str]:
    """Measure into `results`, which are stored after each measurement. Returns the names of those that failed."""
    failed: list[str] = []
    with _progress_bars(console) as bars:
        task = bars.add_task("benchmarks", total=sum(measurement.seconds(budget) for measurement in measurements))
        done_s = 0.0
        for measurement in measurements:
            seconds = measurement.seconds(budget)
            bars.update(task, description=measurement.name)
            results["details"]["load_before"][measurement.name] = _load_average()
            try:
                on_progress = _bar_updater(bars, task, done_s, seconds)
                values, details = measurement.measure(budget, on_progress)
                results |= {key: values[key] for key in measurement.keys}
            except (SideFailed, OSError, SubprocessError) as error:
                failed.append(measurement.name)
                message = f"{measurement.name} failed: {error}"
                bars.console.print(message, style="red", highlight=False, markup=False)
                results |= dict.fromkeys(measurement.keys)
                details = {"failed": str(error).strip().splitlines()[-1]}
            results["details"][measurement.name] = details
            write(out, results)
            done_s += seconds
            bars.update(task, completed=done_s)
    return failed


def _progress_bars(console: Console) -> Progress:
    columns = (TextColumn("{task.description:<13}"), BarColumn(), TextColumn("{task.percentage:>3.0f} %"))
    return Progress(
        *columns,
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        console=console,
        transient=True,
        disable=not console.is_terminal,
        speed_estimate_period=120.0,
    )


def _bar_updater(bars: Progress, task: TaskID, before_s: float, seconds: float) -> OnProgress:
    def update(share: float) -> None:
        bars.update(task, completed=before_s + share * seconds)

    return update


def _load_average() -> float | None:
    """Processes that want a core, averaged over the last minute: a high load makes the figures unreliable."""
    return round(os.getloadavg()[0], 2) if hasattr(os, "getloadavg") else None


if __name__ == "__main__":
    app()
