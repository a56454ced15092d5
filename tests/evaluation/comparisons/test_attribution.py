"""The table of traits, from made-up outcomes, compared with values computed by hand."""

from __future__ import annotations

import math
from typing import Any

import pandas as pd
import pytest
from scipy import stats

from harness.evaluation.comparisons.attribution import attribute, examples
from harness.evaluation.competence import ALL_TRAITS, AloneBound, TraitQuestion
from tests.support.game_tables import arm, table

OWN, WITHOUT = "naive_vs_speedy", "naive_vs_speedy_with_shoulder_glance_of_careful"
BASELINE, ALONE = "naive_vs_careful", "naive_vs_careful_with_shoulder_glance_of_speedy"
FAILED: dict[str, list[int | None]] = {
    OWN: [1, 1, 1, 1, 1, 1, 0, 0, 0, 0],
    WITHOUT: [0, 0, 0, 0, 1, None, 1, 0, 0, 0],
    BASELINE: [0, 0, 0, 0, 0, 0, 0, 0, 0, 1],
    ALONE: [1, 1, 0, 0, 0, 0, 0, 0, 0, 1],
}


def question(**changes: Any) -> TraitQuestion:
    usual = {"persona": "speedy", "seed": 1, "trait": "shoulder_glance", "arm": OWN, "without_arm": WITHOUT}
    return TraitQuestion(**{**usual, "baseline_arm": BASELINE, "alone_arm": ALONE, **changes})


def of_all(**changes: Any) -> TraitQuestion:
    return question(trait=ALL_TRAITS, without_arm=BASELINE, alone_arm="", **changes)


def rows(*questions: TraitQuestion, failed: dict[str, list[int | None]] = FAILED) -> list[dict[Any, Any]]:
    episodes = table(*(arm(name, ego_failed=each) for name, each in failed.items()))
    return attribute(questions, episodes).to_dict("records")


def test_without__nine_pairs_of_which_four_fail_only_with_the_trait_and_one_only_without() -> None:
    (row,) = rows(question())
    assert (row["without_pairs"], row["without_pairs_left_out"]) == (9, 1)
    assert (row["failures"], row["failures_without"]) == (5, 2)
    assert row["without_difference"] == pytest.approx(3 / 9)
    # the differences are 4 times 1, 4 times 0 and once -1: squares 5, so the variance is (5 - 9 / 9) / 8
    half = stats.t.ppf(0.975, 8) * math.sqrt((5 - 9 * (1 / 3) ** 2) / 8 / 9)
    assert (row["without_difference_low"], row["without_difference_high"]) == pytest.approx(
        (1 / 3 - half, 1 / 3 + half)
    )
    assert row["without_p"] == pytest.approx(2 * (1 + 5) / 2**5)  # of 5 pairs that differ, 4 or more in one direction
    assert row["reason"] == ""


def test_alone__the_baseline_fails_more_with_the_trait_by_itself() -> None:
    (row,) = rows(question())
    assert (row["alone_pairs"], row["alone_pairs_left_out"]) == (10, 0)
    assert (row["failures_baseline"], row["failures_alone"]) == (1, 3)
    assert row["alone_difference"] == pytest.approx(0.2)
    assert row["alone_p"] == pytest.approx(2 / 2**2)
    assert (row["without_p_holm"], row["alone_p_holm"]) == pytest.approx((2 * 0.375, 0.75))


def test_all_traits__are_the_person_against_the_baseline() -> None:
    (row,) = rows(of_all())
    assert (row["failures"], row["failures_without"]) == (6, 1)
    assert row["without_p"] == pytest.approx(2 * (1 + 7) / 2**7)  # 6 of 7
    assert all(pd.isna(row[name]) for name in row if name != "alone_arm" and name.startswith("alone_"))


def test_example__is_the_worst_game_that_the_trait_decides() -> None:
    (row,) = rows(question())
    assert row["example"] in (0, 1, 2, 3)
    found = attribute([of_all(), question()], table(*(arm(name, ego_failed=each) for name, each in FAILED.items())))
    assert examples(found[found["trait"] != ALL_TRAITS]) == [(OWN, 1, row["example"]), (WITHOUT, 1, row["example"])]
    never: dict[str, list[int | None]] = {name: [0, 0, 0] for name in FAILED}
    (row,) = rows(question(), failed=never)
    assert pd.isna(row["example"])
    assert (row["without_difference"], row["without_p"]) == (0.0, 1.0)


def test_gate__without_a_baseline_that_drives_there_are_counts_and_no_test() -> None:
    words = "the careful driver"
    bound = AloneBound(player="non_ego", words=words, arm="careful_alone", goal_share=0.8)
    (row,) = rows(question(bounds=(bound,)))
    assert words in row["reason"]
    assert (row["failures"], row["failures_without"], row["without_difference"]) == (5, 2, pytest.approx(3 / 9))
    assert all(row[name] != row[name] for name in row if name.endswith(("_low", "_high", "_p", "_p_holm")))


def test_seeds__are_rows_by_themselves_and_a_missing_arm_has_no_pairs() -> None:
    first, second = rows(question(), question(seed=2))
    assert (first["seed"], second["seed"]) == (1, 2)
    assert (second["without_pairs"], second["failures"]) == (0, 0)
    assert second["without_difference"] != second["without_difference"]


def test_table__without_questions_is_empty() -> None:
    assert attribute([], table(arm(OWN, ego_failed=[0]))).empty
