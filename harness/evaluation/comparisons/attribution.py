"""Attribution: which trait of a person makes the ego fail, and in how many games.

Each trait is judged twice, in pairs of games of the same start: the person with all of its traits against the person
without this one, and the baseline person with this trait alone against the baseline as it is. The first says what the
person would be without the trait, the second what the trait does by itself. They differ where traits act together.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import pandas as pd

from harness.evaluation.comparisons.comparison import games_by_arm, holm, mcnemar, mean_cells, pairs_of
from harness.evaluation.competence import TraitQuestion, gate
from harness.evaluation.tables import table_of
from harness.evaluation.worst_first import worst_first
from harness.game.arrays import FloatArray

_FAILED = "ego_failed"
_TESTS = ("without_p", "alone_p")


def attribute(questions: Iterable[TraitQuestion], episodes: pd.DataFrame) -> pd.DataFrame:
    """A row for each question, the table `attribution`. `episodes` is the table of this name.

    A pair is left out, and counted, where either game could not be played or is missing. Behind a closed gate
    (`competence.gate`) a row has its counts and a reason, and no interval and no test.
    """
    games = games_by_arm(episodes)
    rows = [_row(question, games) for question in questions]
    tests = np.array([[row.get(name, np.nan) for name in _TESTS] for row in rows], dtype=np.float64).reshape(-1, 2)
    corrected = holm(tests.ravel()).reshape(tests.shape)
    for row, of_row in zip(rows, corrected, strict=True):
        row |= {f"{name}_holm": p for name, p in zip(_TESTS, of_row, strict=True)}
    return table_of("attribution", rows)


def examples(attribution: pd.DataFrame) -> list[tuple[str, int, int]]:
    """Arm, seed and episode of the games that show what traits do, from the table `attribution`: for each persona and
    trait one game with it and the same start without it."""
    shown = attribution[attribution["example"].notna()].drop_duplicates(["persona", "trait"]).to_dict("records")
    return [(row[arm], row["seed"], int(row["example"])) for row in shown for arm in ("arm", "without_arm")]


def _row(question: TraitQuestion, games: Mapping[Any, pd.DataFrame]) -> dict[str, Any]:
    reason = gate(question.bounds, question.seed, games)["reason"]
    row = {name: value for name, value in vars(question).items() if name != "bounds"}
    row |= {"reason": reason, "example": _example(question, games)}
    sides = {
        "without": (question.without_arm, question.arm, "failures_without", "failures"),
        "alone": (question.baseline_arm, question.alone_arm, "failures_baseline", "failures_alone"),
    }
    for name, (lacking, having, failures_lacking, failures_having) in sides.items():
        if having:
            low, high, left_out = pairs_of(games, question.seed, lacking, having, [_FAILED])
            row |= {f"{name}_pairs": len(low), f"{name}_pairs_left_out": left_out}
            row |= {failures_lacking: int(low.sum()), failures_having: int(high.sum())}
            row |= _difference(name, (high - low)[:, 0], tested=not reason)
    return row


def _difference(name: str, caused: FloatArray, *, tested: bool) -> dict[str, float]:
    """The cells of a comparison from the differences [N] of failures in its pairs, with the trait minus without."""
    column = f"{name}_difference"
    cells = mean_cells(column, caused)
    if not tested or not len(caused):
        return {column: cells[column]}
    return cells | {f"{name}_p": mcnemar(caused, "two-sided")}


def _example(question: TraitQuestion, games: Mapping[Any, pd.DataFrame]) -> int | None:
    """The worst game that the ego fails against the person and not, from the same start, without the trait."""
    own, without = (games.get((arm, question.seed)) for arm in (question.arm, question.without_arm))
    if own is None or without is None:
        return None
    spared = without[(without[_FAILED] == 0).fillna(False)]
    failed = own[(own[_FAILED] == 1).fillna(False) & own["episode"].isin(spared["episode"])]
    return int(worst_first(failed)["episode"].iloc[0]) if len(failed) else None
