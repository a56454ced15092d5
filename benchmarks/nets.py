"""`python -m benchmarks.nets [FOLDER]...`: opens every SUMO net of folders and reports what the harness makes of it.

Without a folder it takes the nets of the installed SUMO. For each net: whether it is opened or refused, and why; the
seconds to open it; and its phantom rails: the lanes and connections on which a car that follows the centre line touches
a rail. Exit code 1: a net ended in a traceback, or has phantom rails.
"""

from __future__ import annotations

import sys
import time
import traceback
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import sumo
from sumolib.net import Net
from sumolib.net.edge import Edge

from benchmarks.lane_followers import touches
from harness.errors import UsageError
from harness.road.net import network
from harness.road.net.lane_route import LaneRoute
from harness.road.net.net_file import check_net
from harness.road.net.route_table import route_table

_ROUTES = 12
_EDGES = 4


@dataclass(frozen=True, kw_only=True)
class Surveyed:
    """What became of a net."""

    file: Path
    refused: str = ""  # with the reason
    crashed: str = ""  # the end of a traceback
    seconds: float = 0.0  # to read and check the net, and to find its drivable area and rails
    edges: int = 0
    paths: int = 0  # lanes and connections that a car followed
    phantom: tuple[str, ...] = ()  # those on which it touched a rail


def shipped_nets() -> list[Path]:
    """The nets in the installed SUMO."""
    home = Path(sumo.SUMO_HOME)
    return sorted([*home.rglob("*.net.xml"), *home.rglob("*.net.xml.gz")])


def survey(file: Path, most: int | None = None, routes: int = _ROUTES) -> Surveyed:
    """Open a net as a scene does, with the tables of some routes; about `most` lanes and connections are followed."""
    try:
        start_s = time.perf_counter()
        check_net(file)
        net = network.read_net(file)
        area = network.drivable_area(net)
        rails = network.rail_lines(net, area)
        seconds = time.perf_counter() - start_s
    except UsageError as error:
        problem = error.problems[0]
        return Surveyed(file=file, refused=f"{problem.key}: {problem.message}" if problem.key else problem.message)
    except Exception:
        return Surveyed(file=file, crashed=_last_line())
    crashed = ""
    try:
        for edges in routes_through(net, routes)[:routes]:
            route_table(net, area, LaneRoute(edges), goal=edges[-1], goal_position_m=0.0)
    except Exception:
        crashed = _last_line()
    paths, phantom = touches(net, rails, most)
    return Surveyed(
        file=file,
        crashed=crashed,
        seconds=seconds,
        edges=len(net.getEdges(withInternal=False)),
        paths=paths,
        phantom=tuple(phantom),
    )


def _last_line() -> str:
    return traceback.format_exc().strip().rsplit("\n", 1)[-1][:150]


def routes_through(net: Net, most: int) -> list[list[Edge]]:
    """Routes of up to four edges for cars, without turnarounds, spread over the net."""
    starts = [edge for edge in net.getEdges(withInternal=False) if edge.allows("passenger")]
    return [_way_from(edge) for edge in starts[:: max(1, len(starts) // most)]]


def _way_from(edge: Edge) -> list[Edge]:
    way = [edge]
    while len(way) < _EDGES:
        onward = [
            following
            for following, links in way[-1].getOutgoing().items()
            if following not in way
            and any(
                link.getDirection() not in "tT"
                and link.getFromLane().allows("passenger")
                and link.getToLane().allows("passenger")
                for link in links
            )
        ]
        if not onward:
            break
        way.append(onward[len(way) % len(onward)])
    return way


def described(each: Surveyed) -> str:
    """One line about a net."""
    if each.refused:
        return f"{each.file.name}: refused: {each.refused}"
    outcome = f"TRACEBACK {each.crashed};" if each.crashed else "opened"
    line = (
        f"{each.file.name}: {outcome} in {each.seconds:.2f} s, {each.edges} edges, {len(each.phantom)} phantom rails "
    )
    return (
        line + f"on {each.paths} lanes and connections" + (f": {', '.join(each.phantom[:3])}" if each.phantom else "")
    )


def summary(found: Iterable[Surveyed]) -> str:
    """The last line: numbers over all nets."""
    every = list(found)
    opened = [each for each in every if not each.refused and not each.crashed]
    return (
        f"{len(every)} nets: {len(opened)} opened, {sum(bool(each.refused) for each in every)} refused, "
        f"{sum(bool(each.crashed) for each in every)} tracebacks; {sum(len(each.phantom) for each in every)} phantom "
        f"rails on {sum(each.paths for each in every)} lanes and connections"
    )


def _nets_of(folders: Iterable[str]) -> Iterator[Path]:
    for folder in map(Path, folders):
        yield from [folder] if folder.is_file() else sorted([*folder.rglob("*.net.xml"), *folder.rglob("*.net.xml.gz")])


def main() -> int:
    """Survey the nets of the folders that the command line names."""
    found = []
    for file in [*_nets_of(sys.argv[1:])] or shipped_nets():
        found.append(survey(file))
        print(described(found[-1]), flush=True)
    print(summary(found))
    return int(any(each.crashed or each.phantom for each in found))


if __name__ == "__main__":
    raise SystemExit(main())
