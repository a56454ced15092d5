"""The competence gate: a verdict counts only if its players reach their goals alone."""

from __future__ import annotations

from dataclasses import replace

import pandas as pd
import pytest

from harness.evaluation.comparisons.comparison import compare, games_by_arm
from harness.evaluation.competence import AloneBound, Goals, Question, Verdict, gate, gate_of, goals_alone

EGO = AloneBound(player="ego", words="the naive ego", arm="naive_alone", goal_share=0.97)
PERSON = AloneBound(player="non_ego", words="the speedy driver", arm="speedy_alone", goal_share=0.8)
RQ1 = Question(
    question="RQ1",
    persona="speedy",
    seed=1,
    baseline="naive_alone",
    treatment="naive_vs_speedy",
    alone=(EGO, PERSON),
)
WRECK = {"goal": 0, "rail": 1, "error": None, "": None}


def arm(name: str, *, ego: list[str] | None = None, non_ego: list[str] | None = None) -> pd.DataFrame:
    """Games of an arm by the outcomes of its players; a player of None does not take part."""
    count = len(ego or non_ego or [])
    outcomes = {"ego": ego or [""] * count, "non_ego": non_ego or [""] * count}
    either = zip(*outcomes.values(), strict=True)
    return pd.DataFrame(
        {
            "arm": name,
            "seed": 1,
            "episode": range(count),
            "ego_outcome": outcomes["ego"],
            "ego_failed": pd.array([WRECK[each] for each in outcomes["ego"]], dtype="Int64"),
            "ego_mean_speed_mps": [12.0 + 0.1 * place for place in range(count)],
            "non_ego_outcome": outcomes["non_ego"],
            "ego_red_lights": 0.0,
            "ego_wrong_way_s": 0.0,
            "error": ["it died" if "error" in pair else "" for pair in either],
        }
    )


def goals(reached: int, of: int) -> list[str]:
    return ["goal"] * reached + ["rail"] * (of - reached)


def table(ego: int, person: int, of: int = 100) -> pd.DataFrame:
    """RQ1's games: each player's goals alone, and a person against which the ego always fails."""
    return pd.concat(
        [
            arm("naive_alone", ego=goals(ego, of)),
            arm("speedy_alone", non_ego=goals(person, of)),
            arm("naive_vs_speedy", ego=goals(1, of), non_ego=goals(0, of)),
        ],
        ignore_index=True,
    )


def compared(episodes: pd.DataFrame, *questions: Question) -> list[dict[str, object]]:
    return compare(questions or [RQ1], episodes, 0.01).to_dict("records")  # type: ignore[return-value]


# --- the share of goals -----------------------------------------------------------------------------------------------


def test_goals__are_counted_over_the_games_that_could_be_played() -> None:
    games = arm("speedy_alone", non_ego=["goal", "rail", "error", "goal"])
    assert goals_alone(games, "non_ego") == Goals(goals=2, played=3)
    assert goals_alone(games, "ego") == Goals(goals=0, played=0)  # it does not take part
    assert goals_alone(None, "ego") == Goals(goals=0, played=0)


def test_goals__of_an_ego_on_red_or_among_oncoming_lanes_do_not_count() -> None:
    games = arm("naive_alone", ego=["goal", "goal", "goal", "goal", "rail"]).assign(
        ego_red_lights=[0.0, 1.0, 0.0, None, 2.0], ego_wrong_way_s=[0.9, 3.0, 1.0, None, 8.0]
    )
    goals = goals_alone(games, "ego")
    assert goals == Goals(goals=2, played=5, on_red=1, wrong_way=1)
    assert goals.below(0.97) == (
        "alone it reaches its goal in 2 of 5 games (40 %), and in 1 more after passing a red light, "
        "and in 1 more after driving among oncoming lanes, below 97 %"
    )
    assert Goals.recorded(goals.record()) == goals


def test_goals__suffice_from_the_bound_on() -> None:
    assert [Goals(goals=goals, played=100).suffice(0.97) for goals in (100, 97, 96, 0)] == [True, True, False, False]
    assert not Goals(goals=0, played=0).suffice(0.97)


def test_goals__a_share_below_its_bound_is_never_shown_as_the_bound() -> None:
    text = Goals(goals=969_999, played=1_000_000).below(0.97)
    assert text == "alone it reaches its goal in 969999 of 1000000 games (96.9 %), below 97 %"


# --- the gate ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("ego", "person", "verdict"),
    [
        (97, 80, ""),
        (96, 80, Verdict.EGO_CANNOT_DRIVE),
        (97, 79, Verdict.NON_EGO_CANNOT_DRIVE),
        (0, 0, Verdict.NEITHER_CAN_DRIVE),
    ],
)
def test_gate__names_who_cannot_drive(ego: int, person: int, verdict: str) -> None:
    found = gate(RQ1.alone, 1, games_by_arm(table(ego, person)))
    assert found["verdict"] == verdict
    share = Goals(goals=person, played=100).below(0.8)
    assert ("the naive ego can't drive this scene" in found["reason"]) == (ego < 97)
    assert (f"the speedy driver can't drive this scene: {share}" in found["reason"]) == (person < 80)


def test_gate__players_that_were_not_played_alone_are_not_taken_on_trust() -> None:
    episodes = pd.concat([table(100, 100), table(100, 100).query("arm != 'speedy_alone'").assign(seed=2)])
    games = games_by_arm(episodes)
    assert gate(RQ1.alone, 1, games) == {"verdict": "", "reason": ""}
    closed = gate(RQ1.alone, 2, games)
    assert closed["verdict"] == Verdict.NOT_PLAYED_ALONE.value
    assert "the arm speedy_alone is not finished" in closed["reason"]
    unplayed = episodes.assign(error=episodes["error"].where(episodes["arm"] != "speedy_alone", "SUMO died"))
    assert "no game of the arm speedy_alone could be played" in gate(RQ1.alone, 1, games_by_arm(unplayed))["reason"]


def test_gate__an_ego_that_fails_against_everybody_answers_nothing() -> None:
    bound = replace(RQ1.alone[0], arm="naive_vs_sumo", where="beside anybody")
    games = games_by_arm(arm("naive_vs_sumo", ego=["goal"] * 4 + ["rail"]))
    found = gate([bound], 1, games)
    assert found["verdict"] == Verdict.EGO_CANNOT_DRIVE.value
    words = "beside anybody it reaches its goal in 4 of 5 games (80 %), below 97 %"
    assert found["reason"] == f"the naive ego can't drive this scene: {words}"


def test_gate__a_bound_of_0_asks_nothing() -> None:
    free = [AloneBound(player="ego", words="the naive ego", arm="naive_alone", goal_share=0.0)]
    assert gate(free, 1, {}) == gate([], 1, {}) == {"verdict": "", "reason": ""}


# --- comparisons ------------------------------------------------------------------------------------------------------


def test_compare__the_failures_of_a_person_that_cannot_drive_are_no_answer() -> None:
    """A person that never makes its turn and wrecks itself in front of the ego gave "30 of 30, p < 0.0001"."""
    answered, _ = compared(table(100, 100, of=30))
    assert (answered["verdict"], answered["reason"]) == ("significant", "")
    for row in compared(table(30, 0, of=30)):
        assert row["verdict"] == Verdict.NON_EGO_CANNOT_DRIVE.value
        assert row["reason"]
        assert not row["rejects_h0"]
        assert (row["pairs"], row["pairs_left_out"]) == (30, 0)
        for name in ("t", "p_value", "p_holm", "ci_low", "ci_high", "effect_size", "mcnemar_p"):
            assert pd.isna(row[name]), name  # type: ignore[call-overload]
    failure, _ = compared(table(30, 0, of=30))
    assert failure["mean_difference"] == 29 / 30  # what happened in the games stays


def test_compare__unanswered_questions_stay_in_holms_family() -> None:
    mild = arm("naive_vs_bert", ego=["rail"] * 5 + ["goal"] * 25, non_ego=["goal"] * 30)
    alone = arm("bert_alone", non_ego=["goal"] * 30)
    bert = replace(PERSON, words="the bert driver", arm="bert_alone")
    asked = replace(RQ1, persona="bert", treatment="naive_vs_bert", alone=(EGO, bert))
    episodes = pd.concat([table(30, 0, of=30), mild, alone], ignore_index=True)
    with_it = [row for row in compared(episodes, RQ1, asked) if row["persona"] == "bert"]
    assert with_it[0]["planned_tests"] == 2
    assert with_it[0]["p_holm"] == 2 * with_it[0]["p_value"]  # type: ignore[operator]


# --- a person that is unlike people -----------------------------------------------------------------------------------

UNLIKE = "the speedy driver is outside the range of people: lane change 2.2 s, people 3.5 to 8 s"


def test_compare__a_question_about_a_person_unlike_people_is_not_answered() -> None:
    answered, other = replace(RQ1, seed=1), replace(RQ1, unlike_people=UNLIKE)
    (counted, _), (withheld, speed) = compared(table(100, 100), answered), compared(table(100, 100), other)
    assert counted["verdict"] == Verdict.SIGNIFICANT.value
    for row in (withheld, speed):
        assert (row["verdict"], row["reason"]) == (Verdict.UNLIKE_PEOPLE.value, UNLIKE)
        assert not row["rejects_h0"]
        assert all(pd.isna(row[name]) for name in ("t", "p_value", "p_holm", "effect_size", "mcnemar_p"))  # type: ignore[call-overload]
    assert withheld["mean_difference"] == counted["mean_difference"] == 0.99


def test_gate_of__want_of_competence_goes_before() -> None:
    question, games = replace(RQ1, unlike_people=UNLIKE), games_by_arm(table(100, 79))
    assert gate_of(question, games) == gate(RQ1.alone, 1, games)
    assert gate_of(question, games)["verdict"] == Verdict.NON_EGO_CANNOT_DRIVE.value
