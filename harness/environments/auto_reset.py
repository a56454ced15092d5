"""Automatic resets: each tile of an arena plays one game after another, as training needs."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol

from harness.environments.arena import Arena
from harness.game.initial_state import InitialState, StartDistribution, draw_initial_state
from harness.road.demand.route_file import Departure


class Replays(Protocol):
    """Chooses starts that are played instead of drawn ones, and is told how their games end."""

    def replay(self, tile: int, drawn: InitialState) -> InitialState | None:
        """The start that a tile plays instead of the drawn one; None: that one."""
        ...

    def ended(self, tile: int, payoff: float) -> None:
        """The game of a tile has ended with this payoff of the learner."""
        ...


class AutoReset:
    """The games of an arena. Each is drawn from `parts`, the number of its tile, and the count of that tile's games.
    With `replays`, some of them are played from other starts instead.

    A tile without a drawn game triggers a draw for all such tiles at once: code and data of the draw are then in the
    processor's caches, which they are not in the middle of a step.
    """

    def __init__(
        self,
        arena: Arena,
        start_distribution: StartDistribution,
        *parts: str | int,
        replays: Replays | None = None,
    ) -> None:
        self._arena, self._start_distribution, self._parts = arena, start_distribution, parts
        self._replays = replays
        self._drawn = [0] * arena.games
        self._store: dict[int, tuple[InitialState, list[Departure]]] = {}

    def reset(self, tiles: Iterable[int]) -> None:
        """Reset these tiles, each to its next game."""
        games = {tile: self._next(tile) for tile in tiles}
        starts = {tile: start for tile, (start, _) in games.items()}
        self._arena.reset(starts, {tile: departures for tile, (_, departures) in games.items()})

    def ended(self, tile: int, payoff: float) -> None:
        """Note that the game of a tile has ended with this payoff of the learner, before the tile is reset."""
        if self._replays is not None:
            self._replays.ended(tile, payoff)

    def _next(self, tile: int) -> tuple[InitialState, list[Departure]]:
        drawn = self._take(tile)
        replayed = self._replays.replay(tile, drawn[0]) if self._replays is not None else None
        return drawn if replayed is None else (replayed, self._arena.scene.departures(*replayed.parts))

    def _take(self, tile: int) -> tuple[InitialState, list[Departure]]:
        if tile not in self._store:
            for each in set(range(self._arena.games)).difference(self._store):
                self._store[each] = self._draw(each)
        return self._store.pop(tile)

    def _draw(self, tile: int) -> tuple[InitialState, list[Departure]]:
        parts = (*self._parts, tile, self._drawn[tile])
        self._drawn[tile] += 1
        return draw_initial_state(self._start_distribution, *parts), self._arena.scene.departures(*parts)
