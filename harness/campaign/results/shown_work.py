"""What is being done, on the terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn


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


@contextmanager
def progress_bar(what: str, console: Console) -> Iterator[Callable[[int, int], None]]:
    """A progress bar on a terminal. Call what it gives with how many are done, and of how many."""
    columns = (TextColumn(what), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, disable=not console.is_terminal, transient=True) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)
