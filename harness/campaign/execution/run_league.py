"""Running a league: one campaign after the other, then its table and page.

The results of a campaign are written by a thread while the workers play the next one.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from concurrent.futures import Future, wait
from pathlib import Path
from threading import Thread

from rich.console import Console

from harness.campaign.execution.run_campaign import play_campaign
from harness.campaign.execution.run_stages import StartWorkers
from harness.campaign.preflight import OpenCampaign
from harness.campaign.results.kept_results import RunResult
from harness.campaign.results.league_table import LeagueResult, write_league
from harness.campaign.results.shown_work import doing
from harness.campaign.storage.run_folder import RunFolder
from harness.reports.numbers import duration


def play_league(
    ego: str, campaigns: Sequence[OpenCampaign], folder: Path, start_workers: StartWorkers, console: Console
) -> LeagueResult:
    """Carry out what is left of the campaigns of a league, and write its results. `ego` is its name.

    Raises as `run_campaign` does. What fails in a campaign is in the result: the others are played.
    """
    written, start_s = dict[str, Future[RunResult]](), time.monotonic()
    for number, campaign in enumerate(campaigns):
        name, left = campaign.document.name, ""
        if number:
            left_s = (time.monotonic() - start_s) / number * (len(campaigns) - number)
            left = f", about {duration(left_s)} left"
        console.print(f"{name}: campaign {number + 1} of {len(campaigns)}{left}", style="bold", highlight=False)
        kept = play_campaign(campaign, RunFolder(folder / name), start_workers, console)
        written[name] = _written(RunFolder(folder / name), kept, after=list(written.values()))
    with doing(console, "writing the reports"):
        results = {name: each.result() for name, each in written.items()}
    return write_league(ego, folder, results)


def _written(run: RunFolder, kept: RunResult | None, after: Sequence[Future[RunResult]]) -> Future[RunResult]:
    """The results of a run, unless they are kept, written by a thread after those of other runs: Matplotlib draws in
    one thread at a time. A command that is interrupted does not wait for it."""
    future = Future[RunResult]()

    def write() -> None:
        from harness.campaign.results.results import write_results  # imports pandas and statistics

        wait(after)
        try:
            with run.held():
                future.set_result(write_results(run, Console(quiet=True)))
        except BaseException as error:
            future.set_exception(error)

    if kept is None:
        Thread(target=write, daemon=True).start()
    else:
        future.set_result(kept)
    return future
