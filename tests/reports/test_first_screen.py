"""The first screen: the table of egos and people, the arm that matters most, and the sentences about it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from harness.evaluation.comparisons.acceptance_checks import Check
from harness.evaluation.comparisons.summary import summarise
from harness.evaluation.competence import DID_NOT_LEARN
from harness.evaluation.strategies import (
    Arm,
    Borrowed,
    NaiveEgo,
    PersonaNonEgo,
    RetrainedEgo,
    RoundAnswer,
    against_persona,
)
from harness.evaluation.tables import table_of
from harness.reports.embedding import key
from harness.reports.failure_table import TAKES_OVER, WORST_KNOWN, failure_table
from harness.reports.first_answers import first_answers
from harness.reports.focus import focus_of
from harness.reports.game_links import GameLinks
from harness.reports.next_steps import next_steps
from harness.reports.numbers import NO_SPACE
from harness.reports.run_tables import RunTables
from tests.support.game_tables import arm, table
from tests.support.pages import campaign, cannot_drive, recomputed

LAWFUL = {"sumo": 0.0}
"""No failure against the ordinary driver."""


def run_of(*, failing=LAWFUL, personas=("speedy",), seeds=(1,), **fields):
    return RunTables(**campaign(personas=list(personas), failing=dict(failing), seeds=seeds) | fields)


def table_in(run):
    return failure_table(run, GameLinks(embedded=(), episodes=run.episodes))


def texts(run):
    return {
        line.person: [cell and f"{cell.rate}, {cell.counts}".replace(NO_SPACE, " ") for cell in line.cells]
        for line in table_in(run)["lines"]
    }


def judged(*, failures, prevented, seed=1):
    counts = {"episodes": 60, "failures": failures, "from_conflict_judged": failures, "from_start_judged": failures}
    counts |= {"from_conflict_prevented": prevented, "from_start_prevented": 1}
    counts |= {"moving_over_judged": failures, "moving_over_prevented": 0}
    return {"arm": "naive_vs_speedy", "persona": "speedy", "driver": "careful_and_competent", "seed": seed, **counts}


def with_arms(*added):
    """A run with more arms of the retrained ego, each with the number of its 60 games that fail."""
    arguments = campaign(personas=["speedy"], failing=LAWFUL)
    frames = [arm(each.name, ego_failed=[1] * count + [0] * (60 - count), persona="speedy") for each, count in added]
    episodes = table_of("episodes", [*arguments["episodes"].to_dict("records"), *table(*frames).to_dict("records")])
    arguments["arms"] |= {each.name: each for each, _ in added}
    return RunTables(**recomputed(arguments | {"episodes": episodes}))


# --- the table ---------------------------------------------------------------------------------


def test_table__has_a_line_for_each_person_and_a_column_for_each_ego():
    assert texts(run_of()) == {
        "nobody": ["0 %, 0 of 60", "0 %, 0 of 60"],
        "SUMO’s driver": ["0 %, 0 of 60", None],
        "speedy": ["30 %, 18 of 60", "3.3 %, 2 of 60"],
    }
    assert table_in(run_of())["columns"] == ["naive ego", "retrained ego"]


def test_table__counts_the_games_of_all_trainings_and_shows_the_interval_of_each():
    line = table_in(run_of(seeds=(1, 2)))["lines"][-1]
    assert line.cells[0].counts == "36 of 120"
    assert [round(low, 3) for _, low, _ in line.cells[0].spans] == [0.188, 0.188]  # Clopper-Pearson, 18 of 60


def test_table__its_axis_ends_above_every_interval():
    assert table_in(run_of())["top"] == 0.6  # 18 of 60: to 43.2 %
    assert table_in(run_of(failing=LAWFUL | {"naive": 0.0, "retrained": 0.0}))["top"] == 0.1  # 0 of 60: to 6 %


def test_table__of_many_people_or_trainings_is_dense():
    assert not table_in(run_of(personas=("speedy", "distracted")))["dense"]
    assert table_in(run_of(personas=[f"person{each}" for each in "abcdefg"]))["dense"]
    assert table_in(run_of(seeds=range(1, 10)))["dense"]


def test_table__warns_of_an_ego_that_fails_where_no_persona_takes_part():
    assert [line.person for line in table_in(run_of())["lines"] if line.warns] == []
    assert [line.person for line in table_in(run_of(failing={"sumo": 0.05}))["lines"] if line.warns] == [
        "SUMO’s driver"
    ]


def test_table__the_tone_of_a_failure_is_the_mean_risk_of_the_collisions_in_which_it_is_known():
    run = run_of(seeds=(1, 2))
    episodes = run.episodes.copy()
    failed = (episodes["arm"] == "naive_vs_speedy") & (episodes["ego_failed"] == 1)
    episodes.loc[failed & (episodes["seed"] == 1), "mais3_risk_high"] = 0.0
    episodes.loc[(failed & (episodes["seed"] == 2)).idxmax(), "mais3_risk_high"] = 0.5  # 0.5 / 19: at most 10 %
    run = replace(run, episodes=episodes, summary=summarise(episodes))
    assert table_in(run)["lines"][-1].cells[0].tone == "medium"


def test_table__the_driver_of_the_regulation_leaves_the_failures_that_it_does_not_prevent():
    run = run_of(preventability=table_of("preventability", [judged(failures=18, prevented=12)]))
    assert table_in(run)["columns"][-1] == TAKES_OVER
    assert texts(run)["speedy"][-1] == "10 %, 6 of 60"
    half = run_of(seeds=(1, 2), preventability=table_of("preventability", [judged(failures=18, prevented=12)]))
    assert TAKES_OVER not in table_in(half)["columns"]  # the failures of seed 2 are not judged


def test_table__the_worst_known_opponent_is_of_a_later_round_or_newly_trained():
    ego = RetrainedEgo(against="speedy")
    later = Arm(ego=ego, non_ego=PersonaNonEgo(persona="speedy", round=3))
    newly = replace(against_persona(ego, "speedy"), best_response_of=1)
    assert WORST_KNOWN not in texts(run_of())
    assert texts(with_arms((later, 6), (newly, 3)))[WORST_KNOWN] == [None, "10 %, 6 of 60"]
    assert texts(with_arms((later, 3), (newly, 6)))[WORST_KNOWN] == [None, "10 %, 6 of 60"]


def test_table__a_rejected_answer_is_a_known_opponent_and_named():
    rejected = RoundAnswer(of=PersonaNonEgo(persona="speedy", round=3), is_rejected=True)
    run = with_arms((Arm(ego=NaiveEgo(), non_ego=rejected), 6))
    assert texts(run)[WORST_KNOWN] == ["10 %, 6 of 60", None]
    assert table_in(run)["lines"][-1].cells[0].arm == "naive_vs_speedy_round3_rejected"
    assert {cell.arm for line in table_in(run)["lines"][:-1] for cell in line.cells if cell} == {""}


def test_table__people_on_foot_are_no_drivers():
    assert "ordinary person" in texts(run_of(non_ego_drives=False))


def test_table__a_person_with_the_trait_of_another_is_no_opponent():
    borrowed = PersonaNonEgo(persona="speedy", round=3, borrowed=Borrowed(trait="payoff", of="careful"))
    assert WORST_KNOWN not in texts(with_arms((Arm(ego=NaiveEgo(), non_ego=borrowed), 6)))


# --- the arm that matters most -------------------------------------------------------------------


def broken(bound, arm_name):
    return Check(bound=bound, persona="speedy", seed=1, arm=arm_name, value=0.5, limit=0.6, allowed=0.1, games=60)


def test_focus__is_first_the_ordinary_driver_then_the_broken_bound_then_the_last_ego_that_fails():
    bound = broken("near_miss_rate", "retrained_vs_speedy")
    assert focus_of(run_of(failing={"sumo": 0.05}, acceptance=[bound])).arm == "naive_vs_sumo"
    at_bound = focus_of(run_of(acceptance=[bound]))
    assert (at_bound.arm, at_bound.happens) == (
        "retrained_vs_speedy",
        "the ego breaks the bound on near misses against speedy",
    )
    assert (
        focus_of(run_of(acceptance=[replace(bound, limit=0.05)])).happens
        == "the retrained ego still fails against speedy"
    )
    assert focus_of(run_of(failing=LAWFUL | {"retrained": 0.0})).happens == "speedy makes the naive ego fail"
    assert focus_of(run_of(failing=LAWFUL | {"naive": 0.0, "retrained": 0.0})) is None


def test_focus__is_on_people_where_the_ego_fails_in_at_most_3_percent_without_them():
    for people, expected in (({}, "retrained_vs_speedy"), ({"naive": 0.0, "retrained": 0.0}, "naive_vs_sumo")):
        run = run_of(failing=LAWFUL | people)
        run.summary.loc[run.summary["arm"] == "naive_vs_sumo", ["failure_rate", "collisions"]] = (1 / 60, 1)
        assert focus_of(replace(run)).arm == expected


def test_focus__is_the_last_ego_too_that_fails_alone():
    run = run_of(failing=LAWFUL)
    run.summary.loc[run.summary["arm"] == "retrained_alone_speedy", ["failure_rate", "collisions"]] = (0.1, 6)
    focus = focus_of(replace(run))
    assert (focus.arm, focus.happens) == ("retrained_alone_speedy", "the retrained ego fails alone")


def test_focus__is_of_the_broken_bounds_one_with_failures():
    bounds = [broken("near_miss_rate", "retrained_vs_speedy"), broken("speed_loss_mps", "retrained_vs_distracted")]
    bounds[1] = replace(bounds[1], persona="distracted")
    run = run_of(personas=("speedy", "distracted"), acceptance=bounds)
    assert focus_of(run).arm == "retrained_vs_speedy"
    run.summary.loc[
        run.summary["arm"] == "retrained_vs_speedy", ["failure_rate", "collisions", "rails", "timeouts"]
    ] = 0.0
    assert focus_of(replace(run)).arm == "retrained_vs_distracted"


def test_next_step__is_the_worst_game_unless_a_player_of_it_did_not_learn():
    arguments = campaign(personas=["speedy", "distracted"], failing=LAWFUL)
    arguments["manifest"]["stages"]["distracted-seed1"]["stopped"] = DID_NOT_LEARN
    assert next_steps(RunTables(**arguments))[0].sentence.startswith("See how")  # the focus is on speedy
    arguments["manifest"]["stages"]["speedy-seed1"]["stopped"] = DID_NOT_LEARN
    assert next_steps(RunTables(**arguments))[0].sentence.startswith("Double the budget")


def test_next_step__is_a_game_of_the_broken_bound():
    step = next_steps(run_of(acceptance=[broken("near_miss_rate", "naive_vs_speedy")]))[0]
    assert step.command.startswith("harness replay . naive_vs_speedy ")


@pytest.mark.parametrize("has_failed", [True, False])
def test_next_steps__offer_to_minimise_a_game_that_the_ego_fails_and_no_other(has_failed):
    arguments = campaign(personas=["speedy"], failing=LAWFUL)
    games = arguments["episodes"]
    of_arm = games["arm"] == "naive_vs_speedy"
    games["near_miss"] = (of_arm & (games["ego_failed"] == int(has_failed))).astype("Int64")
    bound = broken("near_miss_rate", "naive_vs_speedy")
    commands = [each.command for each in next_steps(RunTables(**arguments | {"acceptance": [bound]}))]
    assert commands[0].startswith("harness replay . naive_vs_speedy ")
    assert any(each.startswith("harness minimise") for each in commands) == has_failed


# --- the sentences ---------------------------------------------------------------------------------


def answers(run):
    given = first_answers(run, next_steps(run))
    return {each.question: [line.replace(NO_SPACE, " ") for line in each.lines] for each in given}


def test_next_steps__of_a_campaign_without_personas_are_to_meet_people():
    trained = {"kind": "training", "status": "done", "stopped": "budget", "seed": 1}
    run = RunTables(
        manifest={"name": "alone", "personas": [], "stages": {"naive-seed1": trained, "robust-seed1": trained}}
    )
    assert next_steps(run)[-1].command == "harness league --ego policies/robust-seed1"


def test_next_steps__of_a_run_without_games_begin_with_playing_them():
    step = next_steps(run_of(is_from_tables=True))[0]
    assert step.sentence.endswith("play the games, which are not published, once more.")
    assert (step.command.split()[:2], step.game) == (["harness", "campaign"], "")


def test_answers__say_how_often_each_ego_fails_and_what_retraining_costs():
    run = run_of(preventability=table_of("preventability", [judged(failures=18, prevented=12)]))
    given = answers(run)
    assert given["Why does it fail?"] == [
        "The retrained ego fails against speedy in 2 of 60 games.",
        "The naive ego fails against speedy in 18 of 60 games.",
    ]
    assert given["Could it have been prevented?"] == [
        "Of the failures against speedy the driver of UN R157 prevents: naive ego 12 of 18 from the conflict on, "
        "1 of 18 from the start.",
        "The failures of the retrained ego against speedy are not judged.",
    ]
    assert answers(run_of())["Could it have been prevented?"] == [
        f"The failures of the {ego} ego against speedy are not judged." for ego in ("retrained", "naive")
    ]
    (line,) = given["Does retraining help, and what does it cost?"]
    assert line.startswith("Against speedy: yes. 18 failures in 60 games become 2; ")


def test_answers__a_failure_without_a_conflict_is_judged_from_the_start_only():
    row = judged(failures=18, prevented=12) | {"from_conflict_judged": 0, "from_conflict_prevented": 0}
    given = answers(run_of(preventability=table_of("preventability", [row])))
    assert given["Could it have been prevented?"][0] == (
        "Of the failures against speedy the driver of UN R157 prevents: naive ego 1 of 18 from the start."
    )


def test_answers__name_the_reference_driver_that_is_watched():
    game = {"arm": "naive_vs_speedy", "seed": 1, "episode": 4, "driver": "rss"}
    pose = {"player": "ego", "step": 8, "x_m": 0.0, "y_m": 0.0, "heading_rad": 0.0}
    taken_over = table_of("takeovers", [game | pose])
    run = run_of(preventability=table_of("preventability", [judged(failures=18, prevented=0)]), takeovers=taken_over)
    given = {each.question: each for each in first_answers(run, next_steps(run))}["Could it have been prevented?"]
    assert (given.game, given.watch) == (key("naive_vs_speedy", 1, 4), "Watch how the RSS driver prevents one")


def test_answers__about_the_ordinary_driver_are_not_about_a_persona():
    row = judged(failures=18, prevented=12)
    given = answers(run_of(failing={"sumo": 0.05}, preventability=table_of("preventability", [row])))
    assert given["Why does it fail?"] == ["The naive ego fails against an ordinary driver in 3 of 60 games."]
    assert given["Could it have been prevented?"] == [
        "The failures of the naive ego against an ordinary driver are not judged."
    ]


def test_answers__name_the_severest_collision_of_the_run_if_it_is_another():
    run = run_of(personas=("speedy", "distracted"))
    run.summary["max_delta_v_mps"] = run.summary["arm"].map({"naive_vs_distracted": 8.0, "retrained_vs_speedy": 2.0})
    assert answers(run)["How severe is it?"][-1] == "The severest of the run: 8.0 m/s, in naive_vs_distracted."
    run.summary["max_delta_v_mps"] = run.summary["arm"].map({"retrained_vs_speedy": 2.0})
    assert "severest" not in " ".join(answers(replace(run))["How severe is it?"])


def test_answers__on_retraining_begin_with_the_person_that_matters_most_and_count_the_rest():
    people = ("speedy", "distracted", "texting", "drowsy", "careful")
    bound = replace(broken("near_miss_rate", "retrained_vs_drowsy"), persona="drowsy")
    lines = answers(run_of(personas=people, acceptance=[bound]))["Does retraining help, and what does it cost?"]
    assert [line.split(":")[0] for line in lines] == [
        "Against drowsy", "Against speedy", "Against distracted", "Against 2 more",
    ]  # fmt: skip
    assert lines[-1] == "Against 2 more: yes for 2."


def test_answers__on_retraining_tell_a_later_round_too():
    later = Arm(ego=RetrainedEgo(against="speedy", round=4), non_ego=PersonaNonEgo(persona="speedy"))
    (line,) = answers(with_arms((later, 5)))["Does retraining help, and what does it cost?"]
    assert "18 failures in 60 games become 2, and 5 in 60 after round 4; " in line


def test_answers__too_few_trainings_say_why():
    arguments = cannot_drive(campaign(personas=["speedy"], failing=LAWFUL, seeds=(1, 2, 3)), seeds=(1,))
    (line,) = answers(RunTables(**arguments))["Does retraining help, and what does it cost?"]
    assert line.startswith("Against speedy: not answered: not enough trainings (in 1 of 3 the person can't drive ")


def test_answers__a_broken_bound_without_a_failure_is_no_failure():
    nothing = LAWFUL | {"retrained": 0.0}
    given = answers(run_of(failing=nothing, acceptance=[broken("near_miss_rate", "retrained_vs_speedy")]))
    assert (
        given["Why does it fail?"][0]
        == "The retrained ego does not fail against speedy: the broken bound is of another kind."
    )


def test_answers__an_ego_that_fails_against_the_baseline_too_is_told_as_such():
    baseline = against_persona(NaiveEgo(), "careful")
    run = with_arms((baseline, 6))
    run = replace(run, manifest={**run.manifest, "baseline": "careful"})
    assert texts(run)["careful"] == ["10 %, 6 of 60", None]
    assert [line.person for line in table_in(run)["lines"] if line.warns] == ["careful"]
    assert answers(run)["Why does it fail?"][-1] == (
        "The naive ego also fails against the baseline, careful, in 6 of 60 games."
    )


def test_answers__an_ego_that_never_fails_is_told_as_such():
    given = answers(run_of(failing=LAWFUL | {"naive": 0.0, "retrained": 0.0}))
    assert given["Why does it fail?"] == ["No ego fails."]
    assert "Could it have been prevented?" not in given
    assert first_answers(RunTables(manifest={}), []) == []
