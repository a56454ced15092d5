"""What is being done, on the terminal."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console


@contextmanager
def doing(console: Console, what: str) -> Iterator[None]:
    """Show what is being done: as long as it takes on a terminal, as a line elsewhere."""
    say(console, what)
    with console.status(what):
        yield


def say(console: Console, what: str) -> None:
    """A line where the output is not a terminal, as `StageProgress` prints it for stages."""
    if not console.is_terminal:
        console.print(f"results  {what}", highlight=False, markup=False)
