"""What a command prints, and where: for people, for programs (`--json`), less (`--quiet`) or more (`--verbose`)."""

from __future__ import annotations

import io
import json
import logging
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from harness.errors import USAGE_ERROR, UsageError
from harness.version import __version__

if TYPE_CHECKING:
    from rich.console import Console

RunPath = Annotated[Path, typer.Argument(metavar="RUN", help="A run folder, such as reports/merge.")]
RunSeed = Annotated[int | None, typer.Option(help="The training seed.  [default: the first of the campaign]")]
RunEgo = Annotated[str | None, typer.Option(metavar="DRIVER", help="The campaign's ego, if no policy of it.")]
AllowCode = Annotated[
    bool,
    typer.Option(
        "--allow-code",
        help="Permit drivers that run code from a file: a program, an FMU, or a file of Stable-Baselines3. Such code "
        "can do everything that you can: use this only for files that you trust.",
    ),
]
AsJson = Annotated[
    bool, typer.Option("--json", help="Print the result as one JSON object; what else there is to say goes to stderr.")
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print only what failed.")]
Verbose = Annotated[
    bool, typer.Option("--verbose", "-v", help="Also print the lines of the run's log, harness.log, with more detail.")
]


@contextmanager
def output(as_json: bool, quiet: bool = False, verbose: bool = False) -> Iterator[Console]:
    """The console for what people read: with JSON on standard output, it is standard error.

    During the block a usage error is printed as JSON as well, if that is asked for, and `verbose` shows the run's log.
    """
    console = console_of_any_encoding(stderr=as_json, quiet=quiet)
    console.soft_wrap = not console.is_terminal  # a file is searched and compared by lines
    try:
        if quiet and verbose:
            raise UsageError.of("--quiet", "--verbose", "are opposites", "leave one of them out")
        with _log_shown(console) if verbose else nullcontext():
            yield console
    except UsageError as error:
        if as_json:
            print_json({"exit_code": USAGE_ERROR, "problems": [asdict(problem) for problem in error.problems]})
        raise


def console_of_any_encoding(stderr: bool = False, quiet: bool = False) -> Console:
    """A console that replaces what the terminal has no character for, as standard error does by itself."""
    from rich.console import Console

    if not stderr and isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")
    return Console(stderr=stderr, quiet=quiet)


def print_plain(lines: Iterable[str], console: Console, style: str | None = None) -> None:
    """Print lines as they are: without markup, highlights or line breaks."""
    for line in lines:
        console.print(line, style=style, highlight=False, markup=False, soft_wrap=True)


def say_unchecked(run: Path, console: Console) -> None:
    """Say that a run folder has no checksums, if it has none."""
    from harness.campaign.storage.run_folder import RunFolder

    if RunFolder(run).is_published:
        print_plain([f"{run}: has no checksums, as published; whether its files were changed is not known"], console)


def print_version(wanted: bool) -> None:
    """Print the version of the package and end the command."""
    if wanted:
        print(f"harness {__version__}")
        raise typer.Exit


def print_json(content: Any) -> None:
    """Print JSON to standard output. A number that JSON can't write is a null already."""
    print(json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False))


@contextmanager
def _log_shown(console: Console) -> Iterator[None]:
    """Print what is logged of a run, with details, above the bars of a console."""
    from harness.campaign.storage.run_log import LOGGER, RunLogFormatter, logged_to

    class Shown(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            print_plain([self.format(record)], console, "dim")

    handler = Shown()
    handler.setFormatter(RunLogFormatter())
    with logged_to(handler, LOGGER, logging.DEBUG):
        yield
