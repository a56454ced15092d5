"""Numbers as words: the answers to RQ1 and RQ2, taken from rows of `comparisons` and `summary` alone.

A label says "yes" only for `Verdict.SIGNIFICANT`. Everything else says what is missing for a yes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from harness.evaluation.comparison import Verdict
from harness.reports.treatment import ARMS, RETRAINED, Change

Row = Mapping[Any, Any]
Number = Callable[[float], str]
Tone = Literal["harm", "mended", "open"]
"""RQ1 yes, in any seed: the persona hurts the ego. RQ2 yes, in all: retraining mends it. All else is open."""

NO_SPACE = "\N{NO-BREAK SPACE}"
MINUS = "\N{MINUS SIGN}"
TONE_OF_YES: dict[str, Tone] = {"RQ1": "harm", "RQ2": "mended"}

LABELS = {
    Verdict.SIGNIFICANT: "yes",
    Verdict.BEFORE_HOLM_ONLY: "only before Holm's correction",
    Verdict.NOT_SIGNIFICANT: "not shown",
    Verdict.NO_DIFFERENCE: "no difference",
    Verdict.ALL_EQUAL: "no t statistic",
    Verdict.NOT_ENOUGH_PAIRS: "not answered",
}


@dataclass(frozen=True)
class Answer:
    """One research question, of one persona and training seed, answered by its failures."""

    seed: int
    yes: bool
    label: str
    tone: Tone
    sentence: str
    speed: str
    """What average speed says to the same question; empty when there is no such row."""


@dataclass(frozen=True)
class Conclusion:
    """One research question of one persona: the headline, and each seed's answer when there are several."""

    question: str
    label: str
    tone: Tone
    sentence: str
    speed: str
    per_seed: Sequence[Answer]


def verdicts(
    question: str,
    persona: str,
    seeds: Sequence[int],
    rows: Sequence[Row],
    arms: Mapping[tuple[str, int], Row],
    significance: float | None,
    change: Change = RETRAINED,
) -> Conclusion:
    """Answer `question` for the training seeds it is asked of, by `rows`: its comparisons of this persona.

    `arms` are the rows of `summary` by arm and seed, `change` what round 2 does. A seed without rows is not answered yet.
    """
    answers = [
        _answer(question, persona, seed, [row for row in rows if row["seed"] == seed], arms, significance, change)
        for seed in seeds
    ]
    if not answers:
        what = "Round 2 was not played: there is nothing to train or to tune in this ego."
        what = what if question == "RQ2" else "Not compared."
        return Conclusion(question, "not asked", "open", what, "", ())
    if len(answers) == 1:
        (only,) = answers
        return Conclusion(question, only.label, only.tone, only.sentence, only.speed, ())
    yes, several = sum(answer.yes for answer in answers), len(answers)
    if question == "RQ1":
        finding = f"the {persona} driver makes the naive ego fail significantly more often than it does alone"
    else:
        finding = f"{change.doing} makes the ego fail significantly less often against the {persona} driver"
    label = f"yes in {yes} of {several} seeds" if yes else f"not shown in any of {several} seeds"
    return Conclusion(
        question,
        "not answered" if all(answer.label == "not answered" for answer in answers) else label,
        TONE_OF_YES[question] if yes == several or (yes and question == "RQ1") else "open",
        f"In {yes} of {several} training seeds {finding} (after Holm's correction).",
        "",
        answers,
    )


def _answer(
    question: str,
    persona: str,
    seed: int,
    rows: Sequence[Row],
    arms: Mapping[tuple[str, int], Row],
    significance: float | None,
    change: Change,
) -> Answer:
    by_metric = {row["metric"]: row for row in rows}
    before_arm, after_arm = ARMS[question](persona, change)
    before, after = arms.get((before_arm, seed)), arms.get((after_arm, seed))
    missing = [arm for arm, row in ((before_arm, before), (after_arm, after)) if played(row) == 0]
    failure = by_metric.get("failure")
    if missing or failure is None or before is None or after is None:
        lacking = "The failures were not compared"
        if missing:
            lacking = f"The arm {missing[0]} was" if len(missing) == 1 else f"The arms {' and '.join(missing)} were"
            lacking += " not played"
        return Answer(seed, False, "not answered", "open", f"{lacking}.", "")
    verdict = Verdict(failure["verdict"])
    sentence = _failure_sentence(question, persona, verdict, failure, before, after, change)
    if verdict is Verdict.ALL_EQUAL and significance is not None:
        below = "below" if failure["mcnemar_p"] < significance else "not below"
        sentence += f" That is {below} the campaign's significance of {significance:g} (no correction applied)."
    speed = by_metric.get("mean_speed")
    beside = ""
    if speed is not None:
        beside = _speed_sentence(Verdict(speed["verdict"]), speed, before, after)
        if speed["pairs_left_out"] != failure["pairs_left_out"]:
            beside += left_out(speed)
    yes = verdict is Verdict.SIGNIFICANT
    tone: Tone = TONE_OF_YES[question] if yes else "open"
    return Answer(seed, yes, LABELS[verdict], tone, sentence + left_out(failure), beside)


def _failure_sentence(question: str, persona: str, verdict: Verdict, row: Row, before: Row, after: Row, change: Change) -> str:
    was, now = failures_of(before), failures_of(after)
    ps = p_values(row)
    if question == "RQ1":
        claim = f"The {persona} driver makes the naive ego fail in {now} games instead of {was}"
        plain = f"The naive ego fails in {now} games against the {persona} driver and in {was} alone"
        direction = "more often"
    else:
        claim = f"{change.doing.capitalize()} brings the ego's failures against the {persona} driver down to {now} games from {was}"
        plain = f"Against the {persona} driver the {change.made} ego fails in {now} games, the naive ego in {was}"
        direction = "less often"
    pairs = row["pairs"]
    return {
        Verdict.SIGNIFICANT: f"{claim} ({ps}).",
        Verdict.BEFORE_HOLM_ONLY: (
            f"{plain}: significantly {direction} by itself, but not after Holm's correction ({ps})."
        ),
        Verdict.NOT_SIGNIFICANT: f"{plain}: not significantly {direction} ({ps}).",
        Verdict.NO_DIFFERENCE: (
            f"{plain}. In each of the {pairs} pairs both games ended alike, so there is nothing to test."
        ),
        Verdict.ALL_EQUAL: (
            f"{plain}. All {pairs} pairs differ alike, so the t-test does not exist; McNemar's exact test, "
            f"which does, gives {p_text(row['mcnemar_p'])}."
        ),
        Verdict.NOT_ENOUGH_PAIRS: f"{plain}, {_too_few(pairs)}.",
    }[verdict]


def _speed_sentence(verdict: Verdict, row: Row, before: Row, after: Row) -> str:
    was, now = (number(arm["mean_speed_mps"], 1) for arm in (before, after))
    if was == now:
        was, now = (number(arm["mean_speed_mps"], 3) for arm in (before, after))
    speeds = f"Average speed: {now}{NO_SPACE}m/s instead of {was}{NO_SPACE}m/s"
    slower = row["question"] == "RQ1"
    direction = "slower" if slower else "faster"
    ps, pairs = p_values(row), row["pairs"]
    words = {
        Verdict.SIGNIFICANT: f"significantly {direction} ({ps})",
        Verdict.BEFORE_HOLM_ONLY: (f"significantly {direction} by itself, but not after Holm's correction ({ps})"),
        Verdict.NOT_SIGNIFICANT: f"not significantly {direction} ({ps})",
        Verdict.NO_DIFFERENCE: f"equal in each of the {pairs} pairs",
        Verdict.ALL_EQUAL: f"all {pairs} pairs differ alike, so the t-test does not exist",
        Verdict.NOT_ENOUGH_PAIRS: _too_few(pairs),
    }
    return f"{speeds}: {words[verdict]}."


def _too_few(pairs: int) -> str:
    some = {0: "no pair of games", 1: "only one pair of games"}.get(pairs, f"only {pairs} pairs of games")
    return f"but {some} could be compared: too few for a test"


def left_out(row: Row) -> str:
    """A sentence, with a space before it, on the pairs that are not in the test; empty when all are."""
    out = row["pairs_left_out"]
    if not out:
        return ""
    are = "is" if out == 1 else "are"
    return f" {out} of {out + row['pairs']} pairs {are} left out: not played or not measured."


def effect(row: Row) -> str:
    """The mean difference and its interval in words that hold for its sign, e.g. "25 points more failures"."""
    mean, low, high = row["mean_difference"], row["ci_low"], row["ci_high"]
    if not math.isfinite(mean):
        return "–"
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
        text += f" (95{NO_SPACE}%: {trimmed(low * scale, digits)} to {trimmed(high * scale, digits)})"
    return text


def p_values(row: Row) -> str:
    """The test's p-value, and what Holm's correction makes of it."""
    p, corrected = p_text(row["p_value"]), p_text(row["p_holm"])
    if not math.isfinite(row["p_holm"]) or row["p_holm"] == row["p_value"]:
        return p
    if corrected == p:
        return f"{p}, also after Holm's correction"
    return f"{p}; {corrected} after Holm's correction"


def p_text(p: float) -> str:
    """A p-value with its sign, never rounded to 0 or 1."""
    if not math.isfinite(p):
        return "no p-value"
    return f"p{NO_SPACE}{p_number(p) if p_number(p)[0] in '<>' else f'={NO_SPACE}{p_number(p)}'}"


def p_number(p: float) -> str:
    """A p-value to three digits; "< 0.0001" and "> 0.999" at the ends."""
    if not math.isfinite(p):
        return "–"
    if p < 0.0001:
        return f"<{NO_SPACE}0.0001"
    if 0.999 < p < 1:
        return f">{NO_SPACE}0.999"
    return f"{p:.4f}".rstrip("0") if p < 0.001 else f"{p:.3g}"


def played(row: Row | None) -> int:
    """Games of an arm that could be played; none when the arm has no row."""
    return 0 if row is None else row["episodes"] - row["errors"]


def failures_of(row: Row) -> str:
    """E.g. "25 of 100"."""
    return f"{failures(row)} of {played(row)}"


def failures(row: Row) -> int:
    """How many of the arm's games the ego failed."""
    return int(row["collisions"] + row["rails"] + row["timeouts"])


def percent(share: float) -> str:
    """A share as per cent, with a decimal where it has one."""
    return f"{trimmed(share * 100, 1)}{NO_SPACE}%" if math.isfinite(share) else "–"


def interval(low: float, high: float) -> str:
    """Two shares as per cent, e.g. "16.9–34.7 %"."""
    if not (math.isfinite(low) and math.isfinite(high)):
        return "–"
    return f"{trimmed(low * 100, 1)}–{trimmed(high * 100, 1)}{NO_SPACE}%"


def number(value: float, digits: int) -> str:
    """A number with a minus that is one; "–" when it can't be measured."""
    if not math.isfinite(value):
        return "–"
    text = f"{value:,.{digits}f}"
    if not text.strip("-0.,"):  # no negative zero
        text = text.lstrip("-")
    return text.replace("-", MINUS)


def trimmed(value: float, digits: int) -> str:
    """The same without zeros at the end of a fraction."""
    text = number(value, digits)
    return text.rstrip("0").rstrip(".") if "." in text else text
