"""The results of a run: tables, model cards, replays, report and files for CI, from its folder alone."""

from __future__ import annotations

from dataclasses import replace

from rich.console import Console

from harness.campaign.results.ci_files import write_ci_files
from harness.campaign.results.evaluate_run import csv_tables, evaluated
from harness.campaign.results.kept_results import RunResult, ShownCheck, ShownStep, ShownVerdict, keep_result
from harness.campaign.results.model_cards import write_model_cards
from harness.campaign.results.read_run import read_run
from harness.campaign.results.recorded_games import recorded_games, scene_drawing
from harness.campaign.results.shown_work import doing
from harness.campaign.results.write_replays import write_replays
from harness.campaign.storage.learned import did_not_learn
from harness.campaign.storage.manifest import FINISHED
from harness.campaign.storage.run_folder import RunFolder
from harness.campaign.storage.run_log import LOGGER
from harness.config.campaign import Campaign
from harness.errors import plain
from harness.evaluation.tables import write_csv
from harness.evaluation.unplayed_games import reasons_of
from harness.files import write_atomically
from harness.reports.acceptance_wording import acceptance_lines
from harness.reports.game_wording import gap_verdicts
from harness.reports.next_steps import to_learn
from harness.reports.page import render_page
from harness.reports.provenance import mixed_versions, warn
from harness.reports.run_tables import QUESTIONS, RunTables
from harness.reports.verdict_wording import Answer, answer


def write_results(folder: RunFolder, console: Console) -> RunResult:
    """Write the results of the finished stages. Returns what the terminal shows."""
    run = read_run(folder, console)
    tables = evaluated(run)
    for name, table in csv_tables(run, tables).items():
        write_csv(table, folder.path / f"{name}.csv")
    write_model_cards(folder, tables.manifest, run.policies, tables.summary)
    tables = replace(tables, replays=write_replays(folder, run.scene, tables.episodes, console))
    with doing(console, "writing the report"):
        games = recorded_games(tables.episodes, tables.arms, folder.traces_of_arm, run.scene)
        page = render_page(tables, games, scene_drawing(run.scene))
    write_atomically(folder.path / "report.html", page.encode())
    result = _shown_result(run.campaign, tables)
    write_ci_files(folder, tables.manifest, tables.acceptance, result)
    warn(mixed_versions(tables.stages), console)
    keep_result(folder, run.manifest, result)
    LOGGER.info("wrote the results of %d games; exit code %d", len(tables.episodes), result.exit_code)
    return result


def _shown_result(campaign: Campaign, tables: RunTables) -> RunResult:
    """What the terminal shows: verdicts, acceptance checks, and what went wrong."""
    verdicts = [
        _shown(persona, answer(tables, question, persona), tables.causes_of(question, persona))
        for persona in [*tables.manifest["personas"], *campaign.mixed_people]
        for question in QUESTIONS
    ]
    if tables.game is not None:
        verdicts += [_shown(persona, verdict) for persona, verdict in gap_verdicts(tables.game.gaps)]
    return RunResult(
        verdicts=tuple(verdicts),
        failed_stages=tuple(name for name, entry in tables.stages.items() if entry["status"] not in FINISHED),
        error_games=int((tables.episodes["error"] != "").sum()),
        error_reasons=tuple(map(plain, reasons_of(tables.episodes["error"]))),
        did_not_learn=tuple(f"{name}: {shortfall}" for name, shortfall in did_not_learn(tables.stages).items()),
        to_learn=tuple(
            ShownStep(sentence=plain(each.sentence), lines=tuple(map(plain, each.command.splitlines())))
            for each in to_learn(tables)
        ),
        acceptance=tuple(
            ShownCheck(passed=each.passed, text=each.text)
            for each in acceptance_lines(tables.acceptance or (), len(campaign.seeds))
        ),
    )


def _shown(persona: str, verdict: Answer, causes: tuple[str, ...] = ()) -> ShownVerdict:
    told = {name: getattr(verdict, name) for name in ("question", "label", "tone", "sentence", "speed")}
    return ShownVerdict(persona=persona, causes=causes, **told)
