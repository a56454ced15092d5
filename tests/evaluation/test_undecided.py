"""Failures in which a person decided nothing, from made-up tables."""

from __future__ import annotations

import pandas as pd

from harness.evaluation.tables import table_of
from harness.evaluation.undecided import count_undecided
from tests.support.game_tables import arm, table

ARM = "naive_vs_texting"
GAMES = [  # other, time left since the conflict began, share of the drive in lapses, time without a decision at its end
    ("non_ego", 1.5, 1.0, 4.0),  # nothing in the whole game
    ("non_ego", 1.5, 0.5, 2.0),  # nothing since the conflict began
    ("non_ego", 1.5, 0.5, 1.0),  # nothing in the last second
    ("non_ego", 0.4, 0.5, 0.4),  # nothing since the conflict, which began late
    ("non_ego", 0.0, 0.5, 0.0),  # it decided to the end
    ("", 0.0, 1.0, 4.0),  # no one was involved
    ("car_3", 1.5, 1.0, 4.0),  # background traffic was
]


def counted(name: str = ARM, persona: str = "texting") -> list[dict[str, object]]:
    game = {"arm": name, "persona": persona, "seed": 1}
    episodes = table(arm(name, ego_failed=[1] * len(GAMES) + [0], persona=persona))
    causes, conduct = [], []
    for episode, (other, left_s, share, undecided_s) in enumerate(GAMES):
        cells = {"ego_outcome": "collision", "time_s": 4.0 - left_s, "time_left_s": left_s, "other": other}
        causes.append(game | cells | {"episode": episode})
        drive = {"looks_away_share": share, "undecided_at_end_s": undecided_s}
        conduct += [
            game | {"episode": episode, "player": "non_ego"} | drive,
            game | {"episode": episode, "player": "ego"},
        ]
    found = count_undecided(episodes, table_of("causes", causes), table_of("conduct", conduct))
    return found.to_dict("records")


def test_counts__by_hand() -> None:
    (row,) = counted()
    assert row == {
        **{"arm": ARM, "persona": "texting", "seed": 1, "failures": 7},
        **{"undecided_all_game": 1, "undecided_since_conflict": 3, "undecided_last_second": 3},
    }


def test_counts__sumos_driver_is_no_person() -> None:
    assert counted("naive_vs_sumo", "") == []


def test_counts__an_arm_without_failures_has_a_row() -> None:
    game = {"arm": ARM, "persona": "texting", "seed": 1, "episode": 0}
    people = table_of("conduct", [game | {"player": "non_ego"}])
    episodes: pd.DataFrame = table(arm(ARM, ego_failed=[0], persona="texting"))
    (row,) = count_undecided(episodes, table_of("causes"), people).to_dict("records")
    assert [row[name] for name in row if name.startswith(("failures", "undecided"))] == [0, 0, 0, 0]
