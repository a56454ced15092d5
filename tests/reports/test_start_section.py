"""The section on starts: a point for each start, with how its game ends, and the boundaries found by minimising."""

from __future__ import annotations

import re

import pandas as pd
import pytest

from harness.evaluation.start_space import Boundary
from harness.reports import start_section as section
from harness.reports.embedding import key
from harness.reports.game_links import GameLinks
from harness.reports.run_tables import RunTables
from tests.support.pages import GAMES, blank_figures, campaign, plain, starts

ARM = "naive_vs_speedy"


def sections(drawn: pd.DataFrame, boundaries: tuple[Boundary, ...] = (), left_out: tuple[int, ...] = (), **arguments):
    """The section of a page that contains all games but those of the episodes `left_out`."""
    never = {"sumo": 0.0, "retrained": 0.0}
    made = campaign(**{"personas": ["speedy"], "games": len(drawn), "failing": never, **arguments})
    tables = RunTables(**made, starts=drawn, boundaries=boundaries)
    games = tables.episodes[~tables.episodes["episode"].isin(left_out)]
    embedded = set(map(key, games["arm"], games["seed"], games["episode"]))
    return section.start_section(tables, GameLinks(embedded=embedded, episodes=tables.episodes))


@pytest.fixture(scope="module")
def naive():
    return sections(starts())[0]


def test_section__begins_with_the_arm_that_matters_most_and_has_the_last_egos():
    with blank_figures():
        views = sections(starts(), personas=["speedy", "distracted"], failing={"sumo": 0.0, "retrained": 0.4})
    assert [view["label"] for view in views] == [
        "retrained ego against speedy",
        "naive ego against speedy",
        "naive ego against distracted",
        "retrained ego against distracted",
    ]


def test_figure__has_a_link_for_each_start_and_the_quantity_that_decides(naive):
    links = re.findall(rf'<a href="#game={ARM},1,(\d+)">', naive["figure"])
    assert sorted(map(int, links)) == list(range(GAMES))
    assert ">speedy ahead of the ego (m)</text>" in naive["figure"]
    assert [kind for kind, _ in naive["kinds"]] == ["fine", "unknown"]  # made-up failures have no known risk


def test_figure__a_start_whose_game_the_page_does_not_contain_has_no_link():
    figure = sections(starts(), left_out=(0, 5))[0]["figure"]
    links = re.findall(rf'<a href="#game={ARM},1,(\d+)">', figure)
    assert sorted(map(int, links)) == [each for each in range(GAMES) if each not in (0, 5)]
    assert figure.count("<use ") >= GAMES, "it is drawn all the same"


def test_section__says_where_failures_lie_and_what_nearby_starts_tell(naive):
    first, second = map(plain, naive["sentences"])
    assert first.startswith("18 of 60 starts fail: speedy ahead of the ego (m) \N{MINUS SIGN}8 to 9 (all starts: ")
    told = re.fullmatch(r"The 10 nearest starts tell ([\d.]+) % of the variance of how a game ends.", second)
    assert told is not None
    assert 50.0 < float(told[1]) < 100.0


def test_figure__the_tone_of_a_failure_is_its_risk_and_a_near_miss_has_a_ring():
    games = pd.DataFrame({"ego_failed": [1, 1, 1, 1, 0, 0], "near_miss": [0, 0, 0, 0, 1, 0]}, dtype="Int64")
    games["mais3_risk_high"] = [0.01, 0.1, 0.4, None, None, None]
    assert section._kinds(games).tolist() == ["small", "medium", "severe", "unknown", "near_miss", "fine"]


def test_section__of_several_trainings_the_worst_game_of_each_start_is_drawn():
    with blank_figures():
        (view, *_) = sections(starts(), seeds=(1, 2))
    assert "18 of 60 starts fail" in view["sentences"][0]


def test_section__of_many_starts_the_worst_and_some_others_are_drawn(monkeypatch):
    monkeypatch.setattr(section, "MOST_STARTS", 40)
    view = sections(starts())[0]
    drawn = [int(each) for each in re.findall(rf'<a href="#game={ARM},1,(\d+)">', view["figure"])]
    assert len(drawn) == len(set(drawn)) == 40
    assert set(range(18)) <= set(drawn)  # each failure
    assert view["sentences"][-1] == "40 of 60 starts are drawn, the worst among them."


def test_figure__a_boundary_is_a_line_from_the_failure_to_a_start_without_one():
    found = pd.DataFrame({"non_ego_ahead_m": [2.0, 9.0, 9.1], "non_ego_faster_mps": [0.5, 0.5, 0.5]})
    boundary = Boundary(arm=ARM, seed=1, episode=10, starts=found)
    drawn = starts()
    (of_arm,) = section._boundaries(
        section._ShownArm(name=ARM, label="", who="speedy"),
        RunTables(**campaign(personas=["speedy"]), starts=drawn, boundaries=(boundary,)),
        ["non_ego_ahead_m", "ego_speed_mps"],
    )
    speed_mps = drawn.loc[10, "ego_speed_mps"]  # minimising does not change it
    assert of_arm.tolist() == [[2.0, speed_mps], [9.0, speed_mps], [9.1, speed_mps]]
    with blank_figures():
        views = sections(drawn, boundaries=(boundary,))
    assert [view["boundaries"] for view in views] == [1, 0]


def test_axes__name_several_people_by_their_places():
    drawn = starts().assign(non_ego_2_after_s=1.0)
    arm = section._ShownArm(name=ARM, label="", who="speedy")
    tables = RunTables(**campaign(personas=["speedy"]), starts=drawn)
    assert section._words("non_ego_2_after_s", arm, tables) == "person 2 after the ego where the ways join (s)"
    assert section._words("non_ego_ahead_m", arm, tables) == "person 1 ahead of the ego (m)"


def test_section__is_left_out_where_starts_do_not_differ():
    assert sections(starts()[["ego_speed_mps"]]) == []
