"""What the commands `campaign` and `report` say of a run that has ended, and with which exit code."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from harness.cli import wording
from harness.cli.output import print_json
from harness.cli.terminal import print_plain

if TYPE_CHECKING:
    from rich.console import Console

    from harness.campaign.results.kept_results import RunResult

_STYLES = {"harm": "red", "mended": "green", "open": "yellow"}


def show_result(outcome: RunResult, run: Path, console: Console, as_json: bool = False) -> None:
    """Say what has come out. As JSON: the content of `result.json`, the run folder and the report."""
    for training in outcome.did_not_learn:
        console.print(wording.did_not_learn(training), style="bold yellow", highlight=False, markup=False)
    for verdict in outcome.verdicts:
        label = f"{verdict.persona}, {verdict.question}: {verdict.label}"
        console.print(label, style=f"bold {_STYLES[verdict.tone]}", highlight=False, markup=False)
        for sentence in (verdict.sentence, *verdict.causes, verdict.speed):
            if sentence:
                console.print(f"  {sentence}", highlight=False, markup=False)
    for bound in outcome.acceptance:
        style = "green" if bound.passed else "bold red"
        console.print(bound.text, style=style, highlight=False, markup=False, soft_wrap=True)
    print_plain([wording.report_written(run)], console)
    if as_json:
        from harness.campaign.results.acceptance import RESULT

        result = json.loads((run / RESULT).read_text(encoding="utf-8"))
        print_json({"run": str(run), "report": str(run / "report.html"), **result})


def exit_as(outcome: RunResult, console: Console) -> None:
    """Say what failed, also where the console is quiet, and end the command with the exit code of the run."""
    if console.quiet:
        console.quiet = False
        print_plain(map(wording.did_not_learn, outcome.did_not_learn), console)
        print_plain((bound.text for bound in outcome.acceptance if not bound.passed), console)
    if outcome.failed_stages:
        console.print(wording.failed_stages(outcome.failed_stages), style="red", highlight=False)
    if outcome.error_games:
        for line in wording.error_games(outcome.error_games, outcome.error_reasons):
            console.print(line, style="red", highlight=False, markup=False, soft_wrap=True)
    if outcome.exit_code:
        raise typer.Exit(outcome.exit_code)
