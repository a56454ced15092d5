"""Whether the players of a scene can all start: beside one another, and beside the obstacles."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from itertools import combinations, product
from pathlib import Path

import shapely
from shapely.affinity import rotate

from harness.errors import UsageError
from harness.game.geometry import Box, box_distance
from harness.game.initial_state import InitialState, StartDistribution, draw_initial_state
from harness.game.world import World
from harness.road.scene.open_obstacles import boxes_of

_DRAWS = 200


def check_starts(file: Path, starts: StartDistribution, world: World) -> None:
    """Raise UsageError if cars of players overlap in each of many drawn starts of the scene document `file`."""
    found: Counter[tuple[int, int]] = Counter()
    for pairs in _pairs_of_draws(starts, world):
        if not pairs:
            return
        found.update(pairs)
    (first, second), count = found.most_common(1)[0]
    names = world.roles
    message = f"{names[first]} and {names[second]} overlap in {count} of {_DRAWS} drawn starts, and no draw is free"
    raise UsageError.of(file, names[second], message, "give it another lane, or a wider range on a longer one")


def check_clear_starts(file: Path, starts: StartDistribution, world: World) -> None:
    """Raise UsageError if an obstacle touches a player in one of many drawn starts of the scene document `file`."""
    obstacles = starts.obstacles
    if not obstacles.each:
        return
    found: dict[tuple[int, int], int] = {}
    for draw in range(_DRAWS):
        parts = ("start check", draw)
        start, boxes = draw_initial_state(starts, *parts), boxes_of(obstacles.boxes(*parts))
        players = boxes_of(Box(start.x_m, start.y_m, start.heading_rad, world.length_m, world.width_m))
        for player, obstacle in product(range(len(players)), range(len(boxes))):
            if box_distance(players[player], boxes[obstacle]) <= 0.0:
                found[player, obstacle] = found.get((player, obstacle), 0) + 1
    if found:
        (player, obstacle), count = max(found.items(), key=lambda each: each[1])
        message = f"stands on the start of {world.roles[player]} in {count} of {_DRAWS} drawn starts"
        raise UsageError.of(file, obstacles.each[obstacle].name, message, "move it, or the start")


def start_warnings(starts: StartDistribution, world: World) -> list[str]:
    """A sentence for each two players whose cars overlap in some drawn starts: such a game ends in its first step."""
    found = Counter(pair for pairs in _pairs_of_draws(starts, world) for pair in pairs)
    return [
        f"warning: {world.roles[first]} and {world.roles[second]} overlap in {count} of {_DRAWS} drawn starts, and "
        "these games end with a collision in the first step: give them ranges that are apart"
        for (first, second), count in sorted(found.items())
    ]


def _pairs_of_draws(starts: StartDistribution, world: World) -> Iterator[list[tuple[int, int]]]:
    """The players that overlap in each of many drawn starts."""
    for draw in range(_DRAWS):
        yield list(_overlapping(draw_initial_state(starts, "start check", draw), world))


def _overlapping(start: InitialState, world: World) -> Iterator[tuple[int, int]]:
    bodies = [_body(start, world, player) for player in range(len(world.roles))]
    for first, second in combinations(range(len(bodies)), 2):
        if bodies[first].intersects(bodies[second]):
            yield first, second


def _body(start: InitialState, world: World, player: int) -> shapely.Geometry:
    x_m, y_m = float(start.x_m[player]), float(start.y_m[player])
    ahead_m, beside_m = 0.5 * world.length_m[player], 0.5 * world.width_m[player]
    upright = shapely.box(x_m - ahead_m, y_m - beside_m, x_m + ahead_m, y_m + beside_m)
    return rotate(upright, float(start.heading_rad[player]), origin=(x_m, y_m), use_radians=True)
