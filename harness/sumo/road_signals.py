"""What varies on the roads of a simulation: the states of its traffic lights, the place in their cycles at which a game
starts, and the speed limits."""

from __future__ import annotations

from collections.abc import Sequence

import libsumo
import numpy as np
from libsumo import _libsumo  # the same functions without Python wrappers, for frequent calls

from harness.game.arrays import IntArray
from harness.game.junctions import SIGNALS, Signal
from harness.sumo.simulation import AtReset

_CODES = {letter: int(state) for letter, state in SIGNALS.items()}  # arrays of plain integers are made faster
_OFF = int(Signal.OFF)


class Signals:
    """The signals of the `links` of traffic lights (id, index) in the tiles with these prefixes."""

    def __init__(self, prefixes: Sequence[str], links: Sequence[tuple[str, int]]) -> None:
        self._prefixes, self._count = prefixes, len(links)
        self._links: dict[str, list[tuple[int, int]]] = {}  # by light: column of the table, and index of the link
        for column, (light, link) in enumerate(links):
            self._links.setdefault(light, []).append((column, link))

    def __bool__(self) -> bool:
        return bool(self._links)

    def read(self) -> IntArray:
        """[G, L] int8 states of the links (`Signal`)."""
        return np.array([self._of(prefix) for prefix in self._prefixes], dtype=np.int8)

    def texts(self) -> tuple[str, ...]:
        """[G] the whole states of the lights, as `id=state` separated by spaces."""
        return tuple(map(self._text, self._prefixes))

    def reset(self, game: int, share: float) -> AtReset:
        """Set the lights of a game to a place, from 0 to 1, in their cycles."""
        prefix, since_s = self._prefixes[game], np.zeros(self._count)
        for light, links in self._links.items():
            phases = _phases(prefix + light)
            ends_s = np.cumsum([phase.duration for phase in phases])
            time_s = share * ends_s[-1]
            now = int(np.searchsorted(ends_s, time_s, side="right").clip(0, len(ends_s) - 1))
            libsumo.trafficlight.setPhase(prefix + light, now)
            libsumo.trafficlight.setPhaseDuration(prefix + light, float(max(ends_s[now] - time_s, 0.1)))
            for column, link in links:
                since_s[column] = time_s - (ends_s[now] - phases[now].duration) + _unchanged_s(phases, now, link)
        return AtReset(np.array(self._of(prefix), dtype=np.int8), since_s, self._text(prefix))

    def _text(self, prefix: str) -> str:
        return " ".join(f"{light}={_state(prefix + light)}" for light in self._links)

    def _of(self, prefix: str) -> list[int]:
        row = [0] * self._count
        for light, links in self._links.items():
            state = _state(prefix + light)
            for column, link in links:
                row[column] = _CODES.get(state[link], _OFF)
        return row


def _state(light: str) -> str:
    state: str = _libsumo.trafficlight_getRedYellowGreenState(light)
    return state


def _phases(light: str) -> Sequence[libsumo.TraCIPhase]:
    current = libsumo.trafficlight.getProgram(light)
    programmes = libsumo.trafficlight.getAllProgramLogics(light)
    return next(each.phases for each in programmes if each.programID == current)


def _unchanged_s(phases: Sequence[libsumo.TraCIPhase], now: int, link: int) -> float:
    """Seconds before the phase `now` for which a link had its state, if every phase has its full length."""
    states = [_CODES.get(phase.state[link], _OFF) for phase in phases]
    seconds = 0.0
    for back in range(1, len(phases)):
        phase = (now - back) % len(phases)
        if states[phase] != states[now]:
            break
        seconds += phases[phase].duration
    return seconds


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
