"""What follows from the deaths of workers: another try, a game that is given up, or a stage that has failed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from harness.campaign.plan.stages import AssessmentStage, Stage

OnProgress = Callable[[int, int], None]
"""Told how much of a stage is done, and how much there is: steps or games."""
OnStart = Callable[[int], None]
"""Told of each segment of a training, and of each game of an arm, before it is gone about: if the process dies, it is
known what of."""


@dataclass(frozen=True)
class Attempt:
    """What became of a stage so far, in this run of the command."""

    first: bool = True
    """Games of an earlier run that could not be played are played again: what was wrong may have been mended."""
    abandoned: Mapping[int, str] = field(default_factory=dict)
    """Episodes that killed their worker too often, each with what is said of it."""


FIRST = Attempt()

TRIES = 3
"""So often one segment, or one game, may kill its worker."""
MOST_ABANDONED = 20
"""So many games of an arm may be given up in one run of the command: beyond it the scene is to blame, not a game."""


@dataclass(frozen=True)
class CrashResponse:
    """What a death means for its stage."""

    message: str
    stage_fails: bool = False


class Crashes:
    """Counts the deaths in each place of each stage: a segment of a training, a game of an arm, or the way there.

    Only those of this run of the command count: whoever kills the whole command accuses no game.
    """

    def __init__(self) -> None:
        self._begun: set[str] = set()
        self._place: dict[str, int] = {}
        self._farthest: dict[str, int] = {}
        self._counts: Counter[tuple[str, int | None]] = Counter()
        self._given_up: dict[str, dict[int, str]] = {}

    def attempt_at(self, stage: Stage) -> Attempt:
        """What a worker has to know who is handed a stage."""
        first = stage.id not in self._begun
        self._begun.add(stage.id)
        self._place.pop(stage.id, None)
        return Attempt(first, dict(self._given_up.get(stage.id, {})))

    def note_begin(self, stage: str, place: int) -> None:
        """A worker goes about a segment or a game."""
        self._place[stage] = place
        if place > self._farthest.get(stage, -1):  # it got on: deaths on the way there are forgotten
            self._farthest[stage] = place
            del self._counts[stage, None]

    def note(self, stage: Stage, cause: str) -> CrashResponse:
        """A worker has died of `cause`."""
        place = self._place.get(stage.id)
        self._counts[stage.id, place] += 1
        if self._counts[stage.id, place] < TRIES:
            return CrashResponse(cause)
        often = f"{cause}, {TRIES} times over"
        if place is None or not isinstance(stage, AssessmentStage):
            return CrashResponse(often, stage_fails=True)
        abandoned = self._given_up.setdefault(stage.id, {})
        abandoned[place] = often
        if len(abandoned) > MOST_ABANDONED:
            return CrashResponse(f"{len(abandoned)} games killed their worker; the last: {often}", stage_fails=True)
        return CrashResponse(f"{often} in game {place}, which is given up")
