"""`harness compare`: did a change make the ego better?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from harness.cli.terminal import print_plain

STYLES = {"harm": "red", "mended": "green", "open": "default"}


def compare(
    before: Annotated[
        Path, typer.Argument(metavar="BEFORE", help="The run folder before the change.", show_default=False)
    ],
    after: Annotated[
        Path, typer.Argument(metavar="AFTER", help="The run folder after the change.", show_default=False)
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="The page.  [default: compare.html in the second folder]", show_default=False
        ),
    ] = None,
) -> None:
    """Compare two runs, game by game: failures, near misses and average speed of every arm that both have."""
    from rich.console import Console

    from harness.campaign.results.compare_runs import compare_runs

    console = Console()
    found = compare_runs(before, after, out or after / "compare.html")
    for row in found.rows:
        text = f"{row.sentence}, seed {row.seed}"
        console.print(text, style=STYLES[row.tone], highlight=False, markup=False, soft_wrap=True)
    print_plain([found.headline, f"Comparison: {found.page}"], console)
