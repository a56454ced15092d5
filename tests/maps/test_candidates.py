"""The kinds of conflicts that are found on a net, and who has priority in each."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from harness.maps.candidates import Candidate, CandidateKind, Priority, candidates, following
from harness.maps.import_map import import_map
from harness.road.net.network import read_net
from tests.support.repository import REPOSITORY
from tests.support.scenes import CROSSING_EDGES, CROSSING_NODES, STRAIGHT_EDGES, STRAIGHT_NODES

MAPS = REPOSITORY / "tests" / "data" / "maps"


def found_in(net_file: Path) -> list[Candidate]:
    return candidates(read_net(net_file))


def ways(found: list[Candidate], kind: CandidateKind) -> list[tuple[str, ...]]:
    """Of each candidate of a kind, the ego's edges and the person's."""
    return [(*each.first.edges, *(each.second.edges if each.second else ())) for each in found if each.kind is kind]


@pytest.fixture(scope="module")
def town(tmp_path_factory: pytest.TempPathFactory) -> list[Candidate]:
    return candidates(import_map(MAPS / "town.osm", tmp_path_factory.mktemp("town"), left_hand=False)[1])


# two one-way roads that cross; cars may turn from one into the other
def test_candidates__of_a_crossing_give_the_ego_the_priority(build_net: Callable[..., Path]) -> None:
    found = found_in(build_net(CROSSING_NODES, CROSSING_EDGES, "", "--no-turnarounds"))
    assert ways(found, CandidateKind.CROSSING) == [("wc", "ce", "sc", "cn")]
    assert ways(found, CandidateKind.MERGE) == [("wc", "ce", "sc", "ce"), ("wc", "cn", "sc", "cn")]
    assert {each.priority for each in found} == {Priority.FIRST}


def test_candidates__a_turn_across_needs_one_that_comes_towards_the_other() -> None:
    found = found_in(REPOSITORY / "networks" / "left_across" / "left_across.net.xml")
    assert ("west_in", "east_out", "east_in", "south_out") in ways(found, CandidateKind.TURN_ACROSS)
    assert all(each.with_signals for each in found)


def test_candidates__a_lane_that_ends_is_the_persons(build_net: Callable[..., Path]) -> None:
    found = found_in(REPOSITORY / "networks" / "merge" / "merge.net.xml")
    (end,) = [each for each in found if each.kind is CandidateKind.LANE_END]
    assert end.second is not None
    assert (end.first.start.getID(), end.second.start.getID()) == ("approach_1", "approach_2")


def test_candidates__of_the_town_are_of_every_kind(town: list[Candidate]) -> None:
    assert {each.kind for each in town} == set(CandidateKind) - {CandidateKind.FOLLOWING}
    assert town == sorted(town, key=lambda each: each.order)
    rings = [each for each in town if each.kind is CandidateKind.ROUNDABOUT]
    assert len(rings) == 4
    assert all(each.first.start.getEdge().getName() == "Am Kreisel" for each in rings)


def test_candidates__a_zebra_crossing_is_crossed_from_both_directions(town: list[Candidate]) -> None:
    zebras = [each for each in town if each.kind is CandidateKind.ZEBRA]
    assert len(zebras) == 2
    assert all(each.second is None and each.footway is not None for each in zebras)


def test_candidates__a_net_without_conflicts_offers_its_roads(build_net: Callable[..., Path]) -> None:
    net = read_net(build_net(STRAIGHT_NODES, STRAIGHT_EDGES))
    assert candidates(net) == []
    (road,) = following(net)
    assert (road.kind, road.first.start.getEdge().getID()) == (CandidateKind.FOLLOWING, "road")
