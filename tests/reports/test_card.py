"""A persona's card: its line about the persona, and the figures beside the failure rates."""

from __future__ import annotations

import pandas as pd
import pytest

from harness.evaluation.comparisons.summary import summarise
from harness.evaluation.strategies import Arm, NaiveEgo, PersonaNonEgo, RetrainedEgo, against_persona
from harness.evaluation.tables import table_of
from harness.reports.key_figures import (
    HARM_TO_OTHERS,
    NEAR_MISSES,
    PRICE,
    WORST_KNOWN_OPPONENT,
    card_verdict,
    key_figures,
    portrait,
)
from harness.reports.numbers import NO_SPACE
from harness.reports.run_tables import RunTables
from harness.reports.verdict_wording import answer
from tests.support.game_tables import arm, table
from tests.support.pages import campaign, recomputed


def found(arguments, near_misses=None):
    """The looked-up tables of a made-up campaign; `near_misses` are the shares of an arm's games that come close, by
    time to collision."""
    episodes = arguments["episodes"]
    for name, share in (near_misses or {}).items():
        rows = episodes["arm"] == name
        marks = [int(place < share * rows.sum()) for place in range(int(rows.sum()))]
        for column in ("near_miss", "near_miss_ttc", "near_miss_pet", "near_miss_headway"):
            values = marks if column in ("near_miss", "near_miss_ttc") else [0] * len(marks)
            episodes.loc[rows, column] = pd.Series(values, index=episodes.index[rows], dtype="Int64")
    return RunTables(**(recomputed(arguments) if near_misses else arguments))


def figures_of(run):
    return {each.title: each for each in key_figures("speedy", run)}


def test_portrait__is_who_the_person_is_and_what_it_does_not_see():
    perception, attention = {"no_shoulder_glance_share": 0.85}, {"lapse_s": [4.0, 6.0], "mean_attentive_s": 4.0}
    document = {"description": "In a hurry.", "perception": perception, "attention": attention}
    assert portrait(document).replace(NO_SPACE, " ") == (
        "In a hurry. It does not glance over the shoulder in 85 % of drives. "
        "Its eyes leave the road about every 9 s: for 4 to 6 s."
    )
    assert portrait({"description": "In a hurry.", "perception": None, "attention": None}) == "In a hurry."
    assert portrait({}) == ""


@pytest.mark.parametrize(
    ("lapses", "words"),
    [
        ({"lapse_s": [4.0, 4.0], "mean_attentive_s": 5.0}, "about every 9 s: for 4 s."),
        (
            {"lapse_s": [0.42, 4.0], "mean_attentive_s": 1.5, "lapse_distribution": "lognormal"},
            "about every 3.1 s: for 1.6 s on average, 0.42 to 4 s in the middle 90 %.",
        ),
    ],
)
def test_portrait__says_how_long_lapses_are_as_the_profile_does(lapses, words):
    assert portrait({"attention": lapses}) == f"Its eyes leave the road {words}"


def test_near_misses__of_an_ego_without_failures_are_on_its_card():
    run = found(campaign(personas=["speedy"]), {"naive_vs_speedy": 0.1, "retrained_vs_speedy": 0.95})
    figure = figures_of(run)[NEAR_MISSES]
    assert [line.replace(NO_SPACE, " ") for line in figure.lines] == [
        "6 of 60 games of the naive ego (10 %): 6 by time to collision of at most 1.5 s",
        "57 of 60 games of the retrained ego (95 %): 57 by time to collision of at most 1.5 s",
    ]
    assert figure.warns


def test_preventable__is_what_the_driver_of_the_regulation_prevents_over_all_seeds():
    judged = {"episodes": 30, "failures": 4, "from_conflict_judged": 3, "moving_over_judged": 3, "from_start_judged": 4}
    prevented = {"from_conflict_prevented": 2, "moving_over_prevented": 1, "from_start_prevented": 3}
    row = {"arm": "naive_vs_speedy", "persona": "speedy", "driver": "careful_and_competent", **judged, **prevented}
    others = {"driver": "rss", "from_conflict_prevented": 3, "moving_over_prevented": 3, "from_start_prevented": 4}
    rows = [row | {"seed": 1}, row | {"seed": 1} | others, row | {"seed": 2}]
    run = RunTables(**campaign(personas=["speedy"]), preventability=table_of("preventability", rows))
    figure = figures_of(run)["Preventable by the careful and competent driver of UN R157"]
    assert figure.lines == [
        "naive ego: 4 of 6 from the conflict on, 2 of 6 if the other moves on into its line, 6 of 8 from the start"
    ]


@pytest.mark.parametrize("share", [0.95, 0.0])
def test_verdict__says_that_an_ego_that_fails_less_comes_too_close(share):
    run = found(campaign(personas=["speedy"]), {"retrained_vs_speedy": share})
    shown = card_verdict("Does retraining help?", answer(run, "RQ2", "speedy"), key_figures("speedy", run))
    assert shown["answer"].label == "yes"
    near_misses = "But near misses: 57 of 60 games of the retrained ego"
    assert shown["caution"].startswith(near_misses) if share else shown["caution"] == ""


def harmed(beside_naive, beside_retrained):
    """A campaign in which so many of 60 people fail without the ego."""
    arguments = campaign(personas=["speedy"])
    episodes = arguments["episodes"]
    for name, count in (("naive_vs_speedy", beside_naive), ("retrained_vs_speedy", beside_retrained)):
        rows = episodes["arm"] == name
        marks = pd.Series([1] * count + [0] * (60 - count), index=episodes.index[rows], dtype="Int64")
        for column in ("person_failed", "harm_to_others"):
            episodes.loc[rows, column] = marks
        episodes.loc[rows, "follower_max_deceleration_mps2"] = 2.0 + count / 20.0
    return found(recomputed(arguments))


def test_harm__that_retraining_leaves_to_others_is_said_beside_the_answer():
    run = harmed(1, 20)
    figure = figures_of(run)[HARM_TO_OTHERS]
    assert figure.lines == [
        "at its strongest the follower brakes by 3.0 m/s² beside the retrained ego, and by 2.0 m/s² beside the naive "
        "ego (mean over the games)",
        "a person fails in 20 of 60 games beside the retrained ego, and in 1 of 60 beside the naive ego",
    ]
    assert figure.warns
    shown = card_verdict("Does retraining help?", answer(run, "RQ2", "speedy"), key_figures("speedy", run))
    assert shown["caution"] == f"But harm to others: {figure.lines[-1]}."


@pytest.mark.parametrize(("before", "after"), [(14, 15), (20, 1), (0, 0)])
def test_harm__that_does_not_grow_is_no_warning(before, after):
    assert not figures_of(harmed(before, after))[HARM_TO_OTHERS].warns


@pytest.mark.parametrize(("drives", "who"), [(True, "The speedy driver"), (False, "The speedy")])
def test_verdict__people_on_foot_are_not_called_drivers(drives, who):
    run = found(campaign(personas=["speedy"]) | {"non_ego_drives": drives})
    assert answer(run, "RQ1", "speedy").sentence.startswith(f"{who} makes the naive ego fail")


def test_worst_known_opponent__is_the_one_of_a_later_round():
    ego = RetrainedEgo(against="speedy")
    later = Arm(ego=ego, non_ego=PersonaNonEgo(persona="speedy", round=3))
    arms = [against_persona(NaiveEgo(), "speedy"), against_persona(ego, "speedy"), later]
    failures = [30, 0, 45]
    games = [
        arm(each.name, ego_failed=[1] * count + [0] * (100 - count), persona="speedy")
        for each, count in zip(arms, failures, strict=True)
    ]
    episodes = table(*games)
    arguments = campaign(personas=["speedy"]) | {"episodes": episodes, "summary": summarise(episodes)}
    figure = figures_of(found(arguments | {"arms": {each.name: each for each in arms}}))[WORST_KNOWN_OPPONENT]
    assert "fails in 45" in figure.lines[0]
    assert f"in {later.name}, the worst of 2 opponents" in figure.lines[0]
    assert figure.warns


def test_price__is_what_retraining_costs_in_speed():
    title = PRICE.format(doing="retraining")
    arguments = campaign(personas=["speedy"])
    chosen = (arguments["comparisons"]["question"] == "RQ2") & (arguments["comparisons"]["metric"] == "mean_speed")
    columns = ["mean_difference", "ci_low", "ci_high"]
    for values, words in (((-0.5, -0.6, -0.4), "0.50 m/s slower"), ((-0.02, -0.03, -0.01), "no relevant difference")):
        arguments["comparisons"].loc[chosen, columns] = values
        assert figures_of(found(arguments))[title].lines[0].replace(NO_SPACE, " ").startswith(words)
