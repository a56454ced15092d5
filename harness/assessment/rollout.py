"""Assessment of one arm: its seeded games as records and traces.

Episode k has the same initial state in every arm of every training seed. Where a driver of SUMO's draws random numbers,
SUMO is reloaded for each game with a seed that depends on the episode only, because the games of one simulation share
them. Games in which it draws none (it drives no player, and other vehicles are steady) are played side by side in one
simulation; the bytes are the same. A search may let the games of a batch share them: it plays none of them alone later.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any, TypeAlias

import pandas as pd

from harness.assessment.game_traces import GameTraces
from harness.assessment.seated_arm import SeatedArm, joined
from harness.drivers.mixture import factors_of, shares_of
from harness.drivers.side_by_side import side_by_side
from harness.environments.arena import Arena
from harness.environments.recorded import recorded_game
from harness.environments.seats import seats_of
from harness.errors import is_of_disk
from harness.evaluation.measured_game import measured
from harness.evaluation.recorded_game import RecordedGame
from harness.game.initial_state import InitialState, StartDistribution, draw_initial_state
from harness.game.outcome import Outcome
from harness.game.seeding import parts_of
from harness.road.demand.route_file import Departure
from harness.road.scene.open_scene import OpenScene

SIDE_BY_SIDE = 64
"""The most games at once in one simulation."""


@dataclass(frozen=True, kw_only=True)
class Game:
    """A played game: its log."""

    played: Mapping[str, Any]
    """Cells of the table `played`: outcomes, and the error of a game that could not be played."""
    trace: Mapping[str, Sequence[Any]] | None
    """Columns; None if it could not be played."""
    scene: OpenScene

    @cached_property
    def recorded(self) -> RecordedGame | None:
        """The game as its trace tells it."""
        return recorded_game(pd.DataFrame(self.trace), self.scene) if self.trace is not None else None

    def payoff_of(self, player: int) -> float:
        """The payoff of a player, equation 1 of the paper; NaN if the game could not be played."""
        return float(self.recorded.payoff[:, player].sum()) if self.recorded is not None else math.nan

    @cached_property
    def record(self) -> dict[str, Any]:
        """The cells of its row of episodes.csv, computed from the trace."""
        return {**self.played, **(measured(self.recorded) if self.recorded is not None else {})}


def assess_batches(
    arm: SeatedArm,
    batches: Iterable[Sequence[int]],
    on_start: Callable[[int], None] = lambda episode: None,
    abandoned: Mapping[int, str] = MappingProxyType({}),
    start_from: Callable[[int, InitialState], InitialState] = lambda episode, drawn: drawn,
    *,
    shared_numbers: bool = False,
) -> Generator[Game, None, None]:
    """Play batches of episodes, in their order. A game that can't be played, or that has impossible numbers, is a
    record with outcome `error`.

    The games of a batch are the same bytes as games alone. They are played side by side if they need no random numbers
    of SUMO and their drivers can. If anything goes wrong among them, each is played again alone. With `shared_numbers`
    those that need such numbers are played side by side too: they share them, so that they depend on their batch.

    `on_start` gets each episode number before that game is played. Episodes in `abandoned` are not played; their record
    has the reason as its error. `start_from` may change the start that is drawn for an episode.
    Raises SimulationError if SUMO can't load the scene, MemoryError, and OSError if the disk takes no more.
    """
    for games in assess_arms([arm], batches, on_start, abandoned, start_from, shared_numbers=shared_numbers):
        yield from games


def assess_arms(
    arms: Sequence[SeatedArm],
    batches: Iterable[Sequence[int]],
    on_start: Callable[[int], None] = lambda episode: None,
    abandoned: Mapping[int, str] = MappingProxyType({}),
    start_from: Callable[[int, InitialState], InitialState] = lambda episode, drawn: drawn,
    *,
    shared_numbers: bool = False,
) -> Generator[list[Game], None, None]:
    """Play batches of episodes as `assess_batches` does, each episode with every one of several arms, all side by side:
    the games of an episode, one of each arm. The arms are such as `seated_arm.joined` takes."""
    with _Rollout(arms, on_start, start_from, shared_numbers=shared_numbers) as rollout:
        for batch in batches:
            played = [(arm, episode) for episode in batch if episode not in abandoned for arm in range(len(arms))]
            together = rollout.play_together(played)
            for episode in batch:
                if episode in abandoned:
                    yield [_failed(arm, episode, abandoned[episode]) for arm in arms]
                else:
                    places = [(arm, episode) for arm in range(len(arms))]
                    yield [together.pop(each) if each in together else rollout.play_alone(*each) for each in places]


_Place: TypeAlias = tuple[int, int]
"""The place of a game: that of its arm among the arms, and its episode."""


class _Rollout:
    """Plays games of arms. SUMO runs in the `with` block."""

    def __init__(
        self,
        arms: Sequence[SeatedArm],
        on_start: Callable[[int], None],
        start_from: Callable[[int, InitialState], InitialState],
        *,
        shared_numbers: bool,
    ) -> None:
        self._arms, self._on_start, self._start_from = arms, on_start, start_from
        self._joined, self._first_members = joined(arms)
        self._starts = [_start_distribution(each) for each in arms]
        self._together = _for_games_together(self._joined, shared_numbers=shared_numbers)
        self._alone: Arena | None = None

    def __enter__(self) -> _Rollout:
        self._open_alone()
        return self

    def __exit__(self, *error: object) -> None:
        self._close_alone()

    def play_alone(self, arm: int, episode: int) -> Game:
        """Play a game in a simulation of its own."""
        self._on_start(episode)
        try:
            arena, start = self._open_alone(), self._start(arm, episode)
            arena.reload(start.seed)
            (game,) = self._play(self._joined, arena, {(arm, episode): start}).values()
        except Exception as error:  # a driver may raise any exception: the other games are played
            if isinstance(error, MemoryError) or is_of_disk(error):
                raise
            return _failed(self._arms[arm], episode, f"{type(error).__name__}: {error}")
        return game

    def play_together(self, places: Sequence[_Place]) -> dict[_Place, Game]:
        """Play those of the games that can be played side by side. Empty if one of them ends with an error."""
        if self._together is None or len(places) < 2:
            return {}
        starts = {place: self._start(*place) for place in places}
        self._close_alone()
        for _, episode in places:
            self._on_start(episode)
        try:
            seed = starts[places[0]].seed
            with closing(_arena(self._together, _tiles(len(starts)), seed)) as arena:
                return self._play(self._together, arena, starts)
        except Exception as error:
            if isinstance(error, MemoryError) or is_of_disk(error):
                raise
            return {}

    def _play(self, seated: SeatedArm, arena: Arena, starts: Mapping[_Place, InitialState]) -> dict[_Place, Game]:
        """Play games from their starts, as many at a time as the arena has tiles, with the drivers `seated` in it."""
        traces, waiting = GameTraces(seated, arena), deque(starts)
        free, place_of, played = list(range(arena.games)), dict[int, _Place](), dict[_Place, Game]()
        while waiting or place_of:
            begun = [free.pop() for _ in range(min(len(free), len(waiting)))]
            if begun:
                place_of |= {tile: waiting.popleft() for tile in begun}
                departures = {tile: self._departures(place_of[tile][1]) for tile in begun}
                arena.reset({tile: starts[place_of[tile]] for tile in begun}, departures)
                traces.begin(begun)
            present = arena.state.present
            if arena.state.running.any():
                traces.add(present, arena.step())
            runs = arena.state.running
            for tile in [each for each in place_of if not runs[each].any()]:
                place = place_of.pop(tile)
                arm, episode = self._arms[place[0]], place[1]
                outcomes = [Outcome(outcome) for outcome in arena.state.outcome[tile].tolist()]
                cells = _played(arm, episode, outcomes, "") | _weather(arm.scene, starts[place])
                trace = traces.end(tile, episode)
                played[place] = Game(played=cells, trace=trace, scene=arm.scene)
                free.append(tile)
        return played

    def _start(self, arm: int, episode: int) -> InitialState:
        seated, first = self._arms[arm], self._first_members[arm]
        present = [float(each) for each in seated.present_in(episode)]
        parts = parts_of(seated.seed, episode)
        drawn = draw_initial_state(replace(self._starts[arm], present_share=present), *parts)
        start = self._start_from(episode, drawn)
        return replace(start, member=tuple(map(sum, zip(first, start.member, strict=True))))

    def _departures(self, episode: int) -> list[Departure]:
        return self._joined.scene.departures(*parts_of(self._joined.seed, episode))

    def _open_alone(self) -> Arena:
        if self._alone is None:
            self._alone = _arena(self._joined, 1)
        return self._alone

    def _close_alone(self) -> None:
        if self._alone is not None:
            self._alone.close()
        self._alone = None


def _start_distribution(arm: SeatedArm) -> StartDistribution:
    factors, shares = [factors_of(each) for each in arm.drivers], [shares_of(each) for each in arm.drivers]
    return arm.scene.start_distribution(factors, [1.0] * len(factors), shares)


def _weather(scene: OpenScene, start: InitialState) -> dict[str, float]:
    """What a scene varies of it, in one game."""
    varies = scene.document.varies
    return {name: getattr(start, name) for name in ("friction", "visibility_m") if getattr(varies, name) is not None}


def _arena(arm: SeatedArm, games: int, seed: int = 0) -> Arena:
    return Arena(arm.scene, games, [seats_of(each, paid=True) for each in arm.drivers], seed=seed, recorded=True)


def _tiles(games: int) -> int:
    """The tiles for games side by side: a power of two, so that a scene's net is copied for few numbers of tiles."""
    return min(1 << (games - 1).bit_length(), SIDE_BY_SIDE)


def plays_side_by_side(arm: SeatedArm) -> bool:
    """Whether games of an arm may be played side by side."""
    return _for_games_together(arm, shared_numbers=False) is not None


def _for_games_together(arm: SeatedArm, *, shared_numbers: bool) -> SeatedArm | None:
    """The arm with drivers for games side by side; None if its drivers or SUMO's traffic prevent such games."""
    if not (arm.scene.has_steady_traffic or shared_numbers):
        return None
    drivers = side_by_side(arm.drivers, arm.scene.world.walks, with_sumo=shared_numbers)
    return replace(arm, drivers=drivers) if drivers is not None else None


def _failed(arm: SeatedArm, episode: int, error: str) -> Game:
    played = _played(arm, episode, [Outcome.ERROR] * len(arm.drivers), error)
    return Game(played=played, trace=None, scene=arm.scene)


def _played(arm: SeatedArm, episode: int, outcomes: Sequence[Outcome], error: str) -> dict[str, Any]:
    named = zip(arm.scene.world.roles, outcomes, arm.present_in(episode), strict=True)
    words = {f"{role}_outcome": outcome.word if there else "" for role, outcome, there in named}
    return {"episode": episode, **words, "error": error}
