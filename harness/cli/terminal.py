"""What commands print as it is."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import typer

from harness.version import __version__

if TYPE_CHECKING:
    from rich.console import Console


def print_plain(lines: Iterable[str], console: Console) -> None:
    """Print lines as they are: without markup, colours or line breaks."""
    for line in lines:
        console.print(line, highlight=False, markup=False, soft_wrap=True)


def print_version(wanted: bool) -> None:
    """Print the version of the package and end the command."""
    if wanted:
        print(f"harness {__version__}")
        raise typer.Exit
