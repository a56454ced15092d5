"""Reasons why games could not be played."""

from __future__ import annotations

import pandas as pd

from harness.evaluation.unplayed_games import reasons_of, were_played


def test_reasons__errors_that_differ_in_numbers_are_one_reason() -> None:
    late, none = "DriverError: drive.pl did not answer within {} s", "DriverError: perl ended with exit code 2"
    assert reasons_of([none, "", late.format(1.5), late.format(10)]) == [
        "2 games: " + late.format(1.5),
        "1 game: " + none,
    ]


def test_reasons__rare_ones_are_counted_together() -> None:
    lines = reasons_of(["a", "a", "b", "b", "c", "c", "d", "e"])
    assert lines[3:] == ["2 games: other reasons, in the column error of episodes.csv"]


def test_reasons__a_long_error_is_one_short_line() -> None:
    (line,) = reasons_of(["x" * 400 + "\n" + "y" * 400])
    assert "\n" not in line
    assert len(line) < 550


def test_played__are_games_without_an_error_and_without_the_outcome_of_one() -> None:
    outcomes, errors = ["goal", "error", "collision", ""], ["", "", "SUMO ended", None]
    assert were_played(pd.DataFrame({"ego_outcome": outcomes, "error": errors})).tolist() == [True, False, False, True]
