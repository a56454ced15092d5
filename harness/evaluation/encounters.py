"""Encounters at junctions in a recorded game: a player and another road user pass the same zone of conflict."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from harness.game.arrays import BoolArray, FloatArray, IntArray
from harness.game.junctions import RightOfWay, Signal
from harness.game.meetings import (
    STANDING_MPS,
    Passage,
    Places,
    has_duty,
    other_passage,
    own_passage,
    places,
)
from harness.game.quantities import Quantities


@dataclass(frozen=True, kw_only=True)
class Encounter:
    """A player's passage of a zone of conflict, and that of another road user."""

    conflict: int  # row of `Conflicts`
    body: int  # index among the bodies
    own: Passage
    other: Passage | None
    """None if it never enters the zone."""
    must_yield: bool
    """The player, to the other, before the first of the two entered."""
    gap_s: float
    """The time that the other would need to the zone at constant speed when the player enters; inf if it stands or has
    left, 0 if it is inside."""


def encounters_of(q: Quantities, player: int, drove: BoolArray) -> list[Encounter]:
    """The encounters of a player, in the order in which it enters the zones.

    `q` are the quantities of one game, with its steps instead of games; `drove` [T] tells when the player drove.
    """
    if not len(q.world.right_of_way.conflicts.player) or not drove.any():
        return []
    found = list(_Search(q, player, drove).encounters())
    return sorted(found, key=lambda each: (each.own.enters_s, each.conflict, each.body))


@dataclass(frozen=True, eq=False)
class _Search:
    q: Quantities
    player: int
    drove: BoolArray

    @property
    def _tables(self) -> RightOfWay:
        return self.q.world.right_of_way

    @cached_property
    def _front_m(self) -> FloatArray:
        """[T] station of the player's front while it drove; NaN otherwise."""
        half_m = 0.5 * self.q.world.length_m[self.player]
        return np.where(self.drove, self.q.state.station_m[:, self.player] + half_m, np.nan)

    def encounters(self) -> Iterator[Encounter]:
        conflicts, q, length_m = self._tables.conflicts, self.q, float(self.q.world.length_m[self.player])
        speed_mps, offset_m = q.state.speed_mps[:, self.player], q.lateral_offset_m[:, self.player]
        there = Places(*places(tuple(q.bodies), tuple(self._tables.streams)))
        for c in np.flatnonzero(conflicts.player == self.player).tolist():
            zone_m = (conflicts.begin_m[c], conflicts.end_m[c])
            own = own_passage(self._front_m, speed_mps, zone_m, length_m=length_m, step_s=self.q.world.step_s)
            if own is None or not conflicts.right_m[c] <= offset_m[self._step_of(own)] <= conflicts.left_m[c]:
                continue
            in_stream = (there.stream == conflicts.stream[c]) & (there.body != self.player)
            for body in np.unique(there.body[in_stream]).tolist():
                rows = in_stream & (there.body == body)
                yield from self._encounter(c, own, body, there.step[rows], there.along_m[rows])

    def _step_of(self, own: Passage) -> int:
        """The first step in which the player is in the zone."""
        return min(int(np.ceil(own.enters_s / self.q.world.step_s - 1e-9)), len(self.drove) - 1)

    def _encounter(self, c: int, own: Passage, body: int, steps: IntArray, along_m: FloatArray) -> Iterator[Encounter]:
        q, conflicts = self.q, self._tables.conflicts
        speed_mps, length_m = q.bodies.speed_mps[steps, body], float(q.bodies.length_m[steps[0], body])
        on_stream = (along_m >= conflicts.from_m[c]) & (along_m <= conflicts.until_m[c])
        steps, along_m, speed_mps = steps[on_stream], along_m[on_stream], speed_mps[on_stream]
        if not len(steps) or not self._follows(c, body, steps, along_m, speed_mps):
            return
        zone_m = (conflicts.zone_m[c], conflicts.zone_m[c] + conflicts.length_m[c])
        other = other_passage(steps, along_m, speed_mps, zone_m, length_m=length_m, step_s=self.q.world.step_s)
        gap_s = self._gap_s(own, other, steps, conflicts.zone_m[c] - along_m - 0.5 * length_m, speed_mps)
        if other is not None or gap_s < np.inf:
            own_signal = self._signal(
                conflicts.own_link[c], self._front_m >= conflicts.stop_m[c], np.arange(len(q.state.step))
            )
            other_signal = self._signal(conflicts.other_link[c], along_m + 0.5 * length_m >= 0.0, steps)
            other_first = other is not None and other.enters_s <= own.enters_s
            must_yield = has_duty(self._tables.streams.conflicts[c], own_signal, other_signal, other_first)
            yield Encounter(conflict=c, body=body, own=own, other=other, must_yield=bool(must_yield), gap_s=gap_s)

    def _follows(self, c: int, body: int, steps: IntArray, along_m: FloatArray, speed_mps: FloatArray) -> bool:
        """Whether a body in the stream of conflict `c` in `steps` [N] follows it: it comes in before the junction, and
        does not leave it before the end of the zone. Its first and last step in the game are no such moments."""
        present, conflicts = self.q.bodies.present[:, body], self._tables.conflicts
        reach_m = speed_mps * self.q.world.step_s  # in a step
        there = np.flatnonzero(present)
        comes_in = along_m[0] <= reach_m[0] or steps[0] == there[0]
        end_m = min(conflicts.zone_m[c] + conflicts.length_m[c], conflicts.until_m[c])
        return bool(comes_in and (along_m[-1] + 2.0 * reach_m[-1] >= end_m or steps[-1] == there[-1]))

    def _gap_s(
        self, own: Passage, other: Passage | None, steps: IntArray, to_zone_m: FloatArray, speed_mps: FloatArray
    ) -> float:
        """The other's time to the zone when the player enters, from its distances and speeds in `steps` [N]."""
        there = np.flatnonzero(steps == self._step_of(own))
        if (other is not None and other.leaves_s <= own.enters_s) or not len(there):
            return np.inf
        to_m, speed = float(to_zone_m[there[0]]), float(speed_mps[there[0]])
        return 0.0 if to_m <= 0.0 else (to_m / speed if speed > STANDING_MPS else np.inf)

    def _signal(self, link: int, passed: BoolArray, steps: IntArray) -> int:
        """The state of a link when a side passed its stop line: in the first of `steps` [N] with `passed` [N], else in
        the last of them; off without a signal."""
        signals = self.q.state.signals
        if link < 0 or link >= signals.shape[1] or not len(steps):
            return int(Signal.OFF)
        entries = np.flatnonzero(passed)
        return int(signals[steps[entries[0] if len(entries) else -1], link])
