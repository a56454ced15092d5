"""`python -m benchmarks`: measure, show, keep. `python -m benchmarks table`: the kept results in Markdown.

`python -m benchmarks step`: where the time of a step goes.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from benchmarks.budget import FAST, FULL
from benchmarks.figures import KEYS, Measurement, missed, needed_for
from benchmarks.machine import machine, versions
from benchmarks.results import RESULTS, begun, read, write
from benchmarks.sides import SideFailed, Tell
from benchmarks.table import described_machine, markdown_table, terminal_table

MISSED, USERS_MISTAKE, INTERRUPTED = 1, 2, 130

app = typer.Typer(
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Exit codes: 0 done, 1 a target is missed and --strict was given, or a measurement failed, 2 your mistake, "
    "130 interrupted (what was measured is kept).",
)


def _checked(keys: list[str]) -> list[str]:
    unknown = [key for key in keys if key not in KEYS]
    if unknown:
        raise typer.BadParameter(f"there is no figure {', '.join(unknown)}; there are {', '.join(KEYS)}")
    return keys


@app.callback(invoke_without_command=True)
def measure(
    context: typer.Context,
    only: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY",
            help="Measure only this figure; may be given several times. The others stay as they are in the file, "
            "if it is of this machine and these versions.  [default: every figure]",
            show_default=False,
        ),
    ] = None,
    out: Annotated[
        Path, typer.Option(metavar="FILE", help="Where the results are kept.", show_default="benchmarks/results.json")
    ] = RESULTS,
    fast: Annotated[
        bool, typer.Option("--fast", help="See in a few minutes that everything works; the figures mean little.")
    ] = False,
    strict: Annotated[bool, typer.Option("--strict", help="Exit with 1 if a target is missed.")] = False,
) -> None:
    """Measure what the harness costs: ratios whose two sides take turns on this machine, and a few absolute figures.

    In full it takes 15 to 20 minutes. Leave the machine alone meanwhile: a core that is busy elsewhere shows in the
    figures.
    """
    if context.invoked_subcommand is not None:
        return
    console = Console()
    keys = _checked(only or list(KEYS))
    results = begun(out, machine(), versions(), fast)
    failed: list[str] = []
    budget = FAST if fast else FULL
    chosen = needed_for(keys)
    measured = [key for each in chosen for key in each.keys]
    try:
        with _bars(console) as bars:
            whole = bars.add_task("benchmarks", total=sum(each.seconds(budget) for each in chosen))
            done_s = 0.0
            for each in chosen:
                bars.update(whole, description=each.name)
                results["details"]["load_before"][each.name] = _load()
                try:
                    values, details = each.measure(budget, _teller(bars, whole, each, done_s, each.seconds(budget)))
                except (SideFailed, OSError) as error:
                    failed.append(each.name)
                    bars.console.print(f"{each.name} failed: {error}", style="red", highlight=False, markup=False)
                    values, details = {}, {"failed": str(error).strip().splitlines()[-1]}
                results |= {key: values.get(key) for key in each.keys}
                results["details"][each.name] = details
                write(out, results)
                done_s += each.seconds(budget)
                bars.update(whole, completed=done_s)
    except KeyboardInterrupt:
        console.print("Interrupted. What was measured is kept.")
        raise typer.Exit(INTERRUPTED) from None
    console.print(terminal_table(results, measured))
    console.print(described_machine(results), highlight=False, soft_wrap=True)
    console.print(f"Kept in {out}", highlight=False, soft_wrap=True)
    if failed or (strict and missed(results, measured)):
        raise typer.Exit(MISSED)


@app.command()
def table(
    file: Annotated[
        Path, typer.Argument(metavar="[FILE]", help="Results that were kept.", show_default="benchmarks/results.json")
    ] = RESULTS,
) -> None:
    """Print kept results as a table in Markdown, as docs/performance.md has it."""
    try:
        print(markdown_table(read(file)))
    except (OSError, ValueError, KeyError) as error:
        typer.echo(f"{file}: can't be read as results: {error!r}", err=True)
        raise typer.Exit(USERS_MISTAKE) from None


@app.command()
def step(
    seconds: Annotated[float, typer.Option(metavar="S", help="How long to measure.")] = 10.0,
    others: Annotated[
        int,
        typer.Option(metavar="N", min=0, help="Others that SUMO drives in each game, on the merge with longer roads."),
    ] = 0,
) -> None:
    """Print where the time of an arena's step goes, as a table in Markdown."""
    from benchmarks.step import step_table

    print(step_table(seconds, others))


def _bars(console: Console) -> Progress:
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


def _teller(bars: Progress, task: object, measurement: Measurement, before_s: float, seconds: float) -> Tell:
    def tell(share: float) -> None:
        bars.update(task, completed=before_s + share * seconds)  # type: ignore[arg-type]

    return tell


def _load() -> float | None:
    """How many processes want a core, on average over the last minute: what the figures can be trusted for."""
    return round(os.getloadavg()[0], 2) if hasattr(os, "getloadavg") else None


if __name__ == "__main__":
    app()
