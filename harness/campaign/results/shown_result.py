"""The result of a run as the terminal shows it."""

from __future__ import annotations

from harness.campaign.results.ci_files import shown_lines
from harness.campaign.results.kept_results import RunResult, ShownCheck, ShownVerdict
from harness.campaign.storage.learned import did_not_learn
from harness.campaign.storage.manifest import FINISHED
from harness.config.campaign import Campaign
from harness.errors import plain
from harness.evaluation.unplayed_games import reasons_of
from harness.reports.game_wording import gap_verdicts
from harness.reports.run_tables import QUESTIONS, RunTables
from harness.reports.verdict_wording import Answer, answer


def shown_result(campaign: Campaign, report: RunTables) -> RunResult:
    """Verdicts, acceptance checks, and what went wrong."""
    entries = report.manifest["stages"]
    personas = [*report.manifest["personas"], *campaign.mixed_people]
    verdicts = [
        _shown(persona, answer(report, question, persona), report.causes_of(question, persona))
        for persona in personas
        for question in QUESTIONS
    ]
    if report.game is not None:
        verdicts += [_shown(persona, verdict) for persona, verdict in gap_verdicts(report.game.gaps)]
    return RunResult(
        verdicts=tuple(verdicts),
        failed_stages=tuple(name for name, entry in entries.items() if entry["status"] not in FINISHED),
        error_games=int((report.episodes["error"] != "").sum()),
        error_reasons=tuple(map(plain, reasons_of(report.episodes["error"]))),
        did_not_learn=tuple(f"{name}: {shortfall}" for name, shortfall in did_not_learn(entries).items()),
        acceptance=tuple(
            ShownCheck(passed=each.passed, text=each.text)
            for each in shown_lines(report.acceptance, len(campaign.seeds))
        ),
    )


def _shown(persona: str, verdict: Answer, causes: tuple[str, ...] = ()) -> ShownVerdict:
    told = {name: getattr(verdict, name) for name in ("question", "label", "tone", "sentence", "speed")}
    return ShownVerdict(persona=persona, causes=causes, **told)
