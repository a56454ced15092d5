"""What follows from crashes of workers: another attempt, an abandoned game, or a failed stage."""

from __future__ import annotations

from collections import Counter

from harness.campaign.execution.stage_events import Event
from harness.campaign.execution.stage_run import Attempt
from harness.campaign.plan.stages import AssessmentStage, PreventabilityStage, Stage

MOST_CRASHES = 3
"""Crashes of one segment or game after which it is not tried again."""
MOST_ABANDONED = 20
"""Games of an arm that may be abandoned in one run of the command. With more, the scene is at fault and not a game."""


class Crashes:
    """Counts crashes by place: a segment of a training, a game of an arm, or the way there (None).

    Only the crashes of this run of the command count: where the whole command was killed, no game is to blame.
    """

    def __init__(self) -> None:
        self._attempted: set[str] = set()
        self._place: dict[str, int] = {}
        self._farthest: dict[str, int] = {}
        self._counts: Counter[tuple[str, int | None]] = Counter()
        self._abandoned: dict[str, dict[int, str]] = {}

    def next_attempt(self, stage: Stage) -> Attempt:
        """What the worker that gets a stage has to know."""
        first = stage.id not in self._attempted
        self._attempted.add(stage.id)
        self._place.pop(stage.id, None)
        return Attempt(first=first, abandoned=dict(self._abandoned.get(stage.id, {})))

    def note_start(self, stage: str, place: int) -> None:
        """A worker starts a segment, game or trial."""
        self._place[stage] = place
        if place > self._farthest.get(stage, -1):  # it got farther: crashes on the way there no longer count
            self._farthest[stage] = place
            del self._counts[stage, None]

    def note_crash(self, stage: Stage, cause: str) -> Event:
        """A worker crashed in a stage, of `cause`. Returns what this means for the stage: crashed, to be tried again,
        or failed."""
        place = self._place.get(stage.id)
        self._counts[stage.id, place] += 1
        if self._counts[stage.id, place] < MOST_CRASHES:
            return Event(kind="crashed", stage=stage.id, message=cause)
        often = f"{cause}, {MOST_CRASHES} times"
        if place is None or not isinstance(stage, AssessmentStage | PreventabilityStage):
            return Event(kind="failed", stage=stage.id, message=often)
        abandoned = self._abandoned.setdefault(stage.id, {})
        abandoned[place] = often
        if len(abandoned) > MOST_ABANDONED:
            message = f"{len(abandoned)} games crashed; the last: {often}"
            return Event(kind="failed", stage=stage.id, message=message)
        return Event(kind="crashed", stage=stage.id, message=f"{often} in game {place}, which is abandoned")
