"""Which failures of the ego a reference driver would have prevented: the tables and their counts.

Two verdicts are kept apart (docs/preventability.md). From the conflict on, the reference driver takes over the recorded
game when its own rule says danger, and the others repeat their recorded course; once they keep their place in the lane
after the recorded collision, once they move on into the ego's line. From the start, it plays the same
seeded game from its first step, and the others react. Each driver is counted by itself: what at least one of several
drivers prevents is no measure of any of them.

A cell is empty where the verdict does not exist: a contact with a rail and a timeout have no conflict to take over at,
and a game may fail to be played.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd

from harness.evaluation.comparisons.comparison import rate_cells
from harness.evaluation.tables import table_of
from harness.evaluation.unplayed_games import were_played

REGULATION = "careful_and_competent"
"""The reference driver of UN R157, by which failures are called preventable."""
UPPER_BOUND = "upper_bound"
_VERDICTS = {
    "from_conflict": "prevented_from_conflict",
    "moving_over": "prevented_moving_over",
    "from_start": "prevented_from_start",
}
"""The verdicts in preventability.csv, each with its column of reference_drivers.csv."""
TAKES_OVER = {
    REGULATION: "careful and competent driver",
    "fuzzy": "fuzzy safety model",
    "rss": "RSS driver",
    UPPER_BOUND: "driver that brakes fully",
}
"""Reference drivers that take over a game, after "the"."""


def count_prevented(games: pd.DataFrame, episodes: pd.DataFrame) -> pd.DataFrame:
    """The rows of `preventability.csv`: for each arm and training seed, each reference driver.

    `games` is the table `reference_drivers`, `episodes` the table of this name. Shares are of the failures with a
    verdict, rates of all games that were played; both have the 95 % interval of all rates of a run.
    """
    rows: list[dict[str, object]] = []
    for (arm, persona, seed), judged in games.groupby(["arm", "persona", "seed"], sort=False):
        played = episodes[(episodes["arm"] == arm) & (episodes["seed"] == seed) & were_played(episodes)]
        played = played[played["ego_failed"].notna()]
        counted = {"arm": arm, "persona": persona, "seed": seed, "episodes": len(played)}
        counted["failures"] = int(played["ego_failed"].sum())
        for name, driver in judged.groupby("driver", sort=False):
            rows.append({**counted, "driver": name, **_verdicts(driver, len(played))})
    return table_of("preventability", rows)


def _verdicts(games: pd.DataFrame, episodes: int) -> dict[str, float]:
    """The columns of all verdicts, from one row per failure."""
    cells: dict[str, float] = {}
    for verdict, column in _VERDICTS.items():
        judged = games[column].dropna()
        prevented = int(judged.sum())
        cells |= {f"{verdict}_judged": len(judged), f"{verdict}_prevented": prevented}
        cells |= rate_cells(f"{verdict}_share", prevented, len(judged))
        cells |= rate_cells(f"{verdict}_rate", prevented, episodes)
    return cells


def by_regulation(counts: pd.DataFrame, arm: str) -> list[Mapping[Any, Any]]:
    """The rows of preventability.csv on the driver of the regulation in an arm, one for each training seed."""
    return counts[(counts["arm"] == arm) & (counts["driver"] == REGULATION)].to_dict("records")


def prevented_examples(takeovers: pd.DataFrame) -> dict[tuple[str, int], tuple[int, str]]:
    """An episode of each arm and training seed in which a reference driver prevents the collision from the conflict on,
    and that driver: the one of the regulation if it prevents one. `takeovers` is the table of this name."""
    first = takeovers.assign(other=takeovers["driver"] != REGULATION).sort_values(["other", "episode"], kind="stable")
    rows = first.drop_duplicates(["arm", "seed"]).sort_index()
    return {(str(row.arm), int(row.seed)): (int(row.episode), str(row.driver)) for row in rows.itertuples()}
