"""Running a league: one campaign after the other, then its table and page."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from harness.campaign.execution.run_campaign import run_campaign
from harness.campaign.execution.run_stages import StartWorkers
from harness.campaign.preflight import OpenCampaign
from harness.campaign.results.kept_results import RunResult
from harness.campaign.results.league_table import LeagueResult, write_league
from harness.campaign.storage.run_folder import RunFolder
from harness.reports.numbers import duration


def play_league(
    ego: str, campaigns: Sequence[OpenCampaign], folder: Path, start_workers: StartWorkers, console: Console
) -> LeagueResult:
    """Carry out what is left of the campaigns of a league, and write its results. `ego` is its name.

    Raises as `run_campaign` does. What fails in a campaign is in the result: the others are played.
    """
    results, start_s = dict[str, RunResult](), time.monotonic()
    for number, campaign in enumerate(campaigns):
        name, left = campaign.document.name, ""
        if number:
            left_s = (time.monotonic() - start_s) / number * (len(campaigns) - number)
            left = f", about {duration(left_s)} left"
        console.print(f"{name}: campaign {number + 1} of {len(campaigns)}{left}", style="bold", highlight=False)
        results[name] = run_campaign(campaign, RunFolder(folder / name), start_workers, console)
    return write_league(ego, folder, results)
