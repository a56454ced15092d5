"""The lanes that the line of a route follows: those with the fewest changes of lane from the start to the end."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from sumolib.net import Net

from harness.road.net.lane_route import LaneRoute
from harness.road.net.network import read_net
from tests.support.tiny import REPOSITORY

NODES = "".join(f'<node id="{name}" x="{100 * k}" y="0"/>' for k, name in enumerate("abcd"))
EDGES = "".join(
    f'<edge id="{start}{end}" from="{start}" to="{end}" numLanes="{lanes}"/>'
    for start, end, lanes in (("a", "b", 2), ("b", "c", 3), ("c", "d", 2))
)
# a lane to the right opens on bc, and ends there
LANES = "".join(
    f'<connection from="{start}" to="{end}" fromLane="{one}" toLane="{other}"/>'
    for start, end, one, other in (
        ("ab", "bc", 0, 0),
        ("ab", "bc", 0, 1),
        ("ab", "bc", 1, 2),
        ("bc", "cd", 1, 0),
        ("bc", "cd", 2, 1),
    )
)


@pytest.fixture(scope="module")
def net(build_net: Callable[..., Path]) -> Net:
    return read_net(build_net(NODES, EDGES, LANES))


def route(net: Net, names: Sequence[str], start: str | None = None) -> LaneRoute:
    return LaneRoute([net.getEdge(name) for name in names], start=net.getLane(start) if start else None)


def lanes(route: LaneRoute) -> list[str]:
    """The lanes of the line: where it enters and leaves each edge."""
    entries = [lane.getID() for lane in route.entries]
    exits = [*(link.getFromLane().getID() for link in route.links), entries[-1]]
    return [name for pair in zip(entries, exits, strict=True) for name in pair]


@pytest.mark.parametrize(
    ("start", "expected"),
    [
        ("ab_0", ["ab_0", "ab_0", "bc_1", "bc_1", "cd_0", "cd_0"]),  # not on bc_0, which ends
        ("ab_1", ["ab_1", "ab_1", "bc_2", "bc_2", "cd_1", "cd_1"]),
        (None, ["ab_1", "ab_1", "bc_2", "bc_2", "cd_1", "cd_1"]),  # the leftmost
    ],
)
def test_line__stays_in_the_lane_of_the_start_where_it_leads_to_the_end(
    net: Net, start: str | None, expected: list[str]
) -> None:
    assert lanes(route(net, ("ab", "bc", "cd"), start)) == expected


def test_line__on_a_single_edge_is_the_lane_of_the_start(net: Net) -> None:
    assert [lanes(route(net, ["bc"], f"bc_{k}"))[0] for k in range(3)] == ["bc_0", "bc_1", "bc_2"]
    assert lanes(route(net, ["bc"]))[0] == "bc_2"


def test_line__from_a_lane_that_ends_is_on_the_nearest_one_that_goes_on(net: Net) -> None:
    assert lanes(route(net, ("bc", "cd"), "bc_0")) == ["bc_1", "bc_1", "cd_0", "cd_0"]


def test_lane_ends__are_those_of_the_best_way_on_from_each_lane(net: Net) -> None:
    ends = route(net, ("ab", "bc", "cd")).lane_ends([100.0, 200.0, 300.0])
    endless = float("inf")
    assert ends == [
        {"ab_0": endless, "ab_1": endless},
        {"bc_0": 200.0, "bc_1": endless, "bc_2": endless},
        {"cd_0": endless, "cd_1": endless},
    ]


def test_links__of_edges_that_are_not_connected_are_refused(net: Net) -> None:
    with pytest.raises(ValueError, match="no connection from edge 'ab' to 'cd'"):
        _ = route(net, ("ab", "cd")).links


@pytest.mark.parametrize("scene", ["merge", "on_ramp", "cut_in", "roundabout"])
def test_links__have_the_fewest_changes_of_lane_of_all_ways_along_the_route(scene: str) -> None:
    net = read_net(REPOSITORY / "networks" / scene / f"{scene}.net.xml")
    for edge in net.getEdges(withInternal=False):
        for following in edge.getOutgoing():
            along = LaneRoute([edge, following])
            for start in edge.getLanes():
                if links := along.choices[0]:
                    chosen = LaneRoute([edge, following], start=start).links
                    least = min(abs(link.getFromLane().getIndex() - start.getIndex()) for link in links)
                    assert abs(chosen[0].getFromLane().getIndex() - start.getIndex()) == least
