from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from harness.campaign.results.recorded_games import TAKE_TURNS, path_of, scene_drawing, tracks_of, watching_order
from harness.evaluation.strategies import (
    Arm,
    Borrowed,
    NaiveEgo,
    PersonaNonEgo,
    ReconfiguredEgo,
    RetrainedEgo,
    against_persona,
)
from harness.road.net.network import read_net
from harness.road.scene.drawing import lane_marks
from tests.support.traces import game

NAIVE, RETRAINED, RECONFIGURED = NaiveEgo(), RetrainedEgo(against="speedy"), ReconfiguredEgo(against="speedy")
ARMS = {arm.name: arm for arm in (against_persona(ego, "speedy") for ego in (NAIVE, RETRAINED, RECONFIGURED))}


def episodes(*rows):
    """A table of games: arm, episode, outcome of the ego."""
    columns = ("arm", "episode", "ego_outcome")
    table = pd.DataFrame([dict(zip(columns, row, strict=True)) for row in rows])
    empty = {"persona": "", "seed": 1, "non_ego_outcome": "", "ego_min_ttc_s": np.nan, "error": ""}
    empty |= {"ego_delta_v_mps": np.nan, "other_delta_v_mps": np.nan}
    severity = table["ego_outcome"].map({"collision": 300.0, "rail": 200.0})
    return table.assign(**empty, severity=severity)


def in_order(table):
    return [(row.arm, row.episode) for row in watching_order(table, ARMS).itertuples()]


@pytest.mark.parametrize("made", ["retrained", "reconfigured"])
def test_order__a_failure_is_followed_by_the_game_it_is_compared_with(made):
    table = episodes(
        *(("naive_vs_speedy", episode, "collision" if episode == 3 else "goal") for episode in range(5)),
        *((f"{made}_vs_speedy", episode, "goal") for episode in range(5)),
    )
    assert in_order(table)[:2] == [("naive_vs_speedy", 3), (f"{made}_vs_speedy", 3)]
    assert sorted(in_order(table)) == sorted(zip(table["arm"], table["episode"], strict=True))


def test_order__arms_take_turns_so_that_each_is_on_a_page_that_not_all_fit_on():
    table = episodes(
        *(("naive_vs_speedy", episode, "collision" if episode < 60 else "goal") for episode in range(70)),
        *(("naive_vs_texting", episode, "rail" if episode < 60 else "goal") for episode in range(70)),
    )
    first = in_order(table)[: 2 * TAKE_TURNS + 4]
    assert first[:TAKE_TURNS] == [("naive_vs_speedy", episode) for episode in range(TAKE_TURNS)]
    assert first[TAKE_TURNS : 2 * TAKE_TURNS] == [("naive_vs_texting", episode) for episode in range(TAKE_TURNS)]
    assert sorted(first[2 * TAKE_TURNS :]) == [
        (arm, episode) for arm in ("naive_vs_speedy", "naive_vs_texting") for episode in (60, 61)
    ]


def test_order__games_with_another_persons_trait_are_last_but_for_examples():
    person = PersonaNonEgo(persona="speedy", borrowed=Borrowed(trait="attention", of="careful"))
    arm = Arm(ego=NAIVE, non_ego=person)
    table = episodes(
        *((arm.name, episode, "collision") for episode in range(3)),
        *(("naive_vs_speedy", episode, "goal") for episode in range(3)),
    )
    arms, examples = ARMS | {arm.name: arm}, [("naive_vs_speedy", 1, 2), (arm.name, 1, 2)]
    order = [(row.arm, row.episode) for row in watching_order(table, arms, examples).itertuples()]
    assert order == [
        *(("naive_vs_speedy", 2), (arm.name, 2)),
        *(("naive_vs_speedy", 0), ("naive_vs_speedy", 1)),
        *((arm.name, 0), (arm.name, 1)),
    ]


def test_order__has_played_games_only():
    table = episodes(("naive_alone", 0, "goal"), ("naive_alone", 1, "error"))
    table.loc[1, "error"] = "it died"
    assert in_order(table) == [("naive_alone", 0)]


def trace(world, **players):
    """A trace of road users that drive straight at 10 m/s, each with the steps of its presence and its y (m)."""
    rows = []
    for name, (steps, y_m, outcomes) in players.items():
        for step in steps:
            cells = {"episode": 0, "step": step, "time_s": step * 0.1, "player": name, "vehicle_type": "ego_car"}
            cells |= {"x_m": 20.0 + step, "y_m": y_m, "heading_rad": 0.0, "speed_mps": 10.0, "acceleration_mps2": 0.0}
            rows.append(cells | {"steering_rad": 0.0, "lapsed": step == 2, "outcome": outcomes.get(step, "")})
    return game(world, pd.DataFrame(rows)).trace


@pytest.fixture
def row():
    (row,) = episodes(("naive_vs_speedy", 0, "rail")).itertuples()
    return row


def test_game__is_its_trace(merge, row):
    rows = trace(merge.world, ego=(range(5), -0.9, {3: "rail", 4: "rail"}), non_ego=(range(3), -4.8, {2: "goal"}))
    tracks = tracks_of(rows, merge, row)
    ego, non_ego = tracks.players
    assert (tracks.steps, tracks.step_s, tracks.outcome) == (4, 0.1, "rail")
    assert (ego.outcome, ego.ended_step) == ("rail", 3)
    assert (non_ego.outcome, non_ego.ended_step, len(non_ego.columns["x_m"])) == ("goal", 2, 3)
    assert ego.columns["x_m"].tolist() == [20, 21, 22, 23, 24]
    assert ego.columns["lapsed"].tolist() == [False, False, True, False, False]
    assert ego.size_m == (4.6, 1.8)
    (touch,) = tracks.touches
    assert (touch[0], touch[2]) == (pytest.approx(0.3), pytest.approx(0.0, abs=0.01))


def test_game__a_background_vehicle_that_is_absent_for_a_while_is_in_pieces(merge, row):
    tracks = tracks_of(trace(merge.world, ego=(range(6), -1.6, {}), van=([1, 2, 4, 5], -4.8, {})), merge, row)
    pieces = [(each.name, each.first_step, len(each.columns["x_m"])) for each in tracks.background]
    assert pieces == [("van", 1, 2), ("van", 4, 2)]


def test_path__is_the_last_three_seconds_of_the_ego_and_the_people_with_the_contact(merge, row):
    ends = {39: "rail"}
    rows = trace(merge.world, ego=(range(40), -0.9, ends), non_ego=(range(35), -4.8, {}), van=(range(40), -4.8, {}))
    path = path_of(rows, merge, row)
    assert (path.arm, path.persona) == ("naive_vs_speedy", "")
    assert path.players["ego"][:, 0].tolist() == [20.0 + step for step in range(9, 40)]
    assert path.players["non_ego"][:, 0].tolist() == [20.0 + step for step in range(9, 35)]
    assert set(path.players) == {"ego", "non_ego"}  # the van is no player
    assert path.contact_m[1] == pytest.approx(0.0, abs=0.01)  # the left edge of the road


def test_drawing__of_the_merge(merge):
    drawn = scene_drawing(merge)
    ((outline,),) = drawn["surfaces"]
    assert set(map(tuple, outline)) >= {(100, -6.4), (130, -3.2), (220, 0)}
    assert drawn["laneMarks"] == [[[0, -3.2], [100, -3.2]]]
    assert drawn["goal"] == [[[175, -3.2], [175, 0]]]
    assert len(drawn["rails"]) == 2


def test_lane_marks__are_between_the_lanes_whatever_way_the_road_goes(build_net):
    net = build_net(
        '<node id="a" x="0" y="0"/><node id="b" x="0" y="100"/>',
        '<edge id="up" from="a" to="b" numLanes="3" spreadType="center"/>',
    )
    assert sorted(float(mark[0, 0]) for mark in lane_marks(read_net(net))) == pytest.approx([-1.6, 1.6])


@pytest.mark.parametrize("options", [(), ("--lefthand",)])
def test_lane_marks__are_between_lanes_of_different_widths_on_either_side(build_net, options):
    net = build_net(
        '<node id="a" x="0" y="0"/><node id="b" x="100" y="0"/>',
        '<edge id="road" from="a" to="b" numLanes="3" spreadType="center">'
        '<lane index="0" width="2.0"/><lane index="1" width="3.0"/><lane index="2" width="4.0"/></edge>',
        "",
        *options,
    )
    outwards = 1.0 if options else -1.0  # SUMO's lane 0 is on the left side where traffic keeps left
    # 9 m around the line y = 0, from the outer side: 4.5 to 2.5, 2.5 to -0.5, -0.5 to -4.5
    marks = [outwards * float(mark[0, 1]) for mark in lane_marks(read_net(net))]
    assert sorted(marks) == pytest.approx([-0.5, 2.5])
