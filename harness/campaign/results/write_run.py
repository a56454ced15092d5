"""Writing the results of a run: tables, model cards, replays, report, and files for CI."""

from __future__ import annotations

from dataclasses import replace

from rich.console import Console

from harness.campaign.plan.stages import stage_id
from harness.campaign.results.ci_files import write_ci_files
from harness.campaign.results.evaluate_run import csv_tables
from harness.campaign.results.kept_results import RunResult
from harness.campaign.results.model_cards import write_model_cards
from harness.campaign.results.read_run import ReadRun
from harness.campaign.results.recorded_games import recorded_games, scene_drawing
from harness.campaign.results.shown_result import shown_result
from harness.campaign.results.shown_work import doing
from harness.campaign.results.write_replays import write_replays
from harness.campaign.storage.run_folder import RunFolder
from harness.evaluation.tables import write_csv
from harness.files import write_atomically
from harness.reports.page import render_page
from harness.reports.run_tables import RunTables


def write_run(folder: RunFolder, run: ReadRun, tables: RunTables, console: Console) -> RunResult:
    """Write everything that the run folder gets of its results. Returns what the terminal shows."""
    for name, table in csv_tables(run, tables).items():
        write_csv(table, folder.path / f"{name}.csv")
    write_model_cards(folder, tables.manifest, run.policies, tables.summary)
    report = replace(tables, replays=write_replays(folder, run.scene, tables.episodes, console))
    with doing(console, "writing the report"):
        games = recorded_games(
            report.episodes, report.arms, lambda arm, seed: folder.traces(stage_id(arm, seed)), run.scene
        )
        page = render_page(report, games, scene_drawing(run.scene))
    write_atomically(folder.path / "report.html", page.encode())
    result = shown_result(run.campaign, report)
    write_ci_files(folder, report.manifest, report.acceptance, result)
    return result
