"""What the terminal shows of a run: verdicts, acceptance checks, what went wrong and what to try."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, TypeAlias

from harness.campaign.results.kept_results import RunResult, ShownLine
from harness.campaign.storage.learned import did_not_learn
from harness.config.campaign import Campaign
from harness.errors import plain
from harness.evaluation.unplayed_games import reasons_of
from harness.reports.acceptance_wording import acceptance_lines
from harness.reports.game import gap_verdicts
from harness.reports.key_figures import harm_of
from harness.reports.next_steps import to_learn
from harness.reports.provenance import QUICK
from harness.reports.run_tables import QUESTIONS, RunTables
from harness.reports.verdict_wording import Answer, answer, as_sentence

Verdicts: TypeAlias = Sequence[tuple[str, Answer, tuple[str, ...]]]
"""Of each persona and question: the answer, and why the ego failed, a line for each kind of cause."""
_STYLES: Mapping[str, Any] = {"harm": "bold red", "mended": "bold green", "open": "bold yellow"}


def verdicts_of(campaign: Campaign, tables: RunTables) -> Verdicts:
    """The verdicts of a run, those on pairs of its game at the end."""
    verdicts = [
        (persona, answer(tables, question, persona), tables.causes_of(question, persona))
        for persona in [*tables.manifest["personas"], *campaign.mixed_people]
        for question in QUESTIONS
    ]
    of_pairs = gap_verdicts(tables.game.gaps) if tables.game is not None else []
    return [*verdicts, *((persona, verdict, ()) for persona, verdict in of_pairs)]


def shown_result(campaign: Campaign, tables: RunTables, verdicts: Verdicts) -> RunResult:
    checks = tables.acceptance
    return RunResult(
        lines=tuple(_lines(campaign, tables, verdicts)),
        failed_stages={
            name: plain((entry.get("message") or "").strip().rpartition("\n")[2][:1000])
            for name, entry in tables.unfinished.items()
        },
        error_games=int((tables.episodes["error"] != "").sum()),
        error_reasons=tuple(map(plain, reasons_of(tables.episodes["error"]))),
        accepted=all(check.passed for check in checks) if checks else None,
    )


def _lines(campaign: Campaign, tables: RunTables, verdicts: Verdicts) -> Iterator[ShownLine]:
    if tables.manifest.get("quick"):
        yield ShownLine(text=QUICK, style="bold yellow")
    for name, shortfall in did_not_learn(tables.stages).items():
        yield ShownLine(text=f"Did not learn: {name}: {shortfall}", style="bold yellow", is_failure=True)
    for persona, verdict, causes in verdicts:
        yield ShownLine(text=f"{persona}, {verdict.question}: {verdict.label}", style=_STYLES[verdict.tone])
        is_compared = verdict.question == "RQ2" and tables.asked("RQ2", persona)
        harm = map(as_sentence, harm_of(persona, tables).values()) if is_compared else ()
        for sentence in filter(None, (verdict.sentence, *causes, verdict.speed, *harm, verdict.scope)):
            yield ShownLine(text=f"  {sentence}")
    for step in to_learn(tables):
        yield ShownLine(text=f"To try: {plain(step.sentence)}")
        for line in step.command.splitlines():
            yield ShownLine(text=f"  {plain(line)}")
    for check in acceptance_lines(tables.acceptance or (), len(campaign.seeds)):
        style: Any = "green" if check.passed else "bold red"
        yield ShownLine(text=check.text, style=style, is_failure=not check.passed)
