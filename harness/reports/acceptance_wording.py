"""The acceptance checks of a campaign in words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from harness.evaluation.comparisons.acceptance_checks import Check, worst_of_each
from harness.reports.numbers import MISSING, NO_SPACE, SURE, number, percent

PASS, FAIL = "PASS", "FAIL"
TITLES = {
    "failure_rate": "failures",
    "failure_rate_alone": "failures without the non-ego",
    "preventable_failure_rate": "preventable failures",
    "near_miss_rate": "near misses",
    "harm_to_others_rate": "harm to others",
    "speed_loss_mps": "average speed lost",
    "gap_share": "best-response gap of the ego",
}
"""What each bound limits."""


@dataclass(frozen=True, kw_only=True)
class Line:
    """One acceptance check as one line of text."""

    passed: bool
    title: str
    """What is limited, and for whom."""
    who: str
    """The persona; with several training seeds, with the seed."""
    sentence: str
    """What was measured, and the bound."""
    measured: bool = True

    @property
    def text(self) -> str:
        return f"{PASS if self.passed else FAIL}  {self.title}: {self.sentence}".replace(NO_SPACE, " ")


def acceptance_lines(checks: Sequence[Check], seeds: int) -> list[Line]:
    """A line for each bound and persona: that of its worst arm and seed. With several training seeds it names its
    seed."""
    lines = []
    for check in worst_of_each(checks):
        who = f"{check.persona}, seed {check.seed}" if seeds > 1 else check.persona
        title, words = f"{TITLES[check.bound]}, {who}", sentence(check)
        lines.append(Line(passed=check.passed, title=title, who=who, sentence=words, measured=check.measured))
    return lines


def sentence(check: Check) -> str:
    """What was measured and where, the end of the interval, the bound, and what the value is made of."""
    if not check.measured:
        reason = check.detail or ("" if check.games else f"{check.arm} was not played")
        return f"not measured: {reason}" if reason else "not measured"
    value, limit, allowed = (_value(check.bound, each) for each in (check.value, check.limit, check.allowed))
    words = (
        f"{value} in {check.games:,} games of {check.arm}; with {SURE} confidence at most {limit}; allowed: {allowed}"
    )
    return f"{words}; {check.detail}" if check.detail else words


def by_sentence(lines: Sequence[Line]) -> list[Line]:
    """The lines, those that say the same in one: its title names them all."""
    alike: dict[tuple[bool, str], list[Line]] = {}
    for line in lines:
        alike.setdefault((line.passed, line.sentence), []).append(line)
    bounds = Counter(line.who for line in lines)
    return [replace(same[0], title="; ".join(_titles(same, bounds))) for same in alike.values()]


def _titles(lines: Sequence[Line], bounds: Mapping[str, int]) -> Iterator[str]:
    """The titles of lines; of somebody whose `bounds` are all among them, one title."""
    among = Counter(line.who for line in lines)
    whole = {who for who, count in among.items() if count == bounds[who] > 1}
    yield from (f"all bounds, {who}" for who in among if who in whole)
    yield from (line.title for line in lines if line.who not in whole)


def headline(checks: Sequence[Check]) -> str:
    broken = sum(not check.passed for check in checks)
    if not broken:
        return f"{PASS}: the ego keeps every bound of the campaign"
    return f"{FAIL}: the ego does not keep {broken} of {len(checks)} bounds"


def _value(bound: str, value: float) -> str:
    if value != value:
        return MISSING
    return f"{number(value, 2)}{NO_SPACE}m/s" if bound.endswith("_mps") else percent(value)
