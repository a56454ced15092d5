"""The section on traits: its sentences, by hand."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pandas as pd

from harness.evaluation.tables import table_of
from harness.reports.attribution_section import attribution_section
from harness.reports.game_links import GameLinks
from harness.reports.numbers import NO_SPACE
from harness.reports.run_tables import RunTables
from tests.support.game_tables import OWN, WITHOUT, arm, table, trait_row

MANIFEST = {"personas": ["speedy"], "baseline": "careful", "campaign": {"assessment": {"significance": 0.01}}}


def section(
    *rows: dict[str, Any], undecided: Sequence[dict[str, Any]] = (), embedded: Sequence[str] = ()
) -> dict[str, Any]:
    episodes: pd.DataFrame = table(arm(OWN, ego_failed=[1] * 9), arm(WITHOUT, ego_failed=[0] * 9))
    tables = RunTables(
        manifest=MANIFEST,
        episodes=episodes,
        attribution=table_of("attribution", rows),
        undecided=table_of("undecided", undecided),
    )
    (found,) = attribution_section(tables, GameLinks(embedded=embedded, episodes=episodes))
    return found


def texts(*rows: dict[str, Any], **options: Any) -> list[str]:
    return [line["text"] for line in section(*rows, **options)["lines"]]


def test_sentence__names_the_trait_with_the_most_failures() -> None:
    found = texts(trait_row("all", 26, 2), trait_row("payoff", 26, 20), trait_row("shoulder_glance", 26, 3))
    assert found == [
        "With the shoulder glances of careful, speedy makes the naive ego fail in 3 of 100 games instead of 26. "
        "With the shoulder glances of speedy, careful makes it fail in 9 of 100 instead of 2."
    ]


def test_sentence__says_what_can_be_chance_and_what_several_trainings_say() -> None:
    (one,) = texts(trait_row("payoff", 26, 20, p=0.2))
    assert "instead of 26. The difference can be chance. With" in one
    (two,) = texts(trait_row("payoff", 26, 20, p=0.2), trait_row("payoff", 30, 1, seed=2))
    assert (
        "fail in 21 of 200 games of 2 trainings instead of 56. The difference is significant in 1 of 2 trainings" in two
    )


def test_sentence__without_failures_or_without_a_trait_that_causes_any() -> None:
    assert texts(trait_row("payoff", 0, 0)) == [
        "Against speedy the naive ego fails in none of 100 games: no trait causes failures."
    ]
    assert texts(trait_row("payoff", 5, 7)) == [
        "No trait by itself: the naive ego fails in 5 of 100 games against speedy, and in no fewer with any one trait "
        "of careful instead."
    ]


def test_sentence__of_players_that_can_not_drive_is_the_reason() -> None:
    assert texts(trait_row("payoff", 26, 20, reason="the careful driver can't drive this scene")) == [
        "Not answered: The careful driver can't drive this scene."
    ]


def test_sentence__is_about_the_trainings_that_are_answered() -> None:
    reason = "the careful driver can't drive this scene"
    withheld, answered = texts(trait_row("payoff", 26, 20, reason=reason, seed=3), trait_row("payoff", 26, 3))
    assert withheld == "Not answered for training seed 3: The careful driver can't drive this scene."
    assert answered.startswith("With the payoff and policy of careful, speedy makes the naive ego fail in 3 of 100")


def test_undecided__is_a_sentence_where_there_are_such_failures() -> None:
    counts = {"failures": 26, "undecided_all_game": 1, "undecided_since_conflict": 12, "undecided_last_second": 9}
    _, found = texts(trait_row("payoff", 26, 3), undecided=[{"arm": OWN, "persona": "speedy", "seed": 1, **counts}])
    assert found == (
        "In 9 of 26 failures speedy decided nothing in the last second, in 12 since the conflict began, in 1 in the "
        "whole game: its attention had lapsed."
    )


def test_game__is_that_with_the_trait_beside_that_without() -> None:
    keys = [f"{OWN},1,4", f"{WITHOUT},1,4"]
    (line,) = section(trait_row("payoff", 26, 3, example=4), embedded=keys)["lines"]
    assert line["game"] == f"#game={keys[0]}&with={keys[1]}"
    (line,) = section(trait_row("payoff", 26, 3, example=4), embedded=keys[:1])["lines"]
    assert line["game"] == f"#game={keys[0]}"
    (line,) = section(trait_row("payoff", 26, 3, example=4))["lines"]
    assert line["game"] == ""


def test_rows__have_counts_differences_and_p() -> None:
    (cells,) = section(trait_row("attention", 26, 3, without_difference_low=0.1, without_difference_high=0.36))["rows"]
    assert cells["trait"] == "attention"
    assert [each.replace(NO_SPACE, " ") for each in cells["cells"]] == [
        *("26 of 100", "3 of 100", "23 points (10 to 36)", "< 0.0001"),
        *("2 of 100", "9 of 100", "7 points", "–"),
    ]
