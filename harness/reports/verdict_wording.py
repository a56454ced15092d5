"""The answers to RQ1 and RQ2 as sentences, taken from rows of `comparisons`, `over_trainings` and `summary` alone.

A label says "yes" only for `Verdict.SIGNIFICANT`. Every other label says what is missing for a yes. With three training
seeds or more the answer is that over trainings, and the trained pairs by themselves are listed below it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import pandas as pd

from harness.evaluation.competence import WITHHELD, Verdict
from harness.evaluation.planned_tests import LEAST_TRAININGS, PRIMARY, About
from harness.reports.differences import CHANCE, effect, p_values, speed_sentence, too_few
from harness.reports.human_ranges import declared_unlike
from harness.reports.numbers import trimmed
from harness.reports.run_tables import Row, RunTables, failures_of, played
from harness.wording import counted

TOO_FEW_TRAININGS = f"trainings like this need {LEAST_TRAININGS} training seeds"


def scope_of(about: About | None, planned: int, seeds: int) -> str:
    """What a verdict of a campaign with this many training seeds is about, as a sentence; empty for None."""
    if about is None:
        return ""
    too_few = f"; {TOO_FEW_TRAININGS}" if seeds < LEAST_TRAININGS else ""
    return f"About {about.value}, one of {counted(planned, 'planned test')}{too_few}."


def planned_in_words(tables: RunTables) -> str:
    """The sizes of the families of Holm's correction; empty without tests."""
    parts = []
    for about, frame in ((About.TRAINED_PAIR, tables.comparisons), (About.TRAININGS, tables.over_trainings)):
        planned = frame["planned_tests"].max() if len(frame) else pd.NA
        if not pd.isna(planned):
            parts.append(f"{counted(planned, 'planned test')} about {about.value}")
    return ", and by itself over ".join(parts)


def over_trainings_sentence(row: Row, tables: RunTables, who: str) -> str:
    if row["verdict"] == Verdict.NOT_ENOUGH_TRAININGS:
        asked = row["trainings"] + row["trainings_left_out"]
        return f"The question is answered for {row['trainings']} of {asked} trainings, and {TOO_FEW_TRAININGS}."
    sides = {
        "RQ1": f"the {tables.naive} against {who}, compared with alone",
        "RQ2": f"the {tables.change.made} ego against {who}, compared with the {tables.naive}",
    }[row["question"]]
    found = f"Over {row['trainings']} trainings, {sides}: {_difference(row)}"
    match Verdict(row["verdict"]):
        case Verdict.SIGNIFICANT:
            return f"{found}."
        case Verdict.BEFORE_HOLM_ONLY:
            return f"{found}: significant without correction, but not after Holm's correction."
        case Verdict.NOT_SIGNIFICANT:
            return f"{found}: {_not_shown(row)}."
        case _:
            return f"{found}: there is nothing to test."


def over_trainings_statistics(row: Row) -> str:
    """The test of a row of `over_trainings` as one line."""
    return f"{row['question']}, over {row['trainings']} trainings. Failures: {_difference(row)}; {p_values(row)}."


def _difference(row: Row) -> str:
    if pd.isna(row["mean_difference"]):
        return "no pairs"
    ends = [row["least"], row["most"]] if row["mean_difference"] >= 0 else [-row["most"], -row["least"]]
    low, high = (trimmed(100 * end, 1) for end in ends)
    return f"{effect({**row, 'metric': PRIMARY})}, single trainings {low} to {high}"


Tone = Literal["harm", "mended", "open"]
"""harm: RQ1 is yes; mended: RQ2 is yes; open: everything else. With two training seeds, RQ1 is yes in any, RQ2 in
both."""

TONE_OF_YES: dict[str, Tone] = {"RQ1": "harm", "RQ2": "mended"}
YES, NOT_ANSWERED = "yes", "not answered"
LABELS = {
    Verdict.SIGNIFICANT: YES,
    Verdict.BEFORE_HOLM_ONLY: "only before Holm's correction",
    Verdict.NOT_SIGNIFICANT: "not shown",
    Verdict.SECONDARY: "not shown",
    Verdict.NO_DIFFERENCE: "no difference",
    Verdict.ALL_EQUAL: "no t statistic",
    Verdict.NOT_ENOUGH_PAIRS: NOT_ANSWERED,
    Verdict.NOT_ENOUGH_TRAININGS: f"{NOT_ANSWERED}: not enough trainings",
    **{verdict: verdict.value for verdict in WITHHELD},
}
NO_ROUND_2 = "Round 2 was not played: the campaign trains and tunes no ego in it."


@dataclass(frozen=True, kw_only=True)
class Answer:
    """One question about one persona, answered for a training seed or for several together."""

    question: str
    seed: int | None = None
    """None: of several."""
    label: str
    tone: Tone = "open"
    sentence: str
    speed: str = ""
    """What happened to the average speed; empty when it was not compared."""
    about: About | None = None
    """What it holds for; None: there is no test."""
    planned_tests: int = 0
    """The tests of its family, itself included."""
    scope: str = ""
    """The two in words."""
    per_seed: Sequence[Answer] = ()
    """The answer for each seed when there are several."""


def answer(tables: RunTables, question: str, persona: str) -> Answer:
    """The answer for the seeds that a question is asked of. A seed without a comparison is not answered yet."""
    answers = [_of_seed(tables, question, persona, seed) for seed in tables.asked(question, persona)]
    if not answers:
        sentence = NO_ROUND_2 if question == "RQ2" else "Not compared."
        return Answer(question=question, label="not asked", sentence=sentence)
    if len(answers) == 1:
        return answers[0]
    row = tables.over_trainings_of(question, persona)
    several = _of_seeds(tables, question, persona, answers)
    return several if row is None else _over_trainings(tables, row, several)


def _over_trainings(tables: RunTables, row: Row, by_seed: Answer) -> Answer:
    """The answer over trainings; `by_seed` is that of the trained pairs by themselves."""
    verdict, planned = Verdict(row["verdict"]), int(row["planned_tests"])
    answers = by_seed.per_seed
    if verdict is Verdict.NOT_ENOUGH_TRAININGS and all(each.label.startswith(NOT_ANSWERED) for each in answers):
        return by_seed
    yes = sum(each.label == YES for each in answers)
    sentence = over_trainings_sentence(row, tables, _who(tables, row["persona"]))
    return replace(
        by_seed,
        label=LABELS[verdict],
        tone=TONE_OF_YES[row["question"]] if verdict is Verdict.SIGNIFICANT else "open",
        sentence=f"{sentence} Each trained pair by itself: yes in {yes} of {len(answers)}.",
        about=About.TRAININGS,
        planned_tests=planned,
        scope=scope_of(About.TRAININGS, planned, len(tables.seeds)),
    )


def _who(tables: RunTables, persona: str) -> str:
    return tables.who(persona) or f"the {persona} driver"


def _of_seeds(tables: RunTables, question: str, persona: str, answers: Sequence[Answer]) -> Answer:
    yes, seeds, who = sum(each.label == YES for each in answers), len(answers), _who(tables, persona)
    finding = {
        "RQ1": f"{who} makes the {tables.naive} fail significantly more often than it does alone",
        "RQ2": f"{tables.change.doing} makes the ego fail significantly less often against {who}",
    }[question]
    label = f"yes in {yes} of {seeds} seeds" if yes else f"not shown in any of {seeds} seeds"
    sentence = f"In {yes} of {seeds} training seeds {finding} (after Holm's correction)."
    if unanswered := [each.label for each in answers if each.label.startswith(NOT_ANSWERED)]:
        if len(unanswered) == seeds:
            label = unanswered[0] if len(set(unanswered)) == 1 else NOT_ANSWERED
            sentence = "It is not answered in any training seed."
        else:
            sentence += f" In {len(unanswered)} of {seeds} it is not answered."
    harmed = question == "RQ1" and yes > 0
    tone = TONE_OF_YES[question] if harmed or yes == seeds else "open"
    scope = next((each.scope for each in answers if each.scope), "")
    planned = max(each.planned_tests for each in answers)
    about = About.TRAINED_PAIR if planned else None
    return Answer(
        question=question,
        label=label,
        tone=tone,
        sentence=sentence,
        per_seed=answers,
        about=about,
        planned_tests=planned,
        scope=scope,
    )


def _of_seed(tables: RunTables, question: str, persona: str, seed: int) -> Answer:
    by_metric = {row["metric"]: row for row in tables.tests_of(question, persona) if row["seed"] == seed}
    names = tables.arms_of(question, persona)
    before, after = (tables.rates.get((name, seed)) for name in names)
    unplayed = [name for name, row in zip(names, (before, after), strict=True) if played(row) == 0]
    failure, speed = by_metric.get("failure"), by_metric.get("mean_speed")
    not_answered = Answer(question=question, seed=seed, label=NOT_ANSWERED, sentence="")
    if unplayed or failure is None or before is None or after is None:
        sentence = f"Not played: {' and '.join(unplayed)}." if unplayed else "The failures were not compared."
        return replace(not_answered, sentence=sentence)
    verdict, planned = Verdict(failure["verdict"]), int(failure["planned_tests"])
    scope = scope_of(About.TRAINED_PAIR, planned, len(tables.seeds))
    asked = replace(not_answered, about=About.TRAINED_PAIR, planned_tests=planned, scope=scope)
    if verdict in WITHHELD:
        sentence = as_sentence(failure["reason"])
        return replace(asked, label=LABELS[verdict], sentence=sentence)
    sentence = _failure_sentence(tables, failure, before, after)
    told_speed = ""
    if speed is not None:
        told_speed = speed_sentence(speed, before, after, tables.significance)
        if speed["pairs_left_out"] != failure["pairs_left_out"]:
            told_speed += left_out(speed)
    return replace(
        asked,
        label=LABELS[verdict],
        tone=TONE_OF_YES[question] if verdict is Verdict.SIGNIFICANT else "open",
        sentence=" ".join(filter(None, (sentence + left_out(failure), declared_unlike(tables.realism, persona, seed)))),
        speed=told_speed,
    )


def as_sentence(reason: str) -> str:
    return f"{reason[:1].upper()}{reason[1:]}."


def _failure_sentence(tables: RunTables, row: Row, before: Row, after: Row) -> str:
    was, now, pairs = failures_of(before), failures_of(after), row["pairs"]
    who, change, naive = _who(tables, row["persona"]), tables.change, tables.naive
    if row["question"] == "RQ1":
        claim = f"{who[:1].upper()}{who[1:]} makes the {naive} fail in {now} games instead of {was}"
        counts = f"The {naive} fails in {now} games against {who} and in {was} alone"
        direction = "more often"
    else:
        claim = f"{change.doing.capitalize()} reduces the ego's failures against {who} from {was} games to {now}"
        counts = f"Against {who} the {change.made} ego fails in {now} games, the {naive} in {was}"
        direction = "less often"
    match Verdict(row["verdict"]):
        case Verdict.SIGNIFICANT:
            return f"{claim}."
        case Verdict.BEFORE_HOLM_ONLY:
            return f"{counts}: significantly {direction} without correction, but not after Holm's correction."
        case Verdict.NOT_SIGNIFICANT:
            return f"{counts}: {_not_shown(row)}."
        case Verdict.NO_DIFFERENCE:
            return (
                f"{counts}. In each of the {pairs} pairs both games have the same result, so there is nothing to test."
            )
        case _:
            return f"{counts}, {too_few(pairs)}."


def _not_shown(row: Row) -> str:
    """Why a test of failures shows nothing. It asks for a difference in one direction, that of a difference above 0."""
    if row["mean_difference"] >= 0:
        return CHANCE
    return "not more" if row["question"] == "RQ1" else "not fewer"


def left_out(row: Row) -> str:
    """A sentence, with a space before it, on the pairs that are not in the test; empty when all are."""
    out = row["pairs_left_out"]
    if not out:
        return ""
    return f" {out} of {out + row['pairs']} pairs {'is' if out == 1 else 'are'} left out: not played or not measured."
