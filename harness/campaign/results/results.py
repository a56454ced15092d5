"""The results of a run: tables, model cards, replays, report and files for CI, from its folder alone."""

from __future__ import annotations

from dataclasses import replace

from rich.console import Console

from harness.campaign.results.ci_files import write_ci_files
from harness.campaign.results.drawn_starts import found_boundaries
from harness.campaign.results.evaluate_run import csv_tables, evaluated
from harness.campaign.results.kept_results import RunResult, keep_result
from harness.campaign.results.model_cards import write_model_cards
from harness.campaign.results.read_run import read_run
from harness.campaign.results.recorded_games import failing_paths, recorded_games, scene_drawing, takeovers_of
from harness.campaign.results.shown_result import shown_result, verdicts_of
from harness.campaign.results.shown_work import doing
from harness.campaign.results.write_replays import write_replays
from harness.campaign.storage.run_folder import RunFolder
from harness.campaign.storage.run_log import LOGGER
from harness.evaluation.comparisons.attribution import examples
from harness.evaluation.comparisons.preventability import prevented_examples
from harness.evaluation.tables import write_csv
from harness.files import write_atomically
from harness.reports.page import render_page
from harness.reports.provenance import mixed_versions, warn


def write_results(folder: RunFolder, console: Console) -> RunResult:
    """Write the results of the finished stages. Returns what the terminal shows."""
    run = read_run(folder, console)
    tables = evaluated(run)
    for name, table in csv_tables(run, tables).items():
        write_csv(table, folder.path / f"{name}.csv")
    write_model_cards(folder, tables.manifest, run.policies, tables.summary, tables.realism)
    tables = replace(
        tables,
        replays=write_replays(folder, run.scene, tables.of_own_traits(tables.episodes), console),
        boundaries=found_boundaries(folder, run.scene),
    )
    with doing(console, "writing the report"):
        prevented = [(*arm, episode) for arm, (episode, _) in prevented_examples(tables.takeovers).items()]
        shown_first, takeovers = [*examples(tables.attribution), *prevented], takeovers_of(tables.takeovers)
        games = recorded_games(tables.episodes, tables.arms, folder.traces_of_arm, run.scene, shown_first, takeovers)
        paths = list(failing_paths(tables.episodes, tables.arms, folder.traces_of_arm, run.scene))
        page = render_page(tables, games, scene_drawing(run.scene), paths)
    write_atomically(folder.path / "report.html", page.encode())
    verdicts = verdicts_of(run.campaign, tables)
    result = shown_result(run.campaign, tables, verdicts)
    write_ci_files(folder, tables.manifest, tables.acceptance, verdicts, result)
    warn(mixed_versions(tables.stages), console)
    keep_result(folder, run.manifest, result)
    LOGGER.info("wrote the results of %d games; exit code %d", len(tables.episodes), result.exit_code)
    return result
