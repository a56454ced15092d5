"""What the commands `campaign` and `report` say of a run that has ended, and with which exit code."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from harness.cli.output import print_json, print_plain

if TYPE_CHECKING:
    from rich.console import Console

    from harness.campaign.results.kept_results import RunResult

_STYLES = {"harm": "bold red", "mended": "bold green", "open": "bold yellow"}


def end_with(outcome: RunResult, run: Path, console: Console, as_json: bool = False) -> None:
    """Say what has come out, and end the command with the exit code of the run.

    What failed is said also where the console is quiet. As JSON: the content of `result.json`, the run folder and the
    report.
    """
    did_not_learn = [f"Did not learn: {training}" for training in outcome.did_not_learn]
    print_plain(did_not_learn, console, "bold yellow")
    for verdict in outcome.verdicts:
        label = f"{verdict.persona}, {verdict.question}: {verdict.label}"
        console.print(label, style=_STYLES[verdict.tone], highlight=False, markup=False)
        for sentence in filter(None, (verdict.sentence, *verdict.causes, verdict.speed)):
            console.print(f"  {sentence}", highlight=False, markup=False)
    for bound in outcome.acceptance:
        print_plain([bound.text], console, "green" if bound.passed else "bold red")
    print_plain([f"Report: {run / 'report.html'}"], console)
    if as_json:
        from harness.campaign.results.ci_files import RESULT

        result = json.loads((run / RESULT).read_text(encoding="utf-8"))
        print_json({"run": str(run), "report": str(run / "report.html"), **result})
    if console.quiet:
        console.quiet = False
        print_plain(did_not_learn, console)
        print_plain((bound.text for bound in outcome.acceptance if not bound.passed), console)
    if outcome.failed_stages:
        print_plain([f"Not finished: {', '.join(outcome.failed_stages)}"], console, "red")
    if outcome.error_games:
        count = f"{outcome.error_games} games could not be played; their pairs are left out"
        print_plain([count, *(f"  {each}" for each in outcome.error_reasons)], console, "red")
    if outcome.exit_code:
        raise typer.Exit(outcome.exit_code)
