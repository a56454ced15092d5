"""Differences between two arms in words: of average speed, and the statistics of a test.

A difference of average speed is judged in both directions, whatever the question asks, and by its size: a difference
whose 95 % interval lies within `RELEVANT_SPEED_MPS` of 0 is no relevant difference, however small its p-value is. This
is an equivalence test by two one-sided tests (TOST: D. J. Schuirmann, J. Pharmacokinet. Biopharm. 15, 1987) at a
significance of 2.5 % each.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from harness.evaluation.comparisons.comparison import METRICS, SHARES
from harness.evaluation.competence import Verdict
from harness.reports.numbers import MISSING, NO_SPACE, SURE, number, p_text, signed, trimmed
from harness.reports.run_tables import Row


class MetricWords(NamedTuple):
    """A quantity that comparisons.csv compares, in words."""

    name: str
    more: str
    less: str
    unit: str = ""
    """Empty: a share of games."""


METRIC_WORDS = {
    "failure": MetricWords("failures", "more failures", "fewer failures"),
    "mean_speed": MetricWords("average speed", "faster", "slower", "m/s"),
    "person_failure": MetricWords("failures of people", "more failures of people", "fewer failures of people"),
    "bystander_failure": MetricWords(
        "failures of bystanders", "more failures of bystanders", "fewer failures of bystanders"
    ),
    "follower_braking": MetricWords(
        "strongest braking of the follower", "harder braking of the follower", "gentler braking of the follower", "m/s²"
    ),
}
"""By their `metric`."""
RELEVANT_SPEED_MPS = 0.25
"""The smallest difference of average speed that counts: just under 1 km/h, the step of a car's speedometer."""
CHANCE = "the difference can be chance"
NO_RELEVANT_DIFFERENCE = "no relevant difference"


def speed_sentence(row: Row, before: Row, after: Row, significance: float | None) -> str:
    """What happened to the average speed: `row` of `comparisons`, and the rows of `summary` of its two arms."""
    was, now = (number(arm["mean_speed_mps"], 1) for arm in (before, after))
    if was == now:
        was, now = (number(arm["mean_speed_mps"], 2) for arm in (before, after))
    finding = _speed_finding(row, significance)
    return f"Average speed: {now}{NO_SPACE}m/s instead of {was}{NO_SPACE}m/s: {finding}."


def _speed_finding(row: Row, significance: float | None) -> str:
    verdict, pairs = Verdict(row["verdict"]), row["pairs"]
    if verdict is Verdict.NOT_ENOUGH_PAIRS:
        return too_few(pairs)
    if verdict is Verdict.NO_DIFFERENCE:
        return f"equal in each of the {pairs} pairs"
    if is_equivalent(row):
        return f"{NO_RELEVANT_DIFFERENCE} (less than {RELEVANT_SPEED_MPS:g}{NO_SPACE}m/s)"
    if verdict is Verdict.ALL_EQUAL:
        return f"all {pairs} pairs have the same difference, so there is no t statistic"
    if significance is not None and two_sided_p(row) < significance:
        return "faster" if faster_by(row) > 0 else "slower"
    return CHANCE


def faster_by(row: Row) -> float:
    """By how much the second arm is faster, in m/s; negative: slower. `mean_difference` of RQ1 counts slower arms."""
    return -row["mean_difference"] if row["question"] == "RQ1" else row["mean_difference"]


def two_sided_p(row: Row) -> float:
    """The p-value of a difference in either direction, from that of the one-tailed t-test; NaN without a test."""
    p: float = row["p_value"]
    return min(1.0, 2.0 * min(p, 1.0 - p)) if math.isfinite(p) else math.nan


def is_equivalent(row: Row) -> bool:
    """Whether the 95 % interval of a difference of speed lies within the smallest relevant one. Where all pairs have
    the same difference, that difference is the interval."""
    ends = [row[name] for name in ("ci_low", "ci_high")]
    if not all(map(math.isfinite, ends)):
        ends = [row["mean_difference"]]
    return all(abs(end) < RELEVANT_SPEED_MPS for end in ends)


def statistics(row: Row) -> str:
    """A test of `comparisons` as one line: effect, interval and p-values."""
    parts, name = [effect(row), p_values(row)], METRIC_WORDS[row["metric"]].name
    if row["metric"] in SHARES:
        parts.append(f"McNemar’s exact test {p_text(row['mcnemar_p'])}")
    else:
        parts.append(f"in either direction {p_text(two_sided_p(row))}")
    return f"{name[:1].upper()}{name[1:]}: {'; '.join(parts)}."


def too_few(pairs: int) -> str:
    """Why there is no test of so few pairs."""
    count = {0: "no pair of games", 1: "only one pair of games"}.get(pairs, f"only {pairs} pairs of games")
    return f"but {count} could be compared: too few for a test"


def effect(row: Row) -> str:
    """The mean difference and its interval, worded by its sign, e.g. "25 points more failures". The interval has the
    direction of the words: an end below 0 is in the other direction."""
    mean, low, high = row["mean_difference"], row["ci_low"], row["ci_high"]
    if not math.isfinite(mean):
        return MISSING
    words = METRIC_WORDS[row["metric"]]
    scale, digits, unit = (1, 2, f"{NO_SPACE}{words.unit}") if words.unit else (100, 1, " points")
    more_is_h1 = METRICS[row["metric"]][1][row["question"]] > 0
    rises = (mean > 0) == more_is_h1
    if mean < 0:
        low, high = -high, -low
    text = f"{trimmed(abs(mean) * scale, digits)}{unit} {words.more if rises else words.less}"
    if mean == 0:
        text = "none"
    if math.isfinite(low):
        text += f" ({SURE}: {signed(low * scale, digits)} to {signed(high * scale, digits)})"
    return text


def p_values(row: Row) -> str:
    """The test's p-value without and with Holm's correction."""
    p, corrected = p_text(row["p_value"]), p_text(row["p_holm"])
    if not math.isfinite(row["p_holm"]) or row["p_holm"] == row["p_value"]:
        return p
    return f"{p}, also after Holm's correction" if corrected == p else f"{p}; {corrected} after Holm's correction"
