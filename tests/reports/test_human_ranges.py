"""The table `realism` in words and plots."""

from __future__ import annotations

from typing import Any

import pandas as pd

from harness.evaluation.realism import CRASH_ODDS, CRASHES, DECLARED, INSIDE, NOT_COMPARABLE, OUTSIDE
from harness.evaluation.tables import table_of
from harness.reports.human_ranges import crashes_alone, declared_unlike, headline, human_rows, plots, unlike_people

CHANGE: dict[str, Any] = {
    "player": "speedy",
    "seed": 1,
    "figure": "lane_change_s",
    "games": 90,
    "measured_in": "all",
    "value": 2.2,
    "low": 1.9,
    "high": 2.3,
    "people_low": 3.5,
    "people_high": 8.0,
    "realistic": OUTSIDE,
    "source": "VTTI",
}
RED = {**CHANGE, "figure": "latest_red_s_at_most_2", "value": 0.95, "low": None, "high": None}
RED |= {"people_low": 0.9, "people_high": None}
CRASH = {**CHANGE, "figure": CRASHES, "value": 1.4e6, "low": 0.8e6, "high": 2.5e6, "people_low": None}

DECLARED_CHANGE = {**CHANGE, "realistic": DECLARED, "reason": "It is the driver of the paper."}
ODDS = {**CHANGE, "figure": CRASH_ODDS, "value": None, "low": 9.3, "high": None, "people_low": 1.8, "people_high": 7.2}


def table(*rows: dict[str, Any]) -> pd.DataFrame:
    return table_of("realism", rows)


def test_rows__say_the_value_the_spread_and_the_range_of_people() -> None:
    change, red, crash = human_rows(table(CHANGE, {**RED, "realistic": INSIDE}, {**CRASH, "people_high": 2.91}))
    assert (change.figure, change.value, change.measured) == ("lane change (s)", "2.2", "2.2 (1.9 to 2.3)")
    assert (change.people, change.is_outside) == ("3.5 to 8", True)
    assert (red.figure, red.value) == ("passes on red within 2 s of its onset", "95\N{NO-BREAK SPACE}%")
    assert red.measured == red.value
    assert (red.people, red.is_outside) == ("at least 90\N{NO-BREAK SPACE}%", False)
    assert (crash.figure, crash.value) == ("crashes per million km, alone", "1,400,000")
    assert crash.people == "at most 2.91"


def test_rows__name_the_seed_where_there_are_several_and_a_declared_reason() -> None:
    first, second = human_rows(table(CHANGE, {**DECLARED_CHANGE, "seed": 2}))
    assert (first.player, first.realistic) == ("speedy, seed 1", OUTSIDE)
    assert (second.player, second.realistic) == ("speedy, seed 2", "outside, declared: It is the driver of the paper.")
    assert (first.is_outside, second.is_outside) == (True, False)


def test_clauses__of_a_person_name_figure_value_and_range() -> None:
    rows = table(
        CHANGE, {**RED, "value": 0.5}, ODDS, {**CHANGE, "player": "naive ego"}, {**CHANGE, "seed": 2, "value": 9.0}
    )
    assert unlike_people(rows, "speedy", 1).replace("\N{NO-BREAK SPACE}", " ") == (
        "the speedy driver is outside the range of people: lane change 2.2 s, people 3.5 to 8 s; "
        "passes on red within 2 s of its onset 50 %, people at least 90 %; "
        "crash odds against the same person attentive at least 9.3, people 1.8 to 7.2"
    )
    assert unlike_people(rows, "speedy", 2).endswith("people: lane change 9 s, people 3.5 to 8 s")
    known = table(DECLARED_CHANGE, {**RED, "realistic": INSIDE})
    assert unlike_people(known, "speedy", 1) == ""
    declared = "The speedy driver is unlike people, as its persona declares: lane change."
    assert declared_unlike(known, "speedy", 1) == declared
    assert declared_unlike(rows, "speedy", 1) == ""


def test_crashes_alone__are_per_kilometre_and_empty_where_they_were_not_measured() -> None:
    crashes = crashes_alone(table(CHANGE, CRASH), "speedy", 1).replace("\N{NO-BREAK SPACE}", " ")
    assert crashes == "1.4 crashes per km (95 %: 0.8–2.5)"
    assert crashes_alone(table({**CRASH, "value": None}), "speedy", 1) == ""


def test_headline__counts_what_is_outside_by_player() -> None:
    ego = {**CHANGE, "player": "naive ego", "realistic": INSIDE}
    assert headline(table(CHANGE, CRASH, ego)) == "Outside the range of people in 2 of 3 figures: speedy (2)."
    assert headline(table(ego)).startswith("Every player is inside the range of people in each of the 1 figures")
    assert headline(table(DECLARED_CHANGE, ego)) == (
        "Outside the range of people in 0 of 2 figures; in 1 more as declared: speedy (1)."
    )
    missing = {**CHANGE, "realistic": NOT_COMPARABLE}
    assert headline(table(missing)) == "No figure could be compared with those of people."


def test_plots__one_for_each_figure_that_could_be_compared_and_readable_aloud() -> None:
    ego = {**CHANGE, "player": "naive ego", "value": 5.0, "realistic": INSIDE}
    drawn, sources = zip(*plots(table(CHANGE, ego, RED, CRASH, ODDS)), strict=True)
    assert sources == ("VTTI", "VTTI")  # no plot spans crashes of people and of a persona
    assert "speedy: 2.2, people 3.5 to 8: outside; naive ego: 5, people 3.5 to 8: inside" in drawn[0]
    assert plots(table({**CHANGE, "realistic": NOT_COMPARABLE})) == []
