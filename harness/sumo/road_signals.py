"""What varies on the roads of a simulation: the states of its traffic lights, the place in their cycles at which a game
starts, and the speed limits."""

from __future__ import annotations

from collections.abc import Sequence

import libsumo
import numpy as np
from libsumo import _libsumo  # the same functions without Python wrappers, for frequent calls

from harness.game.arrays import FloatArray, IntArray
from harness.game.junctions import SIGNALS, Signal
from harness.sumo.simulation import AtReset

_CODE = np.full(256, int(Signal.OFF), dtype=np.int8)  # by character; 'o' and 'O' are off
for _letter, _state in SIGNALS.items():
    _CODE[ord(_letter)] = _state


class Signals:
    """The signals of the `links` of traffic lights (id, index) in the tiles with these prefixes."""

    def __init__(self, prefixes: Sequence[str], links: Sequence[tuple[str, int]]) -> None:
        self._prefixes = prefixes
        self._lights = list(dict.fromkeys(name for name, _ in links))
        self._names = [[prefix + name for name in self._lights] for prefix in prefixes]
        self._links = [
            (np.array([column for column, link in enumerate(links) if link[0] == name]),
             np.array([link[1] for link in links if link[0] == name]))
            for name in self._lights
        ]  # fmt: skip
        self._states: dict[str, IntArray] = {}
        self._count = len(links)

    def __bool__(self) -> bool:
        return bool(self._lights)

    def read(self) -> IntArray:
        """[G, L] int8 states of the links (`Signal`)."""
        states = np.empty((len(self._prefixes), self._count), dtype=np.int8)
        for game in range(len(self._prefixes)):
            states[game] = self._of(game)
        return states

    def texts(self) -> tuple[str, ...]:
        """[G] the whole states of the lights, as `id=state` separated by spaces."""
        return tuple(self._text(game) for game in range(len(self._prefixes)))

    def _text(self, game: int) -> str:
        states = map(libsumo.trafficlight.getRedYellowGreenState, self._names[game])
        return " ".join(f"{name}={state}" for name, state in zip(self._lights, states, strict=True))

    def reset(self, game: int, share: float) -> AtReset:
        """Set the lights of a game to a place, from 0 to 1, in their cycles."""
        for name in self._names[game]:
            logic = self._programme(name)
            durations_s = np.array([phase.duration for phase in logic.phases])
            ends_s = np.cumsum(durations_s)
            time_s = share * ends_s[-1]
            phase = int(np.searchsorted(ends_s, time_s, side="right").clip(0, len(ends_s) - 1))
            libsumo.trafficlight.setPhase(name, phase)
            libsumo.trafficlight.setPhaseDuration(name, float(max(ends_s[phase] - time_s, 0.1)))
        since_s = np.zeros(self._count)
        for (columns, links), name in zip(self._links, self._names[game], strict=True):
            since_s[columns] = self._since_change_s(name, links, share)
        return AtReset(self._of(game), since_s, self._text(game))

    def _of(self, game: int) -> IntArray:
        row = np.zeros(self._count, dtype=np.int8)
        for (columns, links), name in zip(self._links, self._names[game], strict=True):
            row[columns] = self._codes(_libsumo.trafficlight_getRedYellowGreenState(name))[links]
        return row

    def _codes(self, state: str) -> IntArray:
        if state not in self._states:
            self._states[state] = _CODE[np.frombuffer(state.encode("latin-1"), dtype=np.uint8)]
        return self._states[state]

    def _programme(self, name: str) -> libsumo.TraCILogic:
        current = libsumo.trafficlight.getProgram(name)
        return next(each for each in libsumo.trafficlight.getAllProgramLogics(name) if each.programID == current)

    def _since_change_s(self, name: str, links: IntArray, share: float) -> FloatArray:
        """[n] seconds since each link's state changed, at a place in the cycle, if every phase has its full length."""
        phases = self._programme(name).phases
        ends_s = np.cumsum([phase.duration for phase in phases])
        time_s = share * ends_s[-1]
        now = int(np.searchsorted(ends_s, time_s, side="right").clip(0, len(ends_s) - 1))
        codes = np.array([self._codes(phase.state)[links] for phase in phases])
        since_s = np.full(len(links), time_s - (ends_s[now] - phases[now].duration))
        for link in range(len(links)):
            for back in range(1, len(phases)):
                phase = (now - back) % len(phases)
                if codes[phase, link] != codes[now, link]:
                    break
                since_s[link] += phases[phase].duration
        return since_s


class SpeedLimits:
    """The limits of all lanes in the tiles with these prefixes; they are read from SUMO before the first game."""

    def __init__(self, prefixes: Sequence[str]) -> None:
        self._lanes: list[list[tuple[str, float]]] = [[] for _ in prefixes]
        tiles = {prefix: tile for tile, prefix in enumerate(prefixes)}
        for lane in libsumo.lane.getIDList():
            inner = lane.removeprefix(":")
            prefix = inner[: inner.find("_") + 1] if len(prefixes) > 1 else ""
            self._lanes[tiles[prefix]].append((lane, libsumo.lane.getMaxSpeed(lane)))

    def reset(self, game: int, share: float) -> None:
        """Multiply the net's limits in a game's tile by a factor."""
        for lane, limit_mps in self._lanes[game]:
            libsumo.lane.setMaxSpeed(lane, limit_mps * share)
