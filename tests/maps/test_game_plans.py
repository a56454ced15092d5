"""Games on a map: the kinds of conflicts and who has priority, and starts and goals, such that both players meet."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely

from harness.game.road import SPACING_M
from harness.maps import game_plans
from harness.maps.candidates import Candidate, CandidateKind, Priority, candidates, following, onward, way_over
from harness.maps.game_plans import GamePlan, Plans
from harness.maps.import_map import import_map
from harness.maps.planned_routes import PlannedRoute, planned_route
from harness.road.net.network import lane_line, read_net
from harness.road.net.route_table import line_over_junction
from tests.support.repository import REPOSITORY
from tests.support.scenes import CROSSING_EDGES, CROSSING_NODES, STRAIGHT_EDGES, STRAIGHT_NODES

MAPS = REPOSITORY / "tests" / "data" / "maps"


@pytest.fixture(scope="module")
def town(tmp_path_factory: pytest.TempPathFactory) -> Plans:
    return Plans(import_map(MAPS / "town.osm", tmp_path_factory.mktemp("town"), left_hand=False).net)


def found_in(net_file: Path) -> list[Candidate]:
    return candidates(read_net(net_file))


def ways(found: list[Candidate], kind: CandidateKind) -> list[tuple[str, ...]]:
    """Of each candidate of a kind, the ego's edges and the person's."""
    return [(*each.first.edges, *(each.second.edges if each.second else ())) for each in found if each.kind is kind]


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


def test_candidates__of_the_town_are_of_every_kind(town: Plans) -> None:
    found = candidates(town.net)
    assert {each.kind for each in found} == set(CandidateKind) - {CandidateKind.FOLLOWING}
    assert found == sorted(found, key=lambda each: each.order)
    rings = [each for each in found if each.kind is CandidateKind.ROUNDABOUT]
    assert len(rings) == 4
    assert all(each.first.start.getEdge().getName() == "Am Kreisel" for each in rings)


def test_candidates__a_zebra_crossing_is_crossed_from_both_directions(town: Plans) -> None:
    zebras = [each for each in candidates(town.net) if each.kind is CandidateKind.ZEBRA]
    assert len(zebras) == 2
    assert all(each.second is None and each.footway is not None for each in zebras)


def test_way_over__begins_shortly_before_the_junction_and_ends_shortly_behind_it(town: Plans) -> None:
    links = [link for edge in town.net.getEdges(withInternal=False) for link in onward(edge)]
    assert links
    for link in links:
        before, behind = lane_line(link.getFromLane()), lane_line(link.getToLane())
        over = line_over_junction(town.net, link)
        inside = shapely.LineString(np.concatenate((before[-1:], over, behind[:1]))).length
        own_m = sum(min(shapely.LineString(line).length, 6.0) for line in (before, behind))
        assert way_over(town.net, link).length == pytest.approx(inside + own_m)


def test_candidates__a_net_without_conflicts_offers_its_roads(build_net: Callable[..., Path]) -> None:
    net = read_net(build_net(STRAIGHT_NODES, STRAIGHT_EDGES))
    assert candidates(net) == []
    (road,) = following(net)
    assert (road.kind, road.first.start.getEdge().getID()) == (CandidateKind.FOLLOWING, "road")


# --- plans ------------------------------------------------------------------------------------------------------------


def of_kind(plans: Plans, kind: CandidateKind) -> list[GamePlan]:
    return [plan for plan in plans.all if plan.candidate.kind is kind]


def test_plans__of_the_town_exist_for_every_conflict(town: Plans) -> None:
    assert town.left_out == {}
    assert [plan.number for plan in town.all] == list(range(1, len(town.all) + 1))


def test_plans__the_highest_score_comes_first(town: Plans) -> None:
    scores = [round(plan.score) for plan in town.all]
    assert scores == sorted(scores, reverse=True)
    assert max(plan.score for plan in town.all if plan.candidate.with_signals) <= 50.0
    best = town.all[0]  # both go straight on, and the ego has priority
    assert (best.candidate.kind, best.candidate.priority) == (CandidateKind.CROSSING, Priority.FIRST)
    assert sum(best.ego_route.turns_deg) < 1.0


# at 13.2 m/s, a second of reaction and 3 m/s² take 42 m
def test_plans__a_start_is_clear_of_stop_lines(town: Plans) -> None:
    for plan in town.all:
        for at_m, _ in plan.ego_route.lights:
            assert (
                plan.ego.key != "route_m" or not at_m - 42.0 < plan.ego.range[1] < at_m or plan.ego.speed_mps[1] < 13.2
            )


def test_plans__say_how_far_their_search_is(build_net: Callable[..., Path]) -> None:
    said: list[str] = []
    plans = Plans(read_net(build_net(CROSSING_NODES, CROSSING_EDGES, "", "--no-turnarounds")), said.append)
    assert len(plans.all) == 3
    assert said == ["finding conflicts", "planning games: 0 of 3 conflicts"]


# a start at 9.0 to 13.2 m/s under a limit of 13.89 m/s: 65 to 95 %
def test_plans__start_the_ego_seconds_before_the_place_below_its_limit(town: Plans) -> None:
    plan = next(plan for plan in of_kind(town, CandidateKind.TURN_ACROSS) if plan.candidate.with_signals)
    assert plan.ego.speed_mps == (9.0, 13.2)
    low_m, high_m = plan.ego.range
    line = plan.ego_route.line
    place_m = SPACING_M * int(np.argmin(np.hypot(*(line - plan.candidate.place).T)))
    assert (place_m - low_m) / 13.2 == pytest.approx(8.5, abs=0.5)
    assert (place_m - high_m) / 13.2 == pytest.approx(7.0, abs=0.5)
    assert plan.person.key == "arrival_after_ego_s"


def test_plans__the_ego_of_a_roundabout_comes_from_an_arm_and_leaves_it(town: Plans) -> None:
    ring = {name for each in town.net.getRoundabouts() for name in each.getEdges()}
    for plan in of_kind(town, CandidateKind.ROUNDABOUT):
        assert plan.ego_route.edges[0] not in ring
        assert plan.ego_route.edges[-1] not in ring


def test_plans__a_person_on_a_zebra_crossing_comes_along_the_pavement(town: Plans) -> None:
    for plan in of_kind(town, CandidateKind.ZEBRA):
        assert plan.way is not None
        assert plan.person_route is None
        along, across = plan.way[1] - plan.way[0], plan.way[3] - plan.way[2]
        assert abs(along @ across) < 0.2 * np.hypot(*along) * np.hypot(*across)


def test_plans__of_a_ramp_let_the_person_come_from_it(town: Plans) -> None:
    (plan,) = of_kind(town, CandidateKind.LANE_END)
    assert plan.person_route is not None
    assert plan.person_route.edges[0] != plan.ego_route.edges[0]


@pytest.mark.parametrize(
    ("edges", "reason"),
    [
        (CROSSING_EDGES.replace("/>", ' width="2.2"/>'), "lanes narrower than 2.5 m, such as"),
        (CROSSING_EDGES.replace("13.89", "50"), "too little road before it"),
    ],
)
def test_plans__what_is_left_out_has_a_reason(edges: str, reason: str, build_net: Callable[..., Path]) -> None:
    plans = Plans(read_net(build_net(CROSSING_NODES, edges, "", "--no-turnarounds")))
    assert plans.all == []
    assert [each for each in plans.left_out if each.startswith(reason)]


def test_plans__one_that_cannot_be_made_leaves_the_others(
    build_net: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[PlannedRoute | str] = []

    def planned(*given: Any) -> PlannedRoute | str:
        made.append(planned_route(*given))
        if len(made) == 1:
            raise ValueError("no length")
        return made[-1]

    monkeypatch.setattr(game_plans, "planned_route", planned)
    plans = Plans(read_net(build_net(CROSSING_NODES, CROSSING_EDGES, "", "--no-turnarounds")))
    assert len(plans.all) == 2
    assert plans.left_out == {"lanes that can't be used, such as wc_0: no length": 1}


SLIVERS = (
    '<node id="a" x="0" y="0"/><node id="s" x="200" y="-200"/><node id="b" x="200" y="0"/>'
    '<node id="c" x="245" y="0"/><node id="d" x="250" y="0"/><node id="e" x="400" y="0"/>'
)


# 45 m behind the junction is the edge from c to d, which is 5 m long
def test_plans__a_goal_is_10_m_from_the_start_of_its_edge(build_net: Callable[..., Path]) -> None:
    edges = "".join(TO_STUBS.format(*each) for each in ("ab", "sb", "bc", "cd", "de"))
    plans = Plans(read_net(build_net(SLIVERS, edges, "", "--no-turnarounds"))).all
    assert plans
    for plan in plans:
        assert plan.ego_route.goal_edge in ("bc", "de")
        assert plan.ego_route.goal_position_m >= 10.0


# a start at up to 95 % of 50 m/s is faster than the 40 m/s that a car reaches elsewhere
@pytest.mark.parametrize(("limit_mps", "car_mps"), [(30.0, 40.0), (50.0, 48.0)])
def test_plans__a_car_reaches_the_speeds_of_its_road(
    limit_mps: float, car_mps: float, build_net: Callable[..., Path]
) -> None:
    edges = f'<edge id="ab" from="a" to="b" speed="{limit_mps}"/>'
    (plan,) = Plans(read_net(build_net('<node id="a" x="0" y="0"/><node id="b" x="2000" y="0"/>', edges))).all
    assert plan.car_speed_mps == car_mps


STUBS = (
    '<node id="a" x="0" y="0"/><node id="b" x="600" y="0"/><node id="c" x="600" y="-15"/><node id="d" x="615" y="0"/>'
)
TO_STUBS = '<edge id="{0}{1}" from="{0}" to="{1}" speed="13.89"/>'


# 15 s at the limit of 13.89 m/s, and 75 m from the farthest start of the player ahead
def test_plans__on_a_road_without_conflicts_one_follows_the_other(build_net: Callable[..., Path]) -> None:
    edges = "".join(TO_STUBS.format(*each) for each in ("ab", "cb", "bd"))
    plans = Plans(read_net(build_net(STUBS, edges, "", "--no-turnarounds")))
    assert [plan.candidate.kind for plan in plans.all] == [CandidateKind.FOLLOWING]
    assert "no room for a goal behind it" in plans.left_out  # of the merge before the short road
    (plan,) = plans.all
    assert plan.ego_route.goal_position_m == pytest.approx(283.3, abs=0.1)
    assert plan.time_limit_s({}) == 40.0  # 273 m at 65 % of the limit, and 8 s
