"""The summary of games: a row for each arm, with rates, means and their intervals."""

from __future__ import annotations

import numpy as np
import pandas as pd

from harness.evaluation.columns import MEANS
from harness.evaluation.comparisons.comparison import mean_interval, rate_cells
from harness.evaluation.people import of_people
from harness.evaluation.severity.closeness import CRITERIA
from harness.evaluation.tables import table_of, typed
from harness.evaluation.unplayed_games import were_played


def summarise(episodes: pd.DataFrame) -> pd.DataFrame:
    """A row for each arm (in order of first appearance) and training seed, the table `summary`.

    `episodes` counts all games of the arm and `errors` those that could not be played. Every other column is
    over the games that were played and in which the quantity was measured; it is empty without such games.
    Rates have 95 % Clopper-Pearson intervals, the mean speed a 95 % t interval (empty without spread); the
    other columns are means over games (min_ttc_s: the mean of each game's minimum). With several people, the columns of
    the non-ego are over the people of all games; their goals in one game depend on each other, so that their rate has
    no interval, but in an arm in which they drive one at a time.
    """
    episodes = typed(episodes)
    rows = [
        _summary_row(str(arm), persona, seed, games)
        for arm in episodes["arm"].unique()
        for (persona, seed), games in episodes[episodes["arm"] == arm].groupby(["persona", "seed"], sort=False)
    ]
    return table_of("summary", rows)


def _summary_row(arm: str, persona: str, seed: int, games: pd.DataFrame) -> dict[str, object]:
    played = games[were_played(games)]
    with_ego = played[played["ego_failed"].notna()]
    outcomes = of_people(played, "outcome")
    took_part = (outcomes != "").to_numpy()
    people = outcomes.to_numpy()[took_part]
    near_misses = played["near_miss"].dropna()
    speed_low, speed_high = mean_interval(played["ego_mean_speed_mps"].dropna().to_numpy())
    goal_rate = rate_cells("non_ego_goal_rate", (people == "goal").sum(), len(people))
    if len(people) > took_part.any(axis=1).sum():  # several people in a game
        goal_rate |= {"non_ego_goal_rate_low": np.nan, "non_ego_goal_rate_high": np.nan}
    ends = {"collision": "collisions", "rail": "rails", "timeout": "timeouts"}
    return {
        "arm": arm,
        "persona": persona,
        "seed": seed,
        "episodes": len(games),
        "errors": len(games) - len(played),
        **rate_cells("failure_rate", with_ego["ego_failed"].sum(), len(with_ego)),
        **{name: (with_ego["ego_outcome"] == end).sum() if len(with_ego) else None for end, name in ends.items()},
        "mean_speed_low_mps": speed_low,
        "mean_speed_high_mps": speed_high,
        **{
            metric.mean: played[f"ego_{name}"].mean()
            for name, metric in MEANS.items()
            if "ego" in metric.whose and f"ego_{name}" in played
        },
        **goal_rate,
        **{
            f"non_ego_{name}": pd.Series(of_people(played, name).to_numpy(dtype=np.float64).ravel()).mean()
            for name in MEANS
            if "person" in MEANS[name].whose
        },
        **rate_cells("near_miss_rate", near_misses.sum(), len(near_misses)),
        **{f"near_misses_by_{each.name}": played[f"near_miss_{each.name}"].sum(min_count=1) for each in CRITERIA},
        **_harm(played),
        **_severity(played),
    }


def _severity(played: pd.DataFrame) -> dict[str, object]:
    delta_v_mps = played[["ego_delta_v_mps", "other_delta_v_mps"]].max(axis=1)
    return {
        "closing_speed_mps": played["closing_speed_mps"].mean(),
        "delta_v_mps": delta_v_mps.mean(),
        "max_delta_v_mps": delta_v_mps.max(),
        **{name: played[name].mean() for name in ("mais3_risk_low", "mais3_risk_high")},
    }


def _harm(played: pd.DataFrame) -> dict[str, object]:
    marks = played["harm_to_others"].dropna()
    return {
        "person_failures": played["person_failed"].sum(min_count=1),
        "bystander_failures": played["bystander_failed"].sum(min_count=1),
        **rate_cells("harm_to_others_rate", marks.sum(), len(marks)),
        "follower_max_deceleration_mps2": played["follower_max_deceleration_mps2"].mean(),
    }
