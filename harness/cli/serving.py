"""`harness serve`: the report of a run in the browser, with every recorded game."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from harness.cli import wording


def serve(
    run: Annotated[
        Path, typer.Argument(metavar="RUN", help="A run folder, such as reports/merge.", show_default=False)
    ],
    port: Annotated[int, typer.Option(min=0, max=65535, help="The port; 0 takes a free one.")] = 8000,
    open_browser: Annotated[bool, typer.Option("--open", help="Open the page in the default browser.")] = False,
) -> None:
    """Show the report of a run with all of its recorded games, also those that its file has no room for.

    The page is at http://127.0.0.1:8000 for this machine alone, until Ctrl-C.
    """
    import webbrowser

    from rich.console import Console

    from harness.campaign.results.served_report import ServedReport, server_of
    from harness.campaign.storage.run_folder import RunFolder
    from harness.errors import UsageError

    console = Console()
    with console.status(wording.reading(run)):
        report = ServedReport(RunFolder(run))
    try:
        server = server_of(report, port)
    except OSError as error:
        reason = error.strerror or str(error)
        raise UsageError.of("--port", str(port), f"can't be opened: {reason}", "another port, or 0") from error
    with server:
        address = f"http://127.0.0.1:{server.server_port}/"
        console.print(wording.serving(address), highlight=False, soft_wrap=True)
        if open_browser:
            webbrowser.open(address)
        server.serve_forever()
