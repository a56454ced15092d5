"""The sentences of the first screen: why the ego fails, whether that could have been prevented, how severe it is, what
retraining does and at what price, and what to do now."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from harness.evaluation.comparisons.preventability import prevented_examples
from harness.evaluation.rule_book.causes import cause_lines
from harness.evaluation.strategies import NAIVE_VS_SUMO, NaiveEgo, against_persona
from harness.reports.embedding import key
from harness.reports.focus import Focus, focus_of
from harness.reports.key_figures import egos_of
from harness.reports.next_steps import NextStep
from harness.reports.numbers import NO_SPACE, number
from harness.reports.run_tables import RunTables
from harness.reports.severity_wording import severity_clause
from harness.reports.verdict_wording import answer

MOST_PERSONAS = 3
"""Personas for which an answer has a line of its own; the verdicts have the others."""


@dataclass(frozen=True, kw_only=True)
class FirstAnswer:
    """A question of the reader, with its answer."""

    question: str
    lines: Sequence[str]
    command: str = ""
    game: str = ""
    """The key of the game to watch."""
    watch: str = "Watch it here"
    """The text of the link to it."""


def first_answers(tables: RunTables, steps: Sequence[NextStep]) -> list[FirstAnswer]:
    """The questions in order; empty before a game against a persona was played."""
    personas = [each for each in tables.personas if tables.rates_of(tables.arms_of("RQ1", each)[1])]
    if not personas:
        return []
    focus = focus_of(tables)
    told = [focus.persona] if focus is not None and focus.persona else personas[:MOST_PERSONAS]
    answers = [
        FirstAnswer(question="Why does it fail?", lines=list(_why(focus, tables))),
        FirstAnswer(
            question="Could it have been prevented?",
            lines=[each for name in told for each in _prevented(name, tables)],
            game=next((game for name in told for game in _prevented_games(name, tables)), ""),
            watch="Watch how a reference driver prevents one",
        ),
        FirstAnswer(question="How severe is it?", lines=[each for name in told for each in _severe(name, tables)]),
        FirstAnswer(
            question=f"Does {tables.change.doing} help, and what does it cost?",
            lines=[each for name in personas[:MOST_PERSONAS] for each in _retrained(name, tables)],
        ),
    ]
    answers += [
        FirstAnswer(question="What now?", lines=[step.sentence], command=step.command, game=step.game)
        for step in steps[:1]
    ]
    return [each for each in answers if each.lines]


def _why(focus: Focus | None, tables: RunTables) -> Iterator[str]:
    """The most frequent cause of the failures of the arm that matters most, and of the naive ego against its person."""
    if focus is None:
        yield "No ego fails."
        return
    arms = {focus.arm: focus.ego}
    if focus.persona:
        arms |= {arm: made for _, made, arm in egos_of(focus.persona, tables)}
    for arm, ego in arms.items():
        failed, games = tables.counts_of(arm)
        against = f" against {focus.persona}" if focus.persona else ""
        where = against if arm != NAIVE_VS_SUMO.name else " against an ordinary driver"
        if failed:
            cause = next(iter(cause_lines(tables.causes[tables.causes["arm"] == arm])), "")
            share, _, words = cause.partition(": ")
            mostly = f" {share}: {words}." if words else ""
            yield f"The {ego} fails{where} in {failed} of {games} games.{mostly}"
        elif arm == focus.arm:
            yield f"The {ego} does not fail{where}: the broken bound is of another kind."
    if baseline := tables.manifest.get("baseline"):
        failed, games = tables.counts_of(against_persona(NaiveEgo(), baseline).name)
        if failed:
            yield f"The {tables.naive} also fails against the baseline, {baseline}, in {failed} of {games} games."


def _prevented(persona: str, tables: RunTables) -> Iterator[str]:
    """What the driver of the regulation prevents against a persona, for each ego that fails."""
    clauses, not_judged = [], []
    for _, made, arm in egos_of(persona, tables):
        failed, _ = tables.counts_of(arm)
        judged = tables.prevented_in(arm)
        conflict, start = (sum(row[f"from_{when}_prevented"] for row in judged) for when in ("conflict", "start"))
        if failed and judged:
            clauses.append(f"{conflict} of {failed} of the {made} from the conflict on, {start} from the start")
        elif failed:
            not_judged.append(made)
    if clauses:
        yield f"Of the failures against {persona} the driver of UN R157 prevents {'; '.join(clauses)}."
    for made in not_judged:
        yield f"The failures of the {made} against {persona} are not judged."


def _prevented_games(persona: str, tables: RunTables) -> Iterator[str]:
    """The keys of the games that show how a reference driver prevents a failure against a persona."""
    arms = {arm for _, _, arm in egos_of(persona, tables)}
    for (arm, seed), episode in prevented_examples(tables.takeovers).items():
        if arm in arms:
            yield key(arm, seed, episode)


def _severe(persona: str, tables: RunTables) -> Iterator[str]:
    """The severity of the collisions of the last ego that has any."""
    clauses = [severity_clause(made, list(tables.rates_of(arm).values())) for _, made, arm in egos_of(persona, tables)]
    for clause in [each for each in clauses if each][-1:]:
        yield f"{clause[:1].upper()}{clause[1:]}."


def _retrained(persona: str, tables: RunTables) -> Iterator[str]:
    """The verdict on round 2, the failures, and the change of the average speed."""
    if not tables.asked("RQ2", persona):
        return
    naive, changed = tables.arms_of("RQ2", persona)
    before, after = tables.counts_of(naive), tables.counts_of(changed)
    given = answer(tables, "RQ2", persona)
    text = f"Against {persona}: {given.label}. {before[0]} of {before[1]} failures become {after[0]} of {after[1]}"
    faster = _speed_mps(changed, tables) - _speed_mps(naive, tables)
    if np.isfinite(faster):
        text += f"; {number(abs(faster), 2)}{NO_SPACE}m/s {'faster' if faster > 0 else 'slower'} on average"
    yield f"{text}."


def _speed_mps(arm: str, tables: RunTables) -> float:
    speeds = [row["mean_speed_mps"] for row in tables.rates_of(arm).values()]
    return float(np.mean(speeds)) if speeds else np.nan
