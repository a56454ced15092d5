"""Why games could not be played: their errors, those of one reason together."""

from __future__ import annotations

import re
from collections.abc import Iterable

SHOWN = 3
"""The most reasons that are told."""
_LONGEST = 500
_NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e[+-]?\d+)?")


def reason_of(error: str) -> str:
    """The part of an error that games of one reason share: it without its numbers, such as steps and addresses."""
    return _NUMBER.sub("#", error)


def reasons_of(errors: Iterable[str]) -> list[str]:
    """A line for each reason, the most frequent first, with the number of its games and the first error of it."""
    first, counts = dict[str, str](), dict[str, int]()
    for error in filter(None, errors):
        reason = reason_of(error)
        first.setdefault(reason, error)
        counts[reason] = counts.get(reason, 0) + 1
    ordered = sorted(counts, key=lambda reason: -counts[reason])
    lines = [f"{_games(counts[each])}: {_shortened(first[each])}" for each in ordered[:SHOWN]]
    if more := ordered[SHOWN:]:
        others = _games(sum(counts[each] for each in more))
        lines.append(f"{others}: other reasons, in the column error of episodes.csv")
    return lines


def _games(count: int) -> str:
    return f"{count} game{'' if count == 1 else 's'}"


def _shortened(error: str) -> str:
    text = " ".join(error.split())
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]} …"
