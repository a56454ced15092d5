"""The results of a run: tables, replays and report, from its folder alone."""

from __future__ import annotations

from rich.console import Console

from harness.campaign.results.evaluate_run import evaluated
from harness.campaign.results.kept_results import RunResult, keep_result
from harness.campaign.results.read_run import read_run
from harness.campaign.results.write_run import write_run
from harness.campaign.storage.run_folder import RunFolder
from harness.campaign.storage.run_log import LOGGER
from harness.reports.provenance import mixed_versions, warn


def write_results(folder: RunFolder, console: Console) -> RunResult:
    """Write tables, replays and report of the finished stages."""
    run = read_run(folder, console)
    tables = evaluated(run)
    result = write_run(folder, run, tables, console)
    warn(mixed_versions(tables.manifest["stages"]), console)
    keep_result(folder, run.manifest, result)
    LOGGER.info("wrote the results of %d games; exit code %d", len(tables.episodes), result.exit_code)
    return result
