"""The order of games from the worst on, and the choice of those that are worth watching."""

from __future__ import annotations

import numpy as np
import pandas as pd

from harness.evaluation.worst_first import MOST_FAILURES_PER_ARM, choose_games, worst_first


def episodes() -> pd.DataFrame:
    columns = ["arm", "seed", "episode", "ego_outcome", "ego_failed", "ego_min_ttc_s", "non_ego_outcome"]
    rows = [
        ("naive_vs_x", 1, 0, "goal", 0.0, 2.0, "goal"),
        ("naive_vs_x", 1, 1, "goal", 0.0, np.nan, "goal"),
        ("naive_vs_x", 1, 2, "goal", 0.0, 0.4, "rail"),
        ("naive_vs_x", 1, 3, "timeout", 1.0, 0.1, "goal"),
        ("naive_vs_x", 1, 4, "collision", 1.0, 0.9, "collision"),
        ("naive_vs_x", 1, 5, "error", np.nan, np.nan, np.nan),
        ("naive_vs_x", 1, 6, "rail", 1.0, 3.0, "goal"),
        ("naive_vs_x", 2, 0, "collision", 1.0, 0.2, "collision"),
        ("naive_vs_x", 2, 1, "goal", 0.0, 1.0, "collision"),
        ("x_alone", 1, 0, np.nan, np.nan, np.nan, "rail"),
        ("x_alone", 1, 1, "", np.nan, np.nan, "goal"),
        ("x_alone", 1, 2, "", np.nan, np.nan, "error"),
        ("naive_alone", 1, 0, "goal", 0.0, np.nan, ""),
    ]
    table = pd.DataFrame(rows, columns=columns)
    judged = table["ego_outcome"].where(table["ego_outcome"] != "").fillna(table["non_ego_outcome"])
    table["severity"] = judged.map({"collision": 300.0, "rail": 200.0, "timeout": 100.0})
    table.loc[4, "severity"] = 305.0
    return table


def key(frame: pd.DataFrame) -> list[tuple[str, int, int]]:
    return list(frame[["arm", "seed", "episode"]].itertuples(index=False, name=None))


def test_choose_games__every_failure_and_the_first_two_others() -> None:
    assert key(choose_games(episodes())) == [
        *[("naive_vs_x", 1, k) for k in (0, 1, 3, 4, 6)],
        *[("naive_vs_x", 2, k) for k in (0, 1)],
        ("x_alone", 1, 0),
        ("x_alone", 1, 1),
        ("naive_alone", 1, 0),
    ]


def test_choose_games__of_very_many_failures_the_worst_of_each_arm_and_seed() -> None:
    row = {"arm": "naive_vs_x", "ego_outcome": "rail", "ego_failed": 1.0, "non_ego_outcome": "goal", "severity": 200.0}
    rails = [{**row, "seed": seed, "episode": k, "ego_min_ttc_s": k / 100} for seed in (1, 2) for k in range(150)]
    crashes = [{**row, "seed": 1, "episode": 150 + k, "ego_outcome": "collision", "severity": 300.0} for k in range(30)]
    chosen = choose_games(pd.DataFrame([*rails, *crashes]))
    first = [("naive_vs_x", 1, k) for k in (*range(MOST_FAILURES_PER_ARM - 30), *range(150, 180))]
    assert sorted(key(chosen)) == [*first, *[("naive_vs_x", 2, k) for k in range(MOST_FAILURES_PER_ARM)]]


def test_worst_first__by_severity_then_time_to_collision_then_name() -> None:
    expected = [
        ("naive_vs_x", 1, 4),  # collisions, the harder one first
        ("naive_vs_x", 2, 0),
        ("naive_vs_x", 1, 6),  # rails
        ("x_alone", 1, 0),
        ("naive_vs_x", 1, 3),  # timeouts
        ("naive_vs_x", 1, 2),  # the rest, by time to collision
        ("naive_vs_x", 2, 1),
        ("naive_vs_x", 1, 0),
        ("naive_alone", 1, 0),  # not measured, by name
        ("naive_vs_x", 1, 1),
        ("x_alone", 1, 1),
        ("naive_vs_x", 1, 5),  # can't be shown
        ("x_alone", 1, 2),
    ]
    assert key(worst_first(episodes())) == expected
    assert key(worst_first(episodes().sample(frac=1.0, random_state=5))) == expected
    assert list(worst_first(episodes()).columns) == list(episodes().columns)
