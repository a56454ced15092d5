"""The command line. Each command imports the heavy modules that it needs, so that help is fast."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from errno import EACCES, EMFILE, ENOMEM, EPERM
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from harness.cli import messages
from harness.cli.documents import campaign_at, check, check_driver, columns, new, persona_app, policy_app, schema
from harness.cli.falsifying import falsify
from harness.cli.league import league, league_table
from harness.cli.output import (
    AllowCode,
    AsJson,
    Quiet,
    RunPath,
    Verbose,
    output,
    print_json,
    print_plain,
    print_version,
)
from harness.cli.pinning import minimise, regression
from harness.cli.runs import compare, export, realism, replay, runs, serve
from harness.cli.scenes import scene_app
from harness.errors import (
    FAILED,
    LEARNERS,
    NOT_ACCEPTED,
    USAGE_ERROR,
    HarnessError,
    UsageError,
    address_space_bytes,
    is_of_disk,
    is_of_memory,
    of_system,
    short_of_memory,
    without_learners,
)

if TYPE_CHECKING:
    from rich.console import Console

    from harness.campaign.execution.run_stages import StartWorkers
    from harness.campaign.results.kept_results import RunResult

_REFUSALS = (EACCES, EPERM, EMFILE, ENOMEM)
"""Errors of the operating system that are no mistakes of the program, as those of the disk: they are reported without a
traceback."""
_ADDRESS_SPACE_BYTES = 2.5e9  # libraries reserve 2.0 GB, and abort or hang where they get less

app = typer.Typer(
    name="harness",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"]},
    help="""Test an automated vehicle against selfish human drivers in SUMO.

A campaign trains a naive ego, trains a non-ego with a human persona against it, retrains the ego against the non-ego,
and reports the differences with paired statistics.

`harness demo` plays such a campaign with trained policies; `harness new FOLDER` makes one of your own.
""",
    epilog="Exit codes: 0 success; 1 some games or stages failed; 2 usage error; 3 a bound of [acceptance] is not "
    "kept; 130 interrupted; 143 terminated. Finished work is kept in every case.",
)

CampaignFile = Annotated[
    Path, typer.Argument(metavar="FILE", help="The TOML file of the campaign, or the name of a shipped campaign.")
]
QuickRun = Annotated[
    bool,
    typer.Option(
        "--quick",
        help="Run the same stages with fewer training steps: about 3 minutes on two cores. Not for conclusions.",
    ),
]
RunOut = Annotated[
    Path | None, typer.Option(metavar="DIR", help="The run folder.  [default: reports/NAME, or reports/NAME-quick]")
]
KeepGoing = Annotated[
    bool,
    typer.Option(
        "--keep-going", help="Play all games of an arm, even if its first ten can't be played for one reason."
    ),
]
Jobs = Annotated[
    int | None,
    typer.Option(min=1, metavar="N", help="Number of processes that carry out stages.  [default: one per core]"),
]

Ray = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="Run the stages on a Ray cluster: **local** (started on this machine for the run), **auto** (the one that "
        "runs on this machine) or HOST:PORT. docs/scaling.md describes it.  [default: processes of this machine]",
    ),
]


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", is_eager=True, callback=print_version, help="Print the version and exit.")
    ] = False,
) -> None:
    pass


@app.command()
def campaign(
    file: CampaignFile,
    quick: QuickRun = False,
    out: RunOut = None,
    jobs: Jobs = None,
    allow_code: AllowCode = False,
    keep_going: KeepGoing = False,
    ray: Ray = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Run a campaign: train, assess, retrain and compare.

    Run the command again to continue an interrupted campaign; finished stages are skipped. The run folder contains CSV
    tables, report.html, trained policies, traces, replays for SUMO-GUI, and harness.log.
    """
    with output(as_json, quiet, verbose) as console:
        _check_address_space()
        file = campaign_at(file)
        with console.status(messages.reading(file)):  # shown before what takes time to import
            from harness.campaign.execution.run_campaign import run_campaign
            from harness.campaign.preflight import open_campaign
            from harness.campaign.storage.run_folder import RunFolder

            if ray is not None:  # the nodes of a cluster know no working folder
                file, out = file.absolute(), out.absolute() if out is not None else None
            opened = open_campaign(file, quick, allow_code)
        folder = RunFolder(out or Path("reports") / opened.run_name)
        if quick and not opened.quick:
            console.print(messages.NOTHING_TO_SHORTEN)
        with _started_on(ray, jobs, lambda line: print_plain([line], console)) as start_workers:
            outcome = run_campaign(opened, folder, start_workers, console, keep_going=keep_going)
        _end_with(outcome, folder.path, console, as_json)


@app.command()
def demo(
    out: RunOut = None, jobs: Jobs = None, as_json: AsJson = False, quiet: Quiet = False, verbose: Verbose = False
) -> None:
    """Play the paper's campaign with the shipped policies, in a few minutes: the campaign demo.

    Bounds that are not kept are shown, but do not change the exit code.
    """
    try:
        campaign(Path("demo"), out=out, jobs=jobs, as_json=as_json, quiet=quiet, verbose=verbose)
    except typer.Exit as ended:
        if ended.exit_code != NOT_ACCEPTED:
            raise


@app.command()
def report(run: RunPath, as_json: AsJson = False, quiet: Quiet = False, verbose: Verbose = False) -> None:
    """Write the tables, replays and report.html of a run again, from its folder alone."""
    with output(as_json, quiet, verbose) as console:
        _check_address_space()
        from harness.campaign.results.results import write_results
        from harness.campaign.storage.run_folder import RunFolder

        folder = RunFolder(run)
        folder.manifest()
        with folder.held():
            outcome = write_results(folder, console)
        _end_with(outcome, run, console, as_json)


_OF_RUNS = (replay, export, runs, serve, compare, realism, minimise, falsify)
for command in (league, league_table, *_OF_RUNS, new, check, check_driver, regression, schema, columns):
    app.command()(command)
for name, group in (("persona", persona_app), ("policy", policy_app), ("scene", scene_app)):
    app.add_typer(group, name=name)


@contextmanager
def _started_on(ray: str | None, jobs: int | None, warn: Callable[[str], None]) -> Iterator[StartWorkers]:
    """What carries stages out: processes of this machine, or a Ray cluster, which is connected during the block.

    Raises UsageError where there is no such cluster.
    """
    from harness.campaign.execution.worker_pool import WorkerPool

    if ray is None:
        yield partial(WorkerPool, jobs=jobs)
        return
    from harness.campaign.execution.ray_workers import RayWorkers, ray_cluster

    with ray_cluster(ray, jobs) as cluster:
        yield partial(RayWorkers, ray=cluster, jobs=jobs, warn=warn)


def _end_with(outcome: RunResult, run: Path, console: Console, as_json: bool) -> None:
    """Say what has come out, and end the command with the exit code of the run.

    What failed is said also where the console is quiet. As JSON: the content of `result.json`, the run folder and the
    report.
    """
    for line in outcome.lines:
        console.print(line.text, style=line.style or None, highlight=False, markup=False)
    print_plain([f"Report: {run / 'report.html'}"], console)
    if as_json:
        from harness.campaign.results.ci_files import RESULT

        result = json.loads((run / RESULT).read_text(encoding="utf-8"))
        print_json({"run": str(run), "report": str(run / "report.html"), **result})
    if console.quiet:
        console.quiet = False
        print_plain((line.text for line in outcome.lines if line.is_failure), console)
    if outcome.failed_stages:
        reasons = dict.fromkeys(filter(None, outcome.failed_stages.values()))
        stages = f"Not finished: {', '.join(outcome.failed_stages)}"
        print_plain([stages, *(f"  {reason}" for reason in reasons)], console, "red")
    if outcome.error_games:
        count = f"{outcome.error_games} games could not be played; their pairs are left out"
        print_plain([count, *(f"  {each}" for each in outcome.error_reasons)], console, "red")
    if outcome.exit_code:
        raise typer.Exit(outcome.exit_code)


def _check_address_space() -> None:
    """Raise UsageError for a limit with which libraries abort this process when it writes the results."""
    limit_bytes = address_space_bytes()
    if limit_bytes < _ADDRESS_SPACE_BYTES:
        message = "is too little address space: the command needs 2.5 GB, workers that train need 4 GB"
        raise UsageError.of(
            "ulimit -v", f"{limit_bytes // 1024:.0f} kB", message, "raise the limit: ulimit -v unlimited"
        )


def _fail(message: str, code: int) -> NoReturn:
    print(message, file=sys.stderr)
    raise SystemExit(code)


def run() -> None:
    """Carry out the command of the arguments. Usage errors are printed without a traceback."""
    try:
        app()
    except UsageError as error:
        _fail("\n".join(str(problem) for problem in error.problems), USAGE_ERROR)
    except HarnessError as error:
        _fail(f"{type(error).__name__}: {error}", FAILED)
    except Exception as error:
        if isinstance(error, ModuleNotFoundError) and error.name in LEARNERS:
            _fail(str(without_learners(f"harness {' '.join(sys.argv[1:])}")), USAGE_ERROR)
        if is_of_memory(error):
            _fail(f"{short_of_memory(error)}; finished work is kept", FAILED)
        if not isinstance(error, OSError) or not (is_of_disk(error) or error.errno in _REFUSALS):
            raise
        _fail(f"{of_system(error)}; finished work is kept", FAILED)
