"""The sentences of the first screen: why the ego fails, whether that could have been prevented, how severe it is, what
retraining does and at what price, and what to do now."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harness.evaluation.comparisons.preventability import REGULATION, TAKES_OVER, prevented_examples
from harness.evaluation.competence import WITHHELD, Verdict
from harness.evaluation.rule_book.causes import cause_lines
from harness.evaluation.strategies import PAPER_ROUNDS, NaiveEgo, against_persona, round_of
from harness.reports.embedding import key
from harness.reports.focus import Focus, focus_of, is_competent
from harness.reports.key_figures import egos_of, prevented_clauses
from harness.reports.next_steps import NextStep
from harness.reports.numbers import NO_SPACE, number
from harness.reports.run_tables import RunTables
from harness.reports.severity_wording import severity_clause
from harness.reports.verdict_wording import LABELS, NOT_ANSWERED, YES, Answer, answer

MOST_PERSONAS = 3
"""Personas for which an answer has a line of its own; the verdicts have the others."""
_VERDICTS = ("from_conflict", "from_start")
"""The verdicts of preventability.csv that the first screen has."""


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
    told = list(_told(focus, personas, tables))
    prevented, driver = next((each for _, arms in told for each in _prevented_games(arms, tables)), ("", REGULATION))
    answers = [
        FirstAnswer(question="Why does it fail?", lines=list(_why(focus, tables))),
        FirstAnswer(
            question="Could it have been prevented?",
            lines=[line for where, arms in told for line in _prevented(where, arms, tables)],
            game=prevented,
            watch=f"Watch how the {TAKES_OVER[driver]} prevents one",
        ),
        FirstAnswer(question="How severe is it?", lines=list(_severe(focus, told, tables))),
        FirstAnswer(
            question=f"Does {tables.change.in_short} help, and what does it cost?",
            lines=list(_retrained(focus, personas, tables)),
        ),
    ]
    answers += [
        FirstAnswer(question="What now?", lines=[step.sentence], command=step.command, game=step.game)
        for step in steps[:1]
    ]
    return [each for each in answers if each.lines]


Told = tuple[str, Mapping[str, str]]
"""The opponent in words, as in " against speedy", and the egos by their arms."""


def _told(focus: Focus | None, personas: Sequence[str], tables: RunTables) -> Iterator[Told]:
    """The arms that the answers are about: those of the arm that matters most and of the egos of its person."""
    if focus is None:
        for persona in personas[:MOST_PERSONAS]:
            yield f" against {persona}", {arm: made for _, made, arm in egos_of(persona, tables)}
        return
    arms = {focus.arm: focus.ego}
    if focus.persona:
        arms |= {arm: made for _, made, arm in egos_of(focus.persona, tables)}
    yield _where(focus, tables), arms


def _where(focus: Focus, tables: RunTables) -> str:
    if focus.persona:
        return f" against {focus.persona}"
    return f" against an ordinary {tables.person}" if focus.is_ordinary else " alone"


def _why(focus: Focus | None, tables: RunTables) -> Iterator[str]:
    """The most frequent cause of the failures of the arm that matters most, and of the naive ego against its person."""
    if focus is None:
        yield "No ego fails."
        return
    ((where, arms),) = _told(focus, (), tables)
    for arm, ego in arms.items():
        failed, games = tables.counts_of(arm)
        if failed:
            cause = next(iter(cause_lines(tables.causes[tables.causes["arm"] == arm])), "")
            share, _, words = cause.partition(": ")
            mostly = f" {share}: {words}." if words else ""
            yield f"The {ego} fails{where} in {failed} of {games} games.{mostly}"
        elif arm == focus.arm:
            yield f"The {ego} does not fail{where}: the broken bound is of another kind."
    if baseline := tables.manifest.get("baseline"):
        failed, games = tables.counts_of(against_persona(NaiveEgo(), baseline).name)
        if not is_competent(failed, games, tables) and baseline != focus.persona:
            yield f"The {tables.naive} also fails against the baseline, {baseline}, in {failed} of {games} games."


def _prevented(where: str, arms: Mapping[str, str], tables: RunTables) -> Iterator[str]:
    """What the driver of the regulation prevents, for each ego that fails."""
    clauses, not_judged = [], []
    for arm, made in arms.items():
        if found := prevented_clauses(arm, _VERDICTS, tables):
            clauses.append(f"{made} {', '.join(found)}")
        elif tables.counts_of(arm)[0]:
            not_judged.append(made)
    if clauses:
        yield f"Of the failures{where} the driver of UN R157 prevents: {'; '.join(clauses)}."
    for made in not_judged:
        yield f"The failures of the {made}{where} are not judged."


def _prevented_games(arms: Mapping[str, str], tables: RunTables) -> Iterator[tuple[str, str]]:
    """The keys of the games that show how a reference driver prevents a failure, each with this driver: that of UN R157
    where it prevents one, or else another."""
    for (arm, seed), (episode, driver) in prevented_examples(tables.takeovers).items():
        if arm in arms:
            yield key(arm, seed, episode), driver


def _severe(focus: Focus | None, told: Sequence[Told], tables: RunTables) -> Iterator[str]:
    """The severity of the collisions of the arm that matters most, or of the last ego that has any; and the severest
    collision of the run, if it is another one."""
    shown: set[str] = set()
    for _, arms in told:
        clauses = {arm: severity_clause(made, arm, tables) for arm, made in arms.items()}
        found = [arm for arm, clause in clauses.items() if clause]
        for arm in [focus.arm] if focus is not None and focus.arm in found else found[-1:]:
            shown.add(arm)
            yield f"{clauses[arm][:1].upper()}{clauses[arm][1:]}."
    own = {name for name, arm in tables.arms.items() if arm.ego is not None and not arm.is_of_a_trait}
    rows = [row for (arm, _), row in tables.rates.items() if arm in own and np.isfinite(row["max_delta_v_mps"])]
    severest = max(rows, key=lambda row: row["max_delta_v_mps"], default=None)
    if severest is not None and severest["arm"] not in shown:
        yield f"The severest of the run: {number(severest['max_delta_v_mps'], 1)}{NO_SPACE}m/s, in {severest['arm']}."


def _retrained(focus: Focus | None, personas: Sequence[str], tables: RunTables) -> Iterator[str]:
    """The verdict on round 2, the failures, and the change of the average speed: against the person of the arm that
    matters most, then against those that the naive ego fails most often."""
    asked = [each for each in personas if tables.asked("RQ2", each)]
    first = focus.persona if focus is not None else ""
    asked.sort(key=lambda each: (each != first, -tables.counts_of(tables.arms_of("RQ2", each)[0])[0]))
    for persona in asked[:MOST_PERSONAS]:
        yield _retrained_against(persona, tables)
    if others := asked[MOST_PERSONAS:]:
        mended = sum(answer(tables, "RQ2", each).label == YES for each in others)
        yield f"Against {len(others)} more: yes for {mended or 'none'}."


def _retrained_against(persona: str, tables: RunTables) -> str:
    naive, changed = tables.arms_of("RQ2", persona)
    before, after = tables.counts_of(naive), tables.counts_of(changed)
    text = f"Against {persona}: {_label(answer(tables, 'RQ2', persona))}. "
    failures, become = ("failure", "becomes") if before[0] == 1 else ("failures", "become")
    text += f"{before[0]} {failures} in {before[1]} games {become} {after[0]}"
    text += f" in {after[1]}" if after[1] != before[1] else ""
    last = tables.last_ego(persona)
    if round_of(last) > PAPER_ROUNDS:
        failed, games = tables.counts_of(against_persona(last, persona).name)
        text += f", and {failed} in {games} after round {round_of(last)}"
    faster = _speed_mps(changed, tables) - _speed_mps(naive, tables)
    if np.isfinite(faster):
        text += f"; {number(abs(faster), 2)}{NO_SPACE}m/s {'faster' if faster > 0 else 'slower'} on average"
    return f"{text}."


def _label(given: Answer) -> str:
    """The answer, and if too few trainings give one, why the others do not."""
    if given.label != LABELS[Verdict.NOT_ENOUGH_TRAININGS]:
        return given.label
    why = Counter(each.label.removeprefix(f"{NOT_ANSWERED}: ") for each in given.per_seed if each.label in _WITHHELD)
    reasons = [f"in {count} of {len(given.per_seed)} {reason}" for reason, count in why.items()]
    return f"{given.label} ({'; '.join(reasons)})" if reasons else given.label


_WITHHELD = [LABELS[verdict] for verdict in WITHHELD]


def _speed_mps(arm: str, tables: RunTables) -> float:
    speeds = [row["mean_speed_mps"] for row in tables.rates_of(arm).values()]
    return float(np.mean(speeds)) if speeds else np.nan
