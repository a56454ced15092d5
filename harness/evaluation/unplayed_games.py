"""Which games could be played; why others could not: their errors, those of one reason together."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import TYPE_CHECKING

from harness.wording import counted

if TYPE_CHECKING:
    import pandas as pd

SHOWN = 3
"""The most reasons that are told."""
_LONGEST = 500
_NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e[+-]?\d+)?")


def were_played(episodes: pd.DataFrame) -> pd.Series:
    """Which games could be played, for each row of `episodes`."""
    return (episodes["ego_outcome"] != "error") & (episodes["error"].fillna("") == "")


def reason_of(error: str) -> str:
    """The part of an error that games of one reason share: it without its numbers, such as steps and addresses."""
    return _NUMBER.sub("#", error)


def reasons_of(errors: Iterable[str]) -> list[str]:
    """A line for each reason, the most frequent first, with the number of its games and the first error of it."""
    groups: dict[str, list[str]] = {}
    for error in filter(None, errors):
        groups.setdefault(reason_of(error), []).append(error)
    ordered = sorted(groups.values(), key=len, reverse=True)
    lines = [f"{counted(len(group), 'game')}: {_shortened(group[0])}" for group in ordered[:SHOWN]]
    if others := sum(map(len, ordered[SHOWN:])):
        lines.append(f"{counted(others, 'game')}: other reasons, in the column error of episodes.csv")
    return lines


def _shortened(error: str) -> str:
    text = " ".join(error.split())
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]} …"
