"""The table of perception errors, by hand."""

from __future__ import annotations

import math
from typing import Any

import pandas as pd
import pytest

from harness.evaluation.comparisons.perception_comparison import compare_perception
from harness.evaluation.strategies import NAIVE_ALONE, Arm, ErrorFreeEgo, NaiveEgo, against_persona
from harness.evaluation.tables import table_of

WITH, WITHOUT = (against_persona(ego, "speedy") for ego in (NaiveEgo(), ErrorFreeEgo(of=NaiveEgo())))
ALONE_WITHOUT = Arm(ego=ErrorFreeEgo(of=NaiveEgo()))
ARMS = {arm.name: arm for arm in (WITH, WITHOUT, NAIVE_ALONE, ALONE_WITHOUT)}


def game(arm: str, episode: int, failed: int, speed_mps: float, lost: float | None = None) -> dict[str, Any]:
    shares = {} if lost is None else {"ego_lost_share": lost, "ego_ghost_share": lost / 2}
    outcome = "collision" if failed else "goal"
    cells = {"ego_outcome": outcome, "ego_failed": failed, "ego_mean_speed_mps": speed_mps, "error": "", **shares}
    return {"arm": arm, "persona": "speedy", "seed": 1, "episode": episode, **cells}


def episodes() -> pd.DataFrame:
    """The errors add the failures of games 0 to 5, prevent that of game 6, and cost 1 m/s in every second game."""
    rows = []
    for k in range(8):
        rows.append(game(WITHOUT.name, k, int(k == 6), 12.0))
        rows.append(game(WITH.name, k, int(k < 6), 12.0 - k % 2, 0.1 * k))
    return table_of("episodes", rows)


def test_perception__agrees_with_the_arithmetic_on_paper() -> None:
    assert WITHOUT.name == "error_free_naive_vs_speedy"
    (row,) = compare_perception(ARMS, episodes(), seeds=1).to_dict("records")
    assert (row["arm"], row["error_free_arm"], row["pairs"]) == (WITH.name, WITHOUT.name, 8)
    assert (row["failure_rate"], row["error_free_failure_rate"], row["more_failures"]) == (0.75, 0.125, 0.625)
    assert row["mcnemar_p"] == pytest.approx(2 * (1 + 7) / 2**7)  # of seven games that differ, one is better
    assert row["p_holm"] == pytest.approx(2 * row["mcnemar_p"])  # two arms are planned, of which one is played
    assert row["speed_loss_mps"] == 0.5
    half = 2.364624 * math.sqrt(2 / 7) / math.sqrt(8)  # 97.5 % quantile of t with 7 degrees of freedom
    assert row["speed_loss_mps_high"] == pytest.approx(0.5 + half, abs=1e-5)
    assert (row["lost_share"], row["ghost_share"]) == (pytest.approx(0.35), pytest.approx(0.175))


def test_perception__a_game_that_one_arm_could_not_play_is_left_out() -> None:
    table = episodes()
    table.loc[0, ["ego_outcome", "error"]] = "error", "it died"
    (row,) = compare_perception(ARMS, table, seeds=1).to_dict("records")
    assert (row["pairs"], row["pairs_left_out"]) == (7, 1)


def test_perception__of_a_run_without_errors_the_table_is_empty() -> None:
    table = episodes()
    assert compare_perception({WITH.name: WITH}, table[table["arm"] == WITH.name], seeds=1).empty
