"""The answers to RQ1 and RQ2 as sentences, taken from rows of `comparisons` and `summary` alone.

A label says "yes" only for `Verdict.SIGNIFICANT`. Every other label says what is missing for a yes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from harness.evaluation.research_questions import INCOMPETENT, Verdict
from harness.reports.numbers import MISSING, NO_SPACE, SURE, number, p_text, trimmed
from harness.reports.treatment import ARMS, RETRAINED, Change

Row = Mapping[Any, Any]
Tone = Literal["harm", "mended", "open"]
"""harm: RQ1 is yes in any seed; mended: RQ2 is yes in all seeds; open: everything else."""

TONE_OF_YES: dict[str, Tone] = {"RQ1": "harm", "RQ2": "mended"}
QUESTIONS = {
    "RQ1": "Does the persona make the ego fail?",
    "RQ2": "Does {doing} reduce the failures?",
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
BEFORE_HOLM_ONLY = "without correction, but not after Holm's correction"
NO_DIFFERENCE = "In each of the {pairs} pairs both games have the same result, so there is nothing to test."
NO_T_STATISTIC = "all {pairs} pairs have the same difference, so there is no t statistic"


@dataclass(frozen=True, kw_only=True)
class Answer:
    """One research question about one persona and training seed, answered by its failures."""

    seed: int
    yes: bool
    label: str
    tone: Tone
    sentence: str
    speed: str
    """The answer of average speed to the same question; empty when there is no such row."""

    @property
    def answered(self) -> bool:
        """Whether the question could be asked of the games at all."""
        return not self.label.startswith(NOT_ANSWERED)


@dataclass(frozen=True, kw_only=True)
class Conclusion:
    """One research question about one persona: the headline, and each seed's answer when there are several."""

    question: str
    label: str
    tone: Tone
    sentence: str
    speed: str
    per_seed: Sequence[Answer]

    @classmethod
    def of_one(cls, question: str, answer: Answer) -> Conclusion:
        """The headline where there is one answer only."""
        return cls(
            question=question,
            label=answer.label,
            tone=answer.tone,
            sentence=answer.sentence,
            speed=answer.speed,
            per_seed=(),
        )


def verdicts(
    question: str,
    persona: str,
    *,
    seeds: Sequence[int],
    rows: Sequence[Row],
    arms: Mapping[tuple[str, int], Row],
    significance: float | None,
    change: Change = RETRAINED,
    who: str = "",
) -> Conclusion:
    """Answer `question` for the training seeds it is asked of, by `rows`: its comparisons of this persona.

    `arms` are the rows of `summary` by arm and seed, `change` is the treatment of round 2, `who` is what the ego meets,
    if it is not one driver with the persona. A seed without rows is not answered yet.
    """
    who = who or f"the {persona} driver"
    answers = [
        _answer(question, persona, who, seed, [row for row in rows if row["seed"] == seed], arms, significance, change)
        for seed in seeds
    ]
    if not answers:
        sentence = NO_ROUND_2 if question == "RQ2" else NOT_COMPARED
        return Conclusion(question=question, label=NOT_ASKED, tone="open", sentence=sentence, speed="", per_seed=())
    return Conclusion.of_one(question, answers[0]) if len(answers) == 1 else _of_seeds(question, who, answers, change)


def _of_seeds(question: str, who: str, answers: Sequence[Answer], change: Change) -> Conclusion:
    yes, seeds = sum(answer.yes for answer in answers), len(answers)
    finding = {
        "RQ1": f"{who} makes the naive ego fail significantly more often than it does alone",
        "RQ2": f"{change.doing} makes the ego fail significantly less often against {who}",
    }[question]
    label = f"yes in {yes} of {seeds} seeds" if yes else f"not shown in any of {seeds} seeds"
    sentence = f"In {yes} of {seeds} training seeds {finding} (after Holm's correction)."
    if unanswered := [answer.label for answer in answers if not answer.answered]:
        if len(unanswered) == seeds:
            label, sentence = unanswered[0] if len(set(unanswered)) == 1 else NOT_ANSWERED, NO_SEED_ANSWERS
        else:
            sentence += f" In {len(unanswered)} of {seeds} it is not answered."
    return Conclusion(
        question=question,
        label=label,
        tone=TONE_OF_YES[question] if yes == seeds or (yes and question == "RQ1") else "open",
        sentence=sentence,
        speed="",
        per_seed=answers,
    )


def _answer(
    question: str,
    persona: str,
    who: str,
    seed: int,
    rows: Sequence[Row],
    arms: Mapping[tuple[str, int], Row],
    significance: float | None,
    change: Change,
) -> Answer:
    by_metric = {row["metric"]: row for row in rows}
    before_arm, after_arm = ARMS[question](persona, change)
    before, after = arms.get((before_arm, seed)), arms.get((after_arm, seed))
    unplayed = [arm for arm, row in ((before_arm, before), (after_arm, after)) if played(row) == 0]
    failure, speed = by_metric.get("failure"), by_metric.get("mean_speed")
    if unplayed or failure is None or before is None or after is None:
        sentence = arms_not_played(unplayed) if unplayed else FAILURES_NOT_COMPARED
        return Answer(seed=seed, yes=False, label=NOT_ANSWERED, tone="open", sentence=sentence, speed="")
    verdict = Verdict(failure["verdict"])
    if verdict in INCOMPETENT:
        return Answer(
            seed=seed, yes=False, label=LABELS[verdict], tone="open", sentence=as_sentence(failure["reason"]), speed=""
        )
    sentence = _failure_sentence(question, who, verdict, failure, before, after, change)
    if verdict is Verdict.ALL_EQUAL and significance is not None:
        sentence += _beside_significance(failure["mcnemar_p"], significance)
    speed_sentence = ""
    if speed is not None:
        speed_sentence = _speed_sentence(Verdict(speed["verdict"]), speed, before, after)
        if speed["pairs_left_out"] != failure["pairs_left_out"]:
            speed_sentence += left_out(speed)
    yes = verdict is Verdict.SIGNIFICANT
    return Answer(
        seed=seed,
        yes=yes,
        label=LABELS[verdict],
        tone=TONE_OF_YES[question] if yes else "open",
        sentence=sentence + left_out(failure),
        speed=speed_sentence,
    )


def arms_not_played(arms: Sequence[str]) -> str:
    """Which arms of a question are missing."""
    if len(arms) == 1:
        return f"The arm {arms[0]} was not played."
    return f"The arms {' and '.join(arms)} were not played."


def as_sentence(reason: str) -> str:
    """A reason for want of competence as a sentence."""
    return f"{reason[:1].upper()}{reason[1:]}."


def _beside_significance(p: float, significance: float) -> str:
    below = "below" if p < significance else "not below"
    return f" This is {below} the campaign's significance of {significance:g} (without correction)."


def _failure_sentence(
    question: str, who: str, verdict: Verdict, row: Row, before: Row, after: Row, change: Change
) -> str:
    was, now, tests, pairs = failures_of(before), failures_of(after), p_values(row), row["pairs"]
    if question == "RQ1":
        claim = f"{who[:1].upper()}{who[1:]} makes the naive ego fail in {now} games instead of {was}"
        counts = f"The naive ego fails in {now} games against {who} and in {was} alone"
        direction = "more often"
    else:
        claim = f"{change.doing.capitalize()} reduces the ego's failures against {who} "
        claim += f"from {was} games to {now}"
        counts = f"Against {who} the {change.made} ego fails in {now} games, the naive ego in {was}"
        direction = "less often"
    return {
        Verdict.SIGNIFICANT: f"{claim} ({tests}).",
        Verdict.BEFORE_HOLM_ONLY: f"{counts}: significantly {direction} {BEFORE_HOLM_ONLY} ({tests}).",
        Verdict.NOT_SIGNIFICANT: f"{counts}: not significantly {direction} ({tests}).",
        Verdict.NO_DIFFERENCE: f"{counts}. {NO_DIFFERENCE.format(pairs=pairs)}",
        Verdict.ALL_EQUAL: (
            f"{counts}; {NO_T_STATISTIC.format(pairs=pairs)}. McNemar's exact test gives {p_text(row['mcnemar_p'])}."
        ),
        Verdict.NOT_ENOUGH_PAIRS: f"{counts}, {too_few(pairs)}.",
    }[verdict]


def _speed_sentence(verdict: Verdict, row: Row, before: Row, after: Row) -> str:
    was, now = (number(arm["mean_speed_mps"], 1) for arm in (before, after))
    if was == now:
        was, now = (number(arm["mean_speed_mps"], 3) for arm in (before, after))
    direction = "slower" if row["question"] == "RQ1" else "faster"
    tests, pairs = p_values(row), row["pairs"]
    finding = {
        Verdict.SIGNIFICANT: f"significantly {direction} ({tests})",
        Verdict.BEFORE_HOLM_ONLY: f"significantly {direction} {BEFORE_HOLM_ONLY} ({tests})",
        Verdict.NOT_SIGNIFICANT: f"not significantly {direction} ({tests})",
        Verdict.NO_DIFFERENCE: f"equal in each of the {pairs} pairs",
        Verdict.ALL_EQUAL: NO_T_STATISTIC.format(pairs=pairs),
        Verdict.NOT_ENOUGH_PAIRS: too_few(pairs),
    }[verdict]
    return f"Average speed: {now}{NO_SPACE}m/s instead of {was}{NO_SPACE}m/s: {finding}."


def too_few(pairs: int) -> str:
    """Why there is no test of so few pairs."""
    count = {0: "no pair of games", 1: "only one pair of games"}.get(pairs, f"only {pairs} pairs of games")
    return f"but {count} could be compared: too few for a test"


def left_out(row: Row) -> str:
    """A sentence, with a space before it, on the pairs that are not in the test; empty when all are."""
    out = row["pairs_left_out"]
    if not out:
        return ""
    return f" {out} of {out + row['pairs']} pairs {'is' if out == 1 else 'are'} left out: not played or not measured."


def effect(row: Row) -> str:
    """The mean difference and its interval, worded by its sign, e.g. "25 points more failures"."""
    mean, low, high = row["mean_difference"], row["ci_low"], row["ci_high"]
    if not math.isfinite(mean):
        return MISSING
    failure = row["metric"] == "failure"
    scale, digits, unit = (100, 1, " points") if failure else (1, 2, f"{NO_SPACE}m/s")
    more_is_h1 = (row["question"] == "RQ1") == failure  # RQ1: fails more, drives slower; RQ2: the reverse
    rises = (mean > 0) == more_is_h1
    if mean < 0:
        low, high = -high, -low
    words = ("more failures", "fewer failures") if failure else ("faster", "slower")
    text = f"{trimmed(abs(mean) * scale, digits)}{unit} {words[0 if rises else 1]}"
    if mean == 0:
        text = "none"
    if math.isfinite(low):
        text += f" ({SURE}: {trimmed(low * scale, digits)} to {trimmed(high * scale, digits)})"
    return text


def p_values(row: Row) -> str:
    """The test's p-value without and with Holm's correction."""
    p, corrected = p_text(row["p_value"]), p_text(row["p_holm"])
    if not math.isfinite(row["p_holm"]) or row["p_holm"] == row["p_value"]:
        return p
    return f"{p}, also after Holm's correction" if corrected == p else f"{p}; {corrected} after Holm's correction"


def played(row: Row | None) -> int:
    """Games of an arm that could be played; none when the arm has no row."""
    return 0 if row is None else row["episodes"] - row["errors"]


def failures_of(row: Row) -> str:
    """E.g. "25 of 100"."""
    return f"{failures(row)} of {played(row)}"


def failures(row: Row) -> int:
    """How many games of the arm the ego failed."""
    return int(row["collisions"] + row["rails"] + row["timeouts"])
