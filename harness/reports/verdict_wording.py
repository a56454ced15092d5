"""The answers to RQ1 and RQ2 as sentences, taken from rows of `comparisons` and `summary` alone.

A label says "yes" only for `Verdict.SIGNIFICANT`. Every other label says what is missing for a yes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

from harness.evaluation.research_questions import INCOMPETENT, Verdict
from harness.evaluation.strategies import NAIVE_ALONE, NaiveEgo, ReconfiguredEgo, RetrainedEgo, against_persona
from harness.reports.differences import CHANCE, NO_T_STATISTIC, Row, speed_sentence, too_few
from harness.reports.numbers import p_text

Tone = Literal["harm", "mended", "open"]
"""harm: RQ1 is yes in any seed; mended: RQ2 is yes in all seeds; open: everything else."""

TONE_OF_YES: dict[str, Tone] = {"RQ1": "harm", "RQ2": "mended"}
QUESTIONS = {
    "RQ1": "Does this {person} cause failures?",
    "RQ2": "Did {doing} fix it?",
}
NOT_ASKED, NOT_ANSWERED = "not asked", "not answered"
LABELS = {
    Verdict.SIGNIFICANT: "yes",
    Verdict.BEFORE_HOLM_ONLY: "only before Holm's correction",
    Verdict.NOT_SIGNIFICANT: "not shown",
    Verdict.NO_DIFFERENCE: "no difference",
    Verdict.ALL_EQUAL: "no t statistic",
    Verdict.NOT_ENOUGH_PAIRS: NOT_ANSWERED,
    **{verdict: verdict.value for verdict in INCOMPETENT},
}
NO_ROUND_2 = "Round 2 was not played: this ego has nothing to train or to tune."
NO_SEED_ANSWERS = "It is not answered in any training seed."
NOT_COMPARED = "Not compared."
FAILURES_NOT_COMPARED = "The failures were not compared."
BEFORE_HOLM_ONLY = "significantly {direction} without correction, but not after Holm's correction"
NO_DIFFERENCE = "In each of the {pairs} pairs both games have the same result, so there is nothing to test."


class Change(NamedTuple):
    """What round 2 makes of the ego."""

    made: str
    """The ego of round 2 in sentences."""
    doing: str
    """What round 2 does, in sentences."""
    ego: type[RetrainedEgo] | type[ReconfiguredEgo]
    """The ego of round 2 as a strategy."""
    naive: str = "naive ego"
    """The ego before round 2 in sentences, after "the": an ego that the campaign did not train has its own name."""


RETRAINED = Change("retrained", "retraining", RetrainedEgo)
RECONFIGURED = Change("reconfigured", "reconfiguration", ReconfiguredEgo)

ARMS = {
    "RQ1": lambda persona, change: (NAIVE_ALONE.name, against_persona(NaiveEgo(), persona).name),
    "RQ2": lambda persona, change: (
        against_persona(NaiveEgo(), persona).name,
        against_persona(change.ego(against=persona), persona).name,
    ),
}
"""Baseline and treatment of each question, by the persona and by what round 2 does."""


@dataclass(frozen=True, kw_only=True)
class Answer:
    """One research question about one persona and training seed, answered by its failures."""

    seed: int
    yes: bool = False
    label: str
    tone: Tone = "open"
    sentence: str
    speed: str = ""
    """What happened to the average speed; empty when it was not compared."""

    @property
    def answered(self) -> bool:
        """Whether the question could be asked of the games at all."""
        return not self.label.startswith(NOT_ANSWERED)


@dataclass(frozen=True, kw_only=True)
class Conclusion:
    """One research question about one persona: the headline, and each seed's answer when there are several."""

    question: str
    label: str
    tone: Tone = "open"
    sentence: str
    speed: str = ""
    per_seed: Sequence[Answer] = ()

    @classmethod
    def of_one(cls, question: str, answer: Answer) -> Conclusion:
        """The headline where there is one answer only."""
        return cls(
            question=question, label=answer.label, tone=answer.tone, sentence=answer.sentence, speed=answer.speed
        )


@dataclass(frozen=True, kw_only=True)
class Asked:
    """A question about a persona, and the tables that answer it."""

    question: str
    persona: str
    who: str
    """What the ego meets."""
    comparisons: Sequence[Row]
    """Of this question and persona."""
    arms: Mapping[tuple[str, int], Row]
    """Rows of `summary` by arm and seed."""
    significance: float | None
    change: Change = RETRAINED
    """The treatment of round 2."""


def conclusion(asked: Asked, seeds: Sequence[int]) -> Conclusion:
    """The answer for the seeds that a question is asked of. A seed without a comparison is not answered yet."""
    answers = [_answer(asked, seed) for seed in seeds]
    if not answers:
        sentence = NO_ROUND_2 if asked.question == "RQ2" else NOT_COMPARED
        return Conclusion(question=asked.question, label=NOT_ASKED, sentence=sentence)
    if len(answers) == 1:
        return Conclusion.of_one(asked.question, answers[0])
    return _of_seeds(asked, answers)


def _of_seeds(asked: Asked, answers: Sequence[Answer]) -> Conclusion:
    yes, seeds = sum(answer.yes for answer in answers), len(answers)
    finding = {
        "RQ1": f"{asked.who} makes the {asked.change.naive} fail significantly more often than it does alone",
        "RQ2": f"{asked.change.doing} makes the ego fail significantly less often against {asked.who}",
    }[asked.question]
    label = f"yes in {yes} of {seeds} seeds" if yes else f"not shown in any of {seeds} seeds"
    sentence = f"In {yes} of {seeds} training seeds {finding} (after Holm's correction)."
    if unanswered := [answer.label for answer in answers if not answer.answered]:
        if len(unanswered) == seeds:
            label, sentence = unanswered[0] if len(set(unanswered)) == 1 else NOT_ANSWERED, NO_SEED_ANSWERS
        else:
            sentence += f" In {len(unanswered)} of {seeds} it is not answered."
    harmed = asked.question == "RQ1" and yes > 0
    tone = TONE_OF_YES[asked.question] if harmed or yes == seeds else "open"
    return Conclusion(question=asked.question, label=label, tone=tone, sentence=sentence, per_seed=answers)


def _answer(asked: Asked, seed: int) -> Answer:
    by_metric = {row["metric"]: row for row in asked.comparisons if row["seed"] == seed}
    names = ARMS[asked.question](asked.persona, asked.change)
    before, after = (asked.arms.get((name, seed)) for name in names)
    unplayed = [name for name, row in zip(names, (before, after), strict=True) if played(row) == 0]
    failure, speed = by_metric.get("failure"), by_metric.get("mean_speed")
    if unplayed or failure is None or before is None or after is None:
        sentence = f"Not played: {' and '.join(unplayed)}." if unplayed else FAILURES_NOT_COMPARED
        return Answer(seed=seed, label=NOT_ANSWERED, sentence=sentence)
    verdict = Verdict(failure["verdict"])
    if verdict in INCOMPETENT:
        return Answer(seed=seed, label=LABELS[verdict], sentence=as_sentence(failure["reason"]))
    sentence = _failure_sentence(asked, failure, before, after)
    if verdict is Verdict.ALL_EQUAL and asked.significance is not None:
        below = "below" if failure["mcnemar_p"] < asked.significance else "not below"
        sentence += f" This is {below} the campaign's significance of {asked.significance:g} (without correction)."
    told_speed = ""
    if speed is not None:
        told_speed = speed_sentence(speed, before, after, asked.significance)
        if speed["pairs_left_out"] != failure["pairs_left_out"]:
            told_speed += left_out(speed)
    yes = verdict is Verdict.SIGNIFICANT
    return Answer(
        seed=seed,
        yes=yes,
        label=LABELS[verdict],
        tone=TONE_OF_YES[asked.question] if yes else "open",
        sentence=sentence + left_out(failure),
        speed=told_speed,
    )


def as_sentence(reason: str) -> str:
    """A reason for want of competence as a sentence."""
    return f"{reason[:1].upper()}{reason[1:]}."


def _failure_sentence(asked: Asked, row: Row, before: Row, after: Row) -> str:
    was, now, pairs = failures_of(before), failures_of(after), row["pairs"]
    who, change = asked.who, asked.change
    if asked.question == "RQ1":
        claim = f"{who[:1].upper()}{who[1:]} makes the {change.naive} fail in {now} games instead of {was}"
        counts = f"The {change.naive} fails in {now} games against {who} and in {was} alone"
        direction = "more often"
    else:
        claim = f"{change.doing.capitalize()} reduces the ego's failures against {who} from {was} games to {now}"
        counts = f"Against {who} the {change.made} ego fails in {now} games, the {change.naive} in {was}"
        direction = "less often"
    return {
        Verdict.SIGNIFICANT: f"{claim}.",
        Verdict.BEFORE_HOLM_ONLY: f"{counts}: {BEFORE_HOLM_ONLY.format(direction=direction)}.",
        Verdict.NOT_SIGNIFICANT: f"{counts}: {CHANCE}.",
        Verdict.NO_DIFFERENCE: f"{counts}. {NO_DIFFERENCE.format(pairs=pairs)}",
        Verdict.ALL_EQUAL: (
            f"{counts}; {NO_T_STATISTIC.format(pairs=pairs)}. McNemar's exact test gives {p_text(row['mcnemar_p'])}."
        ),
        Verdict.NOT_ENOUGH_PAIRS: f"{counts}, {too_few(pairs)}.",
    }[Verdict(row["verdict"])]


def left_out(row: Row) -> str:
    """A sentence, with a space before it, on the pairs that are not in the test; empty when all are."""
    out = row["pairs_left_out"]
    if not out:
        return ""
    return f" {out} of {out + row['pairs']} pairs {'is' if out == 1 else 'are'} left out: not played or not measured."


def played(row: Row | None) -> int:
    """Games of an arm that could be played; none when the arm has no row."""
    return 0 if row is None else row["episodes"] - row["errors"]


def failures_of(row: Row) -> str:
    """E.g. "25 of 100"."""
    return f"{failures(row)} of {played(row)}"


def failures(row: Row) -> int:
    """How many games of the arm the ego failed."""
    return int(row["collisions"] + row["rails"] + row["timeouts"])
