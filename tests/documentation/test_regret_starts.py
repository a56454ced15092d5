"""The script behind the table on starts by regret in docs/robust.md, of runs that are small enough to count."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import pandas as pd

from tests.support.scripts import script

starts = script("robust/regret_starts.py")


def write_run(folder: Path, failed: dict[int, int], spared: dict[int, int]) -> Path:
    """Twenty games of each seed, of which the retrained ego fails the first ones, and the naive ego eight."""
    folder.mkdir()
    games = [
        {"arm": arm, "seed": seed, "episode": episode, "ego_outcome": "goal", "ego_failed": float(episode < count)}
        for arm, counts in (("naive_vs_impatient", dict.fromkeys(failed, 8)), (starts.ARM, failed))
        for (seed, count), episode in product(counts.items(), range(20))
    ]
    pd.DataFrame(games).to_csv(folder / "episodes.csv.gz", index=False)
    judged = [
        {"arm": starts.ARM, "driver": driver, "seed": seed, "from_conflict_prevented": count}
        for driver, (seed, count) in product(("careful_and_competent", "rss"), spared.items())
    ]
    pd.DataFrame(judged).to_csv(folder / "preventability.csv", index=False)
    return folder


def test_rows__of_each_seed_and_of_all_with_the_p_value_of_paired_games(tmp_path: Path) -> None:
    """Of seed 1 five games differ in one direction, p = 2 / 2**5; of seed 2, in which an ego never fails, none."""
    uniform = write_run(tmp_path / "uniform", {1: 6, 2: 0}, {1: 3})
    regret = write_run(tmp_path / "regret", {1: 1, 2: 0}, {1: 1})
    assert starts.rows(uniform, regret) == [
        ["1", "20", "8", "6", "3", "1", "1", "0.062"],
        ["2", "20", "8", "0", "0", "0", "0", "1"],
        ["all", "40", "16", "6", "3", "1", "1", "0.062"],
    ]
