"""The tables of shields and of perception errors, by hand."""

from __future__ import annotations

import math
from typing import Any

import pandas as pd
import pytest

from harness.evaluation.comparisons.altered_egos import compare_perception, compare_shielded
from harness.evaluation.strategies import (
    NAIVE_ALONE,
    Arm,
    ErrorFreeEgo,
    NaiveEgo,
    RetrainedEgo,
    ShieldedEgo,
    against_persona,
)
from harness.evaluation.tables import table_of

OWN, RETRAINED = (against_persona(ego, "speedy") for ego in (NaiveEgo(), RetrainedEgo(against="speedy")))
SHIELDED = against_persona(ShieldedEgo(of=NaiveEgo()), "speedy")
ERROR_FREE = against_persona(ErrorFreeEgo(of=NaiveEgo()), "speedy")
WITH_SHIELD = {arm.name: arm for arm in (OWN, SHIELDED, RETRAINED)}
WITH_ERRORS = {arm.name: arm for arm in (OWN, ERROR_FREE, NAIVE_ALONE, Arm(ego=ErrorFreeEgo(of=NaiveEgo())))}


def game(arm: Arm, episode: int, failed: int, speed_mps: float, **shares: float) -> dict[str, Any]:
    outcome = "collision" if failed else "goal"
    cells = {"ego_outcome": outcome, "ego_failed": failed, "ego_mean_speed_mps": speed_mps, "error": "", **shares}
    return {"arm": arm.name, "persona": "speedy", "seed": 1, "episode": episode, **cells}


# --- shields ---------------------------------------------------------------------------------------------------------


def with_shield() -> pd.DataFrame:
    """The shield prevents the failures of games 0 and 1, causes that of game 2, and costs 1, 2, 0 and 1 m/s."""
    without = [game(OWN, k, failed, 12.0) for k, failed in enumerate((1, 1, 0, 0))]
    shielded = zip((0, 0, 1, 0), (11.0, 10.0, 12.0, 11.0), (2.0, 4.0, 6.0, 0.0), strict=True)
    changed = [
        game(SHIELDED, k, *each, ego_shield_interventions_per_km=per_km, ego_shielded_share=per_km / 100)
        for k, (*each, per_km) in enumerate(shielded)
    ]
    return table_of("episodes", [*without, *changed])


def test_shield__agrees_with_the_arithmetic_on_paper() -> None:
    assert SHIELDED.name == "shielded_naive_vs_speedy"
    (row,) = compare_shielded(WITH_SHIELD, with_shield()).to_dict("records")
    assert (row["arm"], row["shielded_arm"], row["pairs"]) == (OWN.name, SHIELDED.name, 4)
    assert (row["failure_rate"], row["shielded_failure_rate"], row["fewer_failures"]) == (0.5, 0.25, 0.25)
    assert row["mcnemar_p"] == 1.0  # of three games that differ, two are better: (3 + 1) / 8, two-sided
    assert row["speed_loss_mps"] == 1.0
    half = 3.182446 * math.sqrt(2 / 3) / 2  # 97.5 % quantile of t with 3 degrees of freedom, variance 2/3
    assert row["speed_loss_mps_high"] == pytest.approx(1.0 + half, abs=1e-5)
    assert (row["shield_interventions_per_km"], row["shielded_share"]) == (3.0, 0.03)


def test_shield__a_game_that_one_arm_could_not_play_is_left_out() -> None:
    table = with_shield()
    table.loc[0, ["ego_outcome", "error"]] = "error", "it died"
    (row,) = compare_shielded(WITH_SHIELD, table).to_dict("records")
    assert (row["pairs"], row["pairs_left_out"], row["failure_rate"]) == (3, 1, pytest.approx(1 / 3))


def test_shield__of_a_run_without_one_the_table_is_empty() -> None:
    table = with_shield()
    assert compare_shielded(WITH_SHIELD, table[table["arm"] == OWN.name]).empty


# --- perception errors -----------------------------------------------------------------------------------------------


def with_errors() -> pd.DataFrame:
    """The errors add the failures of games 0 to 5, prevent that of game 6, and cost 1 m/s in every second game."""
    rows = []
    for k in range(8):
        rows.append(game(ERROR_FREE, k, int(k == 6), 12.0))
        rows.append(game(OWN, k, int(k < 6), 12.0 - k % 2, ego_lost_share=0.1 * k, ego_ghost_share=0.05 * k))
    return table_of("episodes", rows)


def test_perception__agrees_with_the_arithmetic_on_paper() -> None:
    assert ERROR_FREE.name == "error_free_naive_vs_speedy"
    (row,) = compare_perception(WITH_ERRORS, with_errors(), seeds=1).to_dict("records")
    assert (row["arm"], row["error_free_arm"], row["pairs"]) == (OWN.name, ERROR_FREE.name, 8)
    assert (row["failure_rate"], row["error_free_failure_rate"], row["more_failures"]) == (0.75, 0.125, 0.625)
    assert row["mcnemar_p"] == pytest.approx(2 * (1 + 7) / 2**7)  # of seven games that differ, one is better
    assert row["p_holm"] == pytest.approx(2 * row["mcnemar_p"])  # two arms are planned, of which one is played
    assert row["speed_loss_mps"] == 0.5
    half = 2.364624 * math.sqrt(2 / 7) / math.sqrt(8)  # 97.5 % quantile of t with 7 degrees of freedom
    assert row["speed_loss_mps_high"] == pytest.approx(0.5 + half, abs=1e-5)
    assert (row["lost_share"], row["ghost_share"]) == (pytest.approx(0.35), pytest.approx(0.175))


def test_perception__a_game_that_one_arm_could_not_play_is_left_out() -> None:
    table = with_errors()
    table.loc[0, ["ego_outcome", "error"]] = "error", "it died"
    (row,) = compare_perception(WITH_ERRORS, table, seeds=1).to_dict("records")
    assert (row["pairs"], row["pairs_left_out"]) == (7, 1)


def test_perception__of_a_run_without_errors_the_table_is_empty() -> None:
    table = with_errors()
    assert compare_perception({OWN.name: OWN}, table[table["arm"] == OWN.name], seeds=1).empty
