"""The table `realism` in words and plots."""

from __future__ import annotations

from typing import Any

import pandas as pd

from harness.evaluation.realism import CRASHES, INSIDE, NOT_COMPARABLE, OUTSIDE
from harness.evaluation.tables import table_of
from harness.reports.human_ranges import headline, human_rows, plots

CHANGE: dict[str, Any] = {
    "player": "speedy",
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
RED = {**CHANGE, "figure": "latest_red_s_at_most_2", "value": 0.95, "people_low": 0.9, "people_high": None}
CRASH = {**CHANGE, "figure": CRASHES, "value": 1.4e6, "low": 0.8e6, "high": 2.5e6, "people_low": None}


def table(*rows: dict[str, Any]) -> pd.DataFrame:
    return table_of("realism", rows)


def test_rows__say_the_value_the_spread_and_the_range_of_people() -> None:
    change, red, crash = human_rows(table(CHANGE, {**RED, "realistic": INSIDE}, {**CRASH, "people_high": 2.91}))
    assert (change.figure, change.value, change.spread) == ("lane change (s)", "2.2", "1.9 to 2.3")
    assert (change.people, change.is_outside) == ("3.5 to 8", True)
    assert (red.figure, red.value) == ("passes on red within 2 s of its onset", "95\N{NO-BREAK SPACE}%")
    assert (red.people, red.is_outside) == ("at least 90\N{NO-BREAK SPACE}%", False)
    assert (crash.figure, crash.value) == ("crashes per million km, alone", "1,400,000")
    assert crash.people == "at most 2.91"


def test_headline__counts_what_is_outside_by_player() -> None:
    ego = {**CHANGE, "player": "naive ego", "realistic": INSIDE}
    assert headline(table(CHANGE, CRASH, ego)) == "Outside the range of people in 2 of 3 figures: speedy (2)."
    assert headline(table(ego)).startswith("Every player is inside the range of people in each of the 1 figures")
    missing = {**CHANGE, "realistic": NOT_COMPARABLE}
    assert headline(table(missing)) == "No figure could be compared with those of people."


def test_plots__one_for_each_figure_that_could_be_compared_and_readable_aloud() -> None:
    ego = {**CHANGE, "player": "naive ego", "value": 5.0, "realistic": INSIDE}
    drawn, sources = zip(*plots(table(CHANGE, ego, RED, CRASH)), strict=True)
    assert sources == ("VTTI", "VTTI")  # no plot spans crashes of people and of a persona
    assert "speedy: 2.2, people 3.5 to 8: outside; naive ego: 5, people 3.5 to 8: inside" in drawn[0]
    assert plots(table({**CHANGE, "realistic": NOT_COMPARABLE})) == []
