"""A try at a stage: what whoever carries it out is told of the tries before, and what it tells meanwhile."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

Report = Callable[[int, int], None]
"""Told how much of a stage is done, and how much there is: steps or games."""
Begin = Callable[[int], None]
"""Told of each segment of a training, and of each game of an arm, before it is gone about: if the process dies, it is
known what of."""


@dataclass(frozen=True)
class Attempt:
    """What became of a stage so far, in this run of the command."""

    first: bool = True
    """Games of an earlier run that could not be played are played again: what was wrong may have been mended."""
    given_up: Mapping[int, str] = field(default_factory=dict)
    """Episodes that killed their worker too often, each with what is said of it."""


FIRST = Attempt()
