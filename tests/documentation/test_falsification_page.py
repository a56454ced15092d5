"""The script behind docs/falsification.md: what it searches in, and its tables, of few rows."""

from __future__ import annotations

import pandas as pd
import pytest

from harness.drivers.reference_drivers import UPPER_BOUND
from harness.evaluation.comparisons.games_to_failure import FAILURE, SoonerVerdict
from tests.support.scripts import script

page = script("falsification/every_scene.py")


def pairing(person: str, seed: int = 71, scene: str = "merge", shield: str = "", reason: str = "") -> dict[str, object]:
    arm = f"naive_{'alone' if person == 'nobody' else f'vs_{person}'}"
    return {"scene": scene, "person": person, "seed": seed, "arm": arm, "shield": shield, "reason": reason}


def test_searchable__are_the_answered_arms_of_the_first_training_seed() -> None:
    league = [
        *(pairing(person, seed) for seed in (71, 72) for person in ("nobody", "sumo", "speedy", "texting")),
        pairing("drowsy", reason="the person can't drive this scene"),
        pairing("careful", shield="rss"),
        pairing("sumo", scene="merge_convoy"),  # no person
        pairing("speedy", scene="cut_in"),  # no ordinary driver
        pairing("sumo", scene="cut_in", reason="the ego can't drive this scene"),
    ]
    arms = ["naive_vs_speedy", "naive_vs_sumo", "naive_vs_texting"]
    assert list(page.searchable(pd.DataFrame(league))) == [("merge", 71, arms)]


def compared(
    ego: str, scene: str, criterion: str, by_person: int, by_searcher: int, verdict: SoonerVerdict
) -> dict[str, object]:
    found = {"found_by_person": by_person, "found_by_searcher": by_searcher}
    return {"ego": ego, "scene": scene, "criterion": criterion, "verdict": verdict.value, **found}


@pytest.fixture
def table() -> pd.DataFrame:
    return pd.DataFrame(
        [
            compared("anna", "merge", FAILURE, 10, 0, SoonerVerdict.PERSON),
            compared("anna", "merge", FAILURE, 4, 2, SoonerVerdict.NEITHER),
            compared("anna", "merge", UPPER_BOUND, 3, 0, SoonerVerdict.NEITHER),
            compared("anna", "cut_in", FAILURE, 0, 9, SoonerVerdict.SEARCHER),
            compared("anna", "cut_in", UPPER_BOUND, 0, 0, SoonerVerdict.NOTHING_FOUND),
            compared("bert", "merge", FAILURE, 0, 0, SoonerVerdict.NOTHING_FOUND),
            compared("bert", "merge", UPPER_BOUND, 0, 0, SoonerVerdict.NOTHING_FOUND),
        ]
    )


def test_verdict_rows__count_the_comparisons_of_each_ego_and_criterion(table: pd.DataFrame) -> None:
    assert list(page.verdict_rows(table)) == [
        ["`anna`", "failure", 3, 1, 1, 1, 0],
        ["`anna`", "upper bound", 2, 0, 0, 1, 1],
        ["`bert`", "failure", 1, 0, 0, 0, 1],
        ["`bert`", "upper bound", 1, 0, 0, 0, 1],
    ]


def test_scene_rows__have_the_most_searches_with_a_find_of_each_side(table: pd.DataFrame) -> None:
    assert list(page.scene_rows(table, ["anna", "bert"])) == [
        ["`cut_in`", "learned people", "0 (0)", "–"],
        ["`cut_in`", "searchers", "9 (0)", "–"],
        ["`merge`", "learned people", "10 (3)", "0 (0)"],
        ["`merge`", "searchers", "2 (0)", "0 (0)"],
    ]
