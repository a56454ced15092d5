"""The ranges of the players' starts, and whether players can start in them: beside one another and the obstacles."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from itertools import chain, combinations, takewhile
from pathlib import Path

from sumolib.net.lane import Lane

from harness.errors import UsageError
from harness.game.geometry import Box, box_distance, boxes_of
from harness.game.initial_state import StartDistribution, draw_initial_state
from harness.game.road import SPACING_M, Route
from harness.game.start_range import ArrivesAfterEgo, BesideEgo, OnLine, StartRange
from harness.game.world import World
from harness.road.net import network
from harness.road.net.route_table import meeting, route_points
from harness.road.net.surface import length_of
from harness.road.scene.scene_files import SceneFiles

_DRAWS = 200


def start_range(role: str, *, files: SceneFiles, route: Route, ego_route: Route) -> StartRange:
    """The range of a player's start. `route` begins at the edge of its start. Raises UsageError if it is impossible."""
    file, player = files.file, files.document.player(role)
    if player.lane is not None:
        return _on_lane(role, files, files.net.getLane(player.lane), route)
    line = route_points(route)[: int(route.length_m / SPACING_M) + 1]
    if player.route_m is not None:
        low, high = player.route_m
        if low < 0.0 or high >= route.goal_m:
            message = f"reaches from {low:g} to {high:g} m, and the goal is at {route.goal_m:.1f} m of the route"
            raise UsageError.of(file, f"{role}.route_m", message, f"keep it from 0 to below {route.goal_m:.1f} m")
        return StartRange(line=line, place=OnLine(player.route_m), speed_mps=player.speed_mps)
    place = _arrival(role, files, route, ego_route)
    return StartRange(line=line, place=place, speed_mps=player.speed_mps)


def _on_lane(role: str, files: SceneFiles, lane: Lane, route: Route) -> StartRange:
    file, player = files.file, files.document.player(role)
    place: OnLine | BesideEgo
    if player.beside_ego_m is not None:
        reach, name = _beside_ego(role, files, lane), "beside_ego_m"
        place = BesideEgo(player.beside_ego_m)
    else:
        assert player.position_m is not None, "a start on a lane has one of the two"
        reach, name = player.position_m, "position_m"
        place = OnLine(reach)
    key, text = f"{role}.{name}", f"reaches from {reach[0]:g} to {reach[1]:g} m,"
    if reach[0] < 0.0 or reach[1] > lane.getLength():
        message = f"{text} off lane {lane.getID()!r} of {lane.getLength():g} m"
        remedy = f"keep it between 0 and {lane.getLength():g} m, or give route_m instead of lane"
        raise UsageError.of(file, key, message, remedy)
    line = network.lane_line(lane)
    scale = length_of(line) / lane.getLength()
    if reach[1] * scale >= route.goal_m:
        message = f"{text} and the goal is at {route.goal_m / scale:g} m"
        raise UsageError.of(file, key, message, "start before the goal")
    return StartRange(line=line, place=place, speed_mps=player.speed_mps, scale=scale)


def _beside_ego(role: str, files: SceneFiles, lane: Lane) -> tuple[float, float]:
    file, document = files.file, files.document
    ego_m = document.ego.position_m
    assert ego_m is not None, "the document says that the ego has a position"
    if files.net.getLane(document.ego.lane).getEdge() is not lane.getEdge():
        message = "needs both to start on the same edge"
        raise UsageError.of(file, f"{role}.beside_ego_m", message, "give position_m instead")
    beside_ego_m = document.player(role).beside_ego_m
    assert beside_ego_m is not None, "the start is of this kind"
    return ego_m[0] + beside_ego_m[0], ego_m[1] + beside_ego_m[1]


def _arrival(role: str, files: SceneFiles, route: Route, ego_route: Route) -> ArrivesAfterEgo:
    """The start of a player that is timed by its arrival at the place where its route meets the ego's."""
    file, player, ego = files.file, files.document.player(role), files.document.ego
    key = f"{role}.arrival_after_ego_s"
    ego_m = ego.position_m or ego.route_m
    assert player.arrival_after_ego_s is not None, "the start is of this kind"
    assert ego_m is not None, "the document says that the ego has a position"
    place = meeting(ego_route, route)
    if place is None:
        raise UsageError.of(file, key, "its route never meets the ego's", "give route_m, or another route")
    if place.ego_m <= ego_m[1]:
        message = f"its route meets the ego's at {place.ego_m:g} m, and the ego starts at up to {ego_m[1]:g} m"
        raise UsageError.of(file, key, message, "start the ego before that, or give position_m or route_m")
    least_s = (place.ego_m - ego_m[1]) / ego.speed_mps[1] + player.arrival_after_ego_s[0]
    most_s = (place.ego_m - ego_m[0]) / ego.speed_mps[0] + player.arrival_after_ego_s[1]
    first_m, last_m = place.other_m - player.speed_mps[1] * most_s, place.other_m - player.speed_mps[0] * least_s
    if last_m >= place.other_m:
        message = f"it may start after the place where the routes meet, at {place.other_m:g} m of its route"
        raise UsageError.of(file, key, message, "let it arrive later, or start the ego farther away")
    if first_m < 0.0:
        message = f"it would have to start up to {-first_m:.0f} m before its route"
        remedy = "let it arrive earlier or drive more slowly, start the ego nearer, or add edges before its route"
        raise UsageError.of(file, key, message, remedy)
    return ArrivesAfterEgo(after_s=player.arrival_after_ego_s, meeting_m=place.other_m, ego_meeting_m=place.ego_m)


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
