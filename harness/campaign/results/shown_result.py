"""What the terminal shows of a run: verdicts, acceptance checks, what went wrong and what to try."""

from __future__ import annotations

from harness.campaign.results.kept_results import RunResult, ShownCheck, ShownStep, ShownVerdict
from harness.campaign.storage.learned import did_not_learn
from harness.campaign.storage.manifest import FINISHED
from harness.config.campaign import Campaign
from harness.errors import plain
from harness.evaluation.unplayed_games import reasons_of
from harness.reports.acceptance_wording import acceptance_lines
from harness.reports.game import gap_verdicts
from harness.reports.next_steps import to_learn
from harness.reports.run_tables import QUESTIONS, RunTables
from harness.reports.verdict_wording import Answer, answer


def shown_result(campaign: Campaign, tables: RunTables) -> RunResult:
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
        failed_stages={
            name: plain((entry.get("message") or "").strip().rpartition("\n")[2][:1000])
            for name, entry in tables.stages.items()
            if entry["status"] not in FINISHED
        },
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
