"""Whether the players of a scene can all start: beside one another, and beside the obstacles."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from itertools import chain, combinations, takewhile
from pathlib import Path

from harness.errors import UsageError
from harness.game.geometry import Box, box_distance
from harness.game.initial_state import StartDistribution, draw_initial_state
from harness.game.world import World
from harness.road.scene.open_obstacles import boxes_of

_DRAWS = 200


def check_starts(file: Path, starts: StartDistribution, world: World) -> None:
    """Raise UsageError if players overlap in each of many drawn starts of the scene document `file`, or if an obstacle
    touches a player in one of them."""
    names, players = world.roles, len(world.roles)
    among_players = ([pair for pair in pairs if pair[1] < players] for pairs in _overlaps_of_draws(starts, world))
    blocked = list(takewhile(bool, among_players))
    if len(blocked) == _DRAWS:
        (first, second), count = Counter(chain.from_iterable(blocked)).most_common(1)[0]
        message = f"{names[first]} and {names[second]} overlap in {count} of {_DRAWS} drawn starts, and no draw is free"
        raise UsageError.of(file, names[second], message, "give it another lane, or a wider range on a longer one")
    if not starts.obstacles.each:
        return
    found = Counter(pair for pair in chain.from_iterable(_overlaps_of_draws(starts, world)) if pair[1] >= players)
    if found:
        (player, body), count = found.most_common(1)[0]
        message = f"stands on the start of {names[player]} in {count} of {_DRAWS} drawn starts"
        raise UsageError.of(file, starts.obstacles.each[body - players].name, message, "move it, or the start")


def start_warnings(starts: StartDistribution, world: World) -> list[str]:
    """A sentence for each two players whose cars overlap in some drawn starts: such a game ends in its first step."""
    found = Counter(chain.from_iterable(_overlaps_of_draws(starts, world)))
    return [
        f"warning: {world.roles[first]} and {world.roles[second]} overlap in {count} of {_DRAWS} drawn starts, and "
        "these games end with a collision in the first step: give them ranges that are apart"
        for (first, second), count in sorted(found.items())
        if second < len(world.roles)
    ]


def _overlaps_of_draws(starts: StartDistribution, world: World) -> Iterator[list[tuple[int, int]]]:
    """For each of many drawn starts, the pairs of bodies that overlap: a player, and a later player or an obstacle.

    Obstacles are numbered on after the players.
    """
    for draw in range(_DRAWS):
        parts = ("start check", draw)
        start = draw_initial_state(starts, *parts)
        players = boxes_of(Box(start.x_m, start.y_m, start.heading_rad, world.length_m, world.width_m))
        obstacles = boxes_of(starts.obstacles.boxes(*parts)) if starts.obstacles.each else []
        pairs = combinations(enumerate([*players, *obstacles]), 2)
        yield [(k, j) for (k, one), (j, other) in pairs if k < len(players) and box_distance(one, other) <= 0.0]
