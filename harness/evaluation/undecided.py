"""Failures of the ego in which the person that was involved decided nothing: its attention had lapsed.

Such a person did not choose to do what it did. It is the one of `causes.csv`: failures that involve no person count as
failures, and not as undecided.
"""

from __future__ import annotations

import pandas as pd

from harness.evaluation.tables import table_of

LAST_S = 1.0
_KEYS = ["arm", "persona", "seed"]
_GAME = [*_KEYS, "episode"]
_ROUNDING_S = 1e-6  # of times in the tables


def count_undecided(episodes: pd.DataFrame, causes: pd.DataFrame, conduct: pd.DataFrame) -> pd.DataFrame:
    """A row for each arm of an ego against a person and seed, the table `undecided`, from the tables of these names."""
    is_person = (conduct["player"] != "ego") & (conduct["persona"] != "")
    people = conduct.loc[is_person, [*_GAME, "player", "looks_away_share", "undecided_at_end_s"]]
    met = episodes[episodes["ego_failed"].notna()].merge(people[_GAME].drop_duplicates(), on=_GAME)
    failures = causes.merge(people, left_on=[*_GAME, "other"], right_on=[*_GAME, "player"], how="left")
    undecided_s = failures["undecided_at_end_s"] + _ROUNDING_S
    failures = failures.assign(
        failures=1,
        undecided_all_game=failures["looks_away_share"] == 1.0,
        undecided_since_conflict=(undecided_s > 2 * _ROUNDING_S) & (undecided_s >= failures["time_left_s"]),
        undecided_last_second=undecided_s >= LAST_S,
    )
    names = ["failures", "undecided_all_game", "undecided_since_conflict", "undecided_last_second"]
    counted = failures.groupby(_KEYS)[names].sum()
    arms = met[_KEYS].drop_duplicates()
    rows = arms.merge(counted, left_on=_KEYS, right_index=True, how="left").fillna(dict.fromkeys(names, 0))
    return table_of("undecided", rows[[*_KEYS, *names]].to_dict("records"))
