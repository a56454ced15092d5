"""The table of shields, by hand."""

from __future__ import annotations

import math
from typing import Any

import pandas as pd
import pytest

from harness.evaluation.comparisons.shield_comparison import compare_shielded
from harness.evaluation.strategies import NaiveEgo, RetrainedEgo, ShieldedEgo, against_persona
from harness.evaluation.tables import table_of

WITHOUT, RETRAINED = (against_persona(ego, "speedy") for ego in (NaiveEgo(), RetrainedEgo(against="speedy")))
WITH = against_persona(ShieldedEgo(of=NaiveEgo()), "speedy")
ARMS = {arm.name: arm for arm in (WITHOUT, WITH, RETRAINED)}


def game(arm: str, episode: int, failed: int, speed_mps: float, per_km: float | None = None) -> dict[str, Any]:
    shielded = {} if per_km is None else {"ego_shield_interventions_per_km": per_km, "ego_shielded_share": per_km / 100}
    outcome = "collision" if failed else "goal"
    cells = {"ego_outcome": outcome, "ego_failed": failed, "ego_mean_speed_mps": speed_mps, "error": "", **shielded}
    return {"arm": arm, "persona": "speedy", "seed": 1, "episode": episode, **cells}


def episodes() -> pd.DataFrame:
    """The shield prevents the failures of games 0 and 1, causes that of game 2, and costs 1, 2, 0 and 1 m/s."""
    without = [game(WITHOUT.name, k, failed, 12.0) for k, failed in enumerate((1, 1, 0, 0))]
    shielded = zip((0, 0, 1, 0), (11.0, 10.0, 12.0, 11.0), (2.0, 4.0, 6.0, 0.0), strict=True)
    return table_of("episodes", [*without, *(game(WITH.name, k, *each) for k, each in enumerate(shielded))])


def test_shield__agrees_with_the_arithmetic_on_paper() -> None:
    assert WITH.name == "shielded_naive_vs_speedy"
    (row,) = compare_shielded(ARMS, episodes()).to_dict("records")
    assert (row["arm"], row["shielded_arm"], row["pairs"]) == (WITHOUT.name, WITH.name, 4)
    assert (row["failure_rate"], row["shielded_failure_rate"], row["fewer_failures"]) == (0.5, 0.25, 0.25)
    assert row["mcnemar_p"] == 1.0  # of three games that differ, two are better: (3 + 1) / 8, two-sided
    assert row["speed_loss_mps"] == 1.0
    half = 3.182446 * math.sqrt(2 / 3) / 2  # 97.5 % quantile of t with 3 degrees of freedom, variance 2/3
    assert row["speed_loss_mps_high"] == pytest.approx(1.0 + half, abs=1e-5)
    assert (row["shield_interventions_per_km"], row["shielded_share"]) == (3.0, 0.03)


def test_shield__a_game_that_one_arm_could_not_play_is_left_out() -> None:
    table = episodes()
    table.loc[0, ["ego_outcome", "error"]] = "error", "it died"
    (row,) = compare_shielded(ARMS, table).to_dict("records")
    assert (row["pairs"], row["pairs_left_out"], row["failure_rate"]) == (3, 1, pytest.approx(1 / 3))


def test_shield__of_a_run_without_one_the_table_is_empty() -> None:
    table = episodes()
    assert compare_shielded(ARMS, table[table["arm"] == WITHOUT.name]).empty
