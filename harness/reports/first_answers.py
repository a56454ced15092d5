"""The first screen of the page: why the ego fails, whether that could have been prevented, and what to do now."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from harness.evaluation.strategies import EgoStrategy, NaiveEgo, against_persona
from harness.reports.next_steps import NextStep
from harness.reports.run_findings import RunFindings

WHY = "Why does it fail?"
PREVENTABLE = "Could it have been prevented?"
NOW = "What now?"
NO_FAILURE = "Against {persona} no ego fails."
FAILS = "Against {persona} the {ego} fails in {failures} of {games} games."
FAILS_NO_MORE = "The {ego} does not fail."
MOSTLY = "{share} failures: {cause}."
ALL, SOME, NONE = "Yes.", "Partly.", "No."
PREVENTED = (
    "Against {persona} a reference driver (a model of a careful human driver) in the seat of the {naive} avoids "
    "{avoided} of its {failures} failures."
)
ALSO = "Against {persona}: {avoided} of {failures}."
NOT_JUDGED = "Not known: reference drivers have judged no failure of this run."
NOTHING_TO_PREVENT = "There is nothing to prevent: the {naive} does not fail."


@dataclass(frozen=True, kw_only=True)
class FirstAnswer:
    """One question of the first screen and its answer, a sentence each line."""

    question: str
    lines: Sequence[str]
    command: str = ""
    """What to type, if the answer is something to do."""
    game: str = ""
    """The key of the game that it is about, empty for none."""


def first_answers(personas: Sequence[str], found: RunFindings, steps: Sequence[NextStep]) -> list[FirstAnswer]:
    """The questions after "did it pass?", in order; empty before a game against a persona was played."""
    lines = [line for persona in personas for line in _why(persona, found)]
    if not lines:
        return []
    answers = [
        FirstAnswer(question=WHY, lines=lines),
        FirstAnswer(question=PREVENTABLE, lines=_prevented(personas, found)),
    ]
    answers += [
        FirstAnswer(question=NOW, lines=[step.sentence], command=step.command, game=step.game) for step in steps[:1]
    ]
    return answers


def _egos(persona: str, found: RunFindings) -> Iterator[tuple[str, str, EgoStrategy]]:
    """The egos that a persona's card shows: the question about each, its word, and the strategy."""
    yield "RQ1", found.naive, NaiveEgo()
    if found.asked("RQ2", persona):
        yield "RQ2", f"{found.change.made} ego", found.change.ego(against=persona)


def _why(persona: str, found: RunFindings) -> Iterator[str]:
    """One line for each ego that fails against a persona: how often, and its most frequent cause."""
    failing, egos = 0, 0
    for question, word, ego in _egos(persona, found):
        games = found.games[found.games["arm"] == against_persona(ego, persona).name]
        if games.empty:
            continue
        failures, egos = int(games["ego_failed"].sum()), egos + 1
        if failures:
            failing += 1
            cause = next(iter(found.causes(question, persona)), "")
            share, _, words = cause.partition(": ")
            mostly = f" {MOSTLY.format(share=share, cause=words)}" if words else ""
            yield FAILS.format(persona=persona, ego=word, failures=failures, games=len(games)) + mostly
        elif failing:
            yield FAILS_NO_MORE.format(ego=word)
    if egos and not failing:
        yield NO_FAILURE.format(persona=persona)


def _prevented(personas: Sequence[str], found: RunFindings) -> list[str]:
    lines: list[str] = []
    all_avoided, all_failures = 0, 0
    for persona in personas:
        judged = found.preventability.get(against_persona(NaiveEgo(), persona).name, ())
        avoided = sum(each.from_start.by_any for each in judged)
        failures = sum(each.from_start.judged for each in judged)
        if failures:
            sentence = ALSO if lines else PREVENTED
            lines.append(sentence.format(persona=persona, naive=found.naive, avoided=avoided, failures=failures))
        all_avoided, all_failures = all_avoided + avoided, all_failures + failures
    if not lines:
        arms = [against_persona(NaiveEgo(), persona).name for persona in personas]
        failed = found.games[found.games["arm"].isin(arms)]["ego_failed"].sum()
        return [NOT_JUDGED if failed else NOTHING_TO_PREVENT.format(naive=found.naive)]
    label = ALL if all_avoided == all_failures else SOME if all_avoided else NONE
    return [f"{label} {lines[0]}", *lines[1:]]
