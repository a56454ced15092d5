"""What varies on the roads of a simulation: the states of its traffic lights, the place in their cycles at which a game
starts, and the speed limits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import libsumo
import numpy as np
from libsumo import _libsumo  # the same functions without Python wrappers, for frequent calls

from harness.game.arrays import FloatArray, IntArray
from harness.game.junctions import SIGNALS, Signal
from harness.sumo.simulation import AtReset

_CODES = {letter: int(state) for letter, state in SIGNALS.items()}  # arrays of plain integers are made faster
_OFF = int(Signal.OFF)


class Signals:
    """The signals of the `links` of traffic lights (id, index) in the tiles with these prefixes."""

    def __init__(self, prefixes: Sequence[str], links: Sequence[tuple[str, int]]) -> None:
        self._prefixes = prefixes
        of_light: dict[str, list[tuple[int, int]]] = {}
        for column, (light, link) in enumerate(links):
            of_light.setdefault(light, []).append((column, link))
        self._lights = [_Light(name, *zip(*columns, strict=True)) for name, columns in of_light.items()]
        self._names = [prefix + light.name for prefix in prefixes for light in self._lights]
        self._texts = [""] * len(self._names)  # states of the lights when they were read last
        self._states = np.zeros((len(prefixes), len(links)), dtype=np.int8)  # of the links then
        self._programmes: dict[tuple[str, str], _Programme] = {}  # by light and programme, those of fixed lengths

    def __bool__(self) -> bool:
        return bool(self._lights)

    def read(self) -> IntArray:
        """[G, L] int8 states of the links (`Signal`)."""
        self._read(0, len(self._names))
        return self._states.copy()

    def texts(self) -> tuple[str, ...]:
        """[G] the whole states of the lights, as `id=state` separated by spaces."""
        return tuple(map(self._text, self._prefixes))

    def reset(self, game: int, share: float) -> AtReset:
        """Set the lights of a game to a place, from 0 to 1, in their cycles."""
        prefix, since_s = self._prefixes[game], np.zeros(self._states.shape[1])
        for light in self._lights:
            name = prefix + light.name
            programme = self._programme(name, light)
            ends_s, lengths_s = programme.ends_s, programme.lengths_s
            time_s = share * ends_s[-1]
            now = int(np.searchsorted(ends_s, time_s, side="right").clip(0, len(ends_s) - 1))
            libsumo.trafficlight.setPhase(name, now)
            libsumo.trafficlight.setPhaseDuration(name, float(max(ends_s[now] - time_s, 0.1)))
            since_s[list(light.columns)] = time_s - (ends_s[now] - lengths_s[now]) + programme.unchanged_s[now]
        first = game * len(self._lights)
        self._read(first, first + len(self._lights))
        return AtReset(self._states[game].copy(), since_s, self._text(prefix))

    def _text(self, prefix: str) -> str:
        return " ".join(f"{light.name}={_state(prefix + light.name)}" for light in self._lights)

    def _read(self, first: int, end: int) -> None:
        """Read the lights from `first` to before `end`. Most have not changed."""
        texts = list(map(_state, self._names[first:end]))
        for place, (now, before) in enumerate(zip(texts, self._texts[first:end], strict=True), first):
            if now != before:
                game, light = place // len(self._lights), self._lights[place % len(self._lights)]
                self._states[game, list(light.columns)] = _codes(now, light.links)
        self._texts[first:end] = texts

    def _programme(self, name: str, light: _Light) -> _Programme:
        """The current programme of a light. The phases of one with fixed lengths are read once."""
        current = libsumo.trafficlight.getProgram(name)
        if (name, current) in self._programmes:
            return self._programmes[name, current]
        logics = libsumo.trafficlight.getAllProgramLogics(name)
        logic = next(each for each in logics if each.programID == current)
        programme = _Programme.of(logic.phases, light.links)
        if logic.type == libsumo.TRAFFICLIGHT_TYPE_STATIC:
            self._programmes[name, current] = programme
        return programme


class _Light(NamedTuple):
    """A traffic light: its id, and the columns and indices of its links."""

    name: str
    columns: tuple[int, ...]
    links: tuple[int, ...]


class _Programme(NamedTuple):
    """The cycle of a traffic light with N phases, for K of its links."""

    ends_s: FloatArray  # [N] when each phase ends
    lengths_s: FloatArray  # [N]
    unchanged_s: FloatArray  # [N, K] for how long a link has had its state when a phase begins

    @classmethod
    def of(cls, phases: Sequence[libsumo.TraCIPhase], links: Sequence[int]) -> _Programme:
        """The programme with these phases, of which each has its full length."""
        lengths_s = [phase.duration for phase in phases]
        of_links = [list(each) for each in zip(*(_codes(phase.state, links) for phase in phases), strict=True)]
        unchanged_s = [[_unchanged_s(states, lengths_s, now) for states in of_links] for now in range(len(phases))]
        return cls(np.cumsum(lengths_s), np.array(lengths_s), np.array(unchanged_s))


_state = _libsumo.trafficlight_getRedYellowGreenState


def _codes(text: str, links: Sequence[int]) -> list[int]:
    """The states of links of a light, from the text of its state."""
    return [_CODES.get(text[link], _OFF) for link in links]


def _unchanged_s(states: Sequence[int], lengths_s: Sequence[float], now: int) -> float:
    """Seconds before the phase `now` for which a link with these states had its state."""
    seconds = 0.0
    for back in range(1, len(states)):
        phase = (now - back) % len(states)
        if states[phase] != states[now]:
            break
        seconds += lengths_s[phase]
    return seconds


class SpeedLimits:
    """The limits of all lanes in the tiles with these prefixes; they are read from SUMO before the first game."""

    def __init__(self, prefixes: Sequence[str]) -> None:
        self._lanes: list[list[tuple[str, float]]] = [[] for _ in prefixes]
        tiles = {prefix: tile for tile, prefix in enumerate(prefixes)}
        for lane in libsumo.lane.getIDList():
            inner = lane.removeprefix(":")
            prefix = inner[: inner.find("_") + 1] if "" not in tiles else ""
            if prefix in tiles:
                self._lanes[tiles[prefix]].append((lane, libsumo.lane.getMaxSpeed(lane)))

    def reset(self, game: int, share: float) -> None:
        """Multiply the net's limits in a game's tile by a factor."""
        for lane, limit_mps in self._lanes[game]:
            libsumo.lane.setMaxSpeed(lane, limit_mps * share)
