"""The table `realism`: players beside published figures of people."""

from __future__ import annotations

import math
from typing import Any

import pandas as pd
import pytest
from scipy.stats import nchypergeom_fisher, norm

from harness.config.persona import COMPARED_WITH_PEOPLE
from harness.evaluation.realism import (
    CRASH_ODDS,
    CRASHES,
    DECLARED,
    INSIDE,
    LEAST_GAMES,
    NOT_COMPARABLE,
    OF_DRIVERS,
    OF_WALKERS,
    OUTSIDE,
    HumanFigure,
    realism,
)
from harness.evaluation.strategies import (
    ATTENTIVE,
    NAIVE_ALONE,
    Arm,
    Borrowed,
    NaiveEgo,
    PersonaNonEgo,
    against_persona,
    persona_alone,
)
from harness.evaluation.tables import table_of

ARMS = {arm.name: arm for arm in (NAIVE_ALONE, persona_alone("speedy"), against_persona(NaiveEgo(), "speedy"))}


def games(arm: str, player: str, count: int = LEAST_GAMES, **cells: Any) -> pd.DataFrame:
    """So many games of an arm over 200 m; a list has a cell for each game."""
    usual = {"persona": "speedy", "outcome": "goal", "distance_m": 200.0}
    columns = {"arm": arm, "player": player, "seed": 1, "episode": range(count), **usual, **cells}
    return table_of("conduct", pd.DataFrame(columns).to_dict("records"))


def found(
    *frames: pd.DataFrame,
    arms: dict[str, Arm] = ARMS,
    declared: dict[str, dict[str, str]] = {},  # noqa: B006
    of_people: tuple[HumanFigure, ...] = OF_DRIVERS,
) -> dict[Any, dict[Any, Any]]:
    rows = realism(pd.concat(frames, ignore_index=True), arms, declared, of_people)
    return {(row["player"], row["figure"]): row for row in rows.to_dict("records")}


def test_realism__compares_the_median_with_the_range_of_people() -> None:
    changes = found(games("speedy_alone", "non_ego", lane_change_s=[1.0, 2.0, 5.0, 6.0, 20.0]))
    row = changes["speedy", "lane_change_s"]
    assert (row["value"], row["people_low"], row["people_high"], row["realistic"]) == (5.0, 3.5, 8.0, INSIDE)
    assert (row["low"], row["high"]) == (pytest.approx(1.2), pytest.approx(17.2))  # 5 and 95 % of five games
    hasty = found(games("speedy_alone", "non_ego", lane_change_s=2.0))
    assert hasty["speedy", "lane_change_s"]["realistic"] == OUTSIDE


def test_speed_over_the_limit__is_the_middle_90_percent_of_drivers_of_whom_56_percent_speed() -> None:
    """17.5 % exceed the limit by 10 mph (4.47 m/s) or more."""
    above, far_above = norm.isf(0.56), norm.isf(0.175)
    spread = 4.4704 / (far_above - above)
    (figure,) = (each for each in OF_DRIVERS if each.metric == "free_over_limit_mps")
    ends = [-above * spread + sign * norm.ppf(0.95) * spread for sign in (-1.0, 1.0)]
    assert (figure.low, figure.high) == (pytest.approx(ends[0], abs=0.05), pytest.approx(ends[1], abs=0.05))


def test_realism__compares_the_share_of_games_where_people_s_figure_is_one() -> None:
    row = found(games("naive_vs_speedy", "non_ego", 10, latest_red_s=[1.0] * 9 + [8.0]))[
        "speedy", "latest_red_s_at_most_2"
    ]
    assert (row["value"], row["realistic"]) == (pytest.approx(0.9), INSIDE)
    assert math.isnan(row["low"])  # a quantile of the metric, in seconds, is no share
    assert math.isnan(row["high"])


def test_realism__too_few_games_or_no_published_range_are_not_compared() -> None:
    rows = found(games("naive_alone", "ego", lane_change_s=[5.0] * 4 + [math.nan], steering_reversals_per_s=1.0))
    few, unknown = rows["naive ego", "lane_change_s"], rows["naive ego", "steering_reversals_per_s"]
    assert (few["games"], few["realistic"], few["reason"]) == (4, NOT_COMPARABLE, "measured in fewer than 5 games")
    assert math.isnan(few["value"])
    assert (unknown["value"], unknown["realistic"]) == (1.0, NOT_COMPARABLE)
    assert unknown["reason"] == "no published range was found"


def test_realism__what_a_road_user_asks_of_a_player_is_no_part_of_its_driving_alone() -> None:
    rows = found(
        games("naive_alone", "ego", max_deceleration_mps2=1.0, max_jerk_mps3=1.0),
        games("naive_vs_speedy", "ego", max_deceleration_mps2=7.0, max_jerk_mps3=20.0),
    )
    braking, jerk = rows["naive ego", "max_deceleration_mps2"], rows["naive ego", "max_jerk_mps3"]
    assert (braking["games"], braking["value"]) == (5, 1.0)
    assert (jerk["games"], jerk["value"]) == (10, 10.5)


def test_crashes__are_outside_where_the_interval_is_above_the_rate_of_people() -> None:
    """Exact Poisson intervals: of one crash 0.0253 to 5.572, of none 0 to 3.689; here in a kilometre."""
    crash = found(games("speedy_alone", "non_ego", outcome=["goal"] * 4 + ["rail"]))["speedy", CRASHES]
    assert crash["value"] == pytest.approx(1e6)
    assert (crash["low"], crash["high"]) == (pytest.approx(25_318, rel=1e-3), pytest.approx(5_571_643, rel=1e-3))
    assert crash["realistic"] == OUTSIDE
    none = found(games("speedy_alone", "non_ego"))["speedy", CRASHES]
    assert (none["value"], none["low"], none["realistic"]) == (0.0, 0.0, NOT_COMPARABLE)
    assert none["reason"] == "1.0 km without another player are too few to tell"
    assert none["high"] == pytest.approx(3_688_879, rel=1e-3)


def test_crash_odds__are_those_alone_against_the_same_person_without_lapses() -> None:
    """Of 13 crashes in all, those with lapses have Fisher's noncentral hypergeometric distribution: the estimate makes
    10 their mean, and at the ends of the interval 10 or more, or 10 or fewer, have the probability 0.025."""
    arms = ARMS | {"speedy_attentive_alone": persona_alone("speedy", ATTENTIVE)}

    def odds(crashes: int, attentive: int) -> dict[Any, Any]:
        sides = (("speedy_alone", crashes), ("speedy_attentive_alone", attentive))
        frames = [games(arm, "non_ego", 50, outcome=["rail"] * n + ["goal"] * (50 - n)) for arm, n in sides]
        return found(*frames, arms=arms)["speedy", CRASH_ODDS]

    row = odds(10, 3)
    assert nchypergeom_fisher(100, 13, 50, row["value"]).mean() == pytest.approx(10.0)
    assert nchypergeom_fisher(100, 13, 50, row["low"]).sf(9) == pytest.approx(0.025, rel=1e-3)
    assert nchypergeom_fisher(100, 13, 50, row["high"]).cdf(10) == pytest.approx(0.025, rel=1e-3)
    assert (row["games"], row["people_low"], row["people_high"], row["realistic"]) == (100, 1.8, 7.2, INSIDE)
    never = odds(20, 0)  # an infinite estimate: the interval alone tells
    assert (math.isnan(never["value"]), never["realistic"]) == (True, OUTSIDE)
    assert never["low"] > 7.2
    few = odds(1, 1)
    assert (few["value"], few["realistic"]) == (pytest.approx(1.0), NOT_COMPARABLE)
    assert few["reason"] == "crashes in 1 of 50 games with lapses and in 1 of 50 without are too few to tell"
    none = odds(0, 0)
    assert (math.isnan(none["value"]), none["realistic"]) == (True, NOT_COMPARABLE)


def test_crash_odds__do_not_mix_the_attentive_games_with_the_person_s_own() -> None:
    arms = ARMS | {"speedy_attentive_alone": persona_alone("speedy", ATTENTIVE)}
    own = games("speedy_alone", "non_ego", lane_change_s=5.0)
    attentive = games("speedy_attentive_alone", "non_ego", lane_change_s=1.0)
    rows = found(own, attentive, arms=arms)
    assert (rows["speedy", "lane_change_s"]["games"], rows["speedy", "lane_change_s"]["value"]) == (5, 5.0)
    assert {player for player, _ in rows} == {"speedy"}
    assert ("speedy", CRASH_ODDS) not in found(own)  # a person without lapses


def test_players__an_arm_that_exchanges_a_trait_is_no_drive_of_theirs() -> None:
    person = PersonaNonEgo(persona="speedy", borrowed=Borrowed(trait="reaction", of="careful"))
    arm = Arm(ego=NaiveEgo(), non_ego=person)
    own = [games("naive_vs_speedy", player, lane_change_s=5.0) for player in ("ego", "non_ego")]
    exchanged = [games(arm.name, player, lane_change_s=1.0) for player in ("ego", "non_ego")]
    rows = found(*own, *exchanged, arms=ARMS | {arm.name: arm})
    assert {rows[player, "lane_change_s"]["games"] for player in ("naive ego", "speedy")} == {LEAST_GAMES}


def test_seeds__have_rows_of_their_own() -> None:
    arms = (
        games("speedy_alone", "non_ego", lane_change_s=5.0),
        games("speedy_alone", "non_ego", seed=2, lane_change_s=2.0),
    )
    rows = realism(pd.concat(arms), ARMS, {}, OF_DRIVERS).query("figure == 'lane_change_s'")
    assert list(zip(rows["seed"], rows["realistic"], strict=True)) == [(1, INSIDE), (2, OUTSIDE)]


def test_declared__figures_say_the_reason_where_they_are_outside() -> None:
    reasons = {"speedy": {"lane_change_s": "It is the driver of the paper.", "max_jerk_mps3": "The same."}}
    rows = found(games("speedy_alone", "non_ego", lane_change_s=2.0, max_jerk_mps3=1.0), declared=reasons)
    change, jerk = rows["speedy", "lane_change_s"], rows["speedy", "max_jerk_mps3"]
    assert (change["realistic"], change["reason"]) == (DECLARED, "It is the driver of the paper.")
    assert (jerk["realistic"], jerk["reason"]) == (INSIDE, "")


def test_figures__that_a_persona_may_declare_are_those_with_a_published_range() -> None:
    published = {each.name for each in (*OF_DRIVERS, *OF_WALKERS) if each.source}
    assert {*COMPARED_WITH_PEOPLE} == published | {CRASHES, CRASH_ODDS}


def test_players__egos_drive_and_people_on_foot_have_figures_of_their_own() -> None:
    rows = found(games("naive_alone", "ego"), games("speedy_alone", "non_ego"), of_people=OF_WALKERS)
    assert [figure for player, figure in rows if player == "naive ego"] == [
        *(each.name for each in OF_DRIVERS),
        CRASHES,
    ]
    assert [figure for player, figure in rows if player == "speedy"] == [*(each.name for each in OF_WALKERS), CRASHES]


def test_players__a_population_is_none() -> None:
    arms = {arm.name: arm for arm in (NAIVE_ALONE, against_persona(NaiveEgo(), "commuters"))}
    rows = found(games("naive_alone", "ego"), games("naive_vs_commuters", "non_ego", persona="commuters"), arms=arms)
    assert {player for player, _ in rows} == {"naive ego"}
