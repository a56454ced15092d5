"""Which failures of the ego a reference driver would have prevented: the tables, their counts, and the sentences.

Two verdicts are kept apart (docs/preventability.md). From the conflict on, the reference driver takes over the recorded
game when its own rule says danger, and the others repeat their recorded course; once they keep their place in the lane
after the recorded collision, once they move on into the ego's line. From the start, it plays the same
seeded game from its first step, and the others react. Each driver is counted by itself: what at least one of several
drivers prevents is no measure of any of them. Sentences name the driver of the regulation first.

A cell is empty where the verdict does not exist: a contact with a rail and a timeout have no conflict to take over at,
and a game may fail to be played.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import pandas as pd

from harness.evaluation.comparisons.comparison import rate_cells
from harness.evaluation.tables import table_of

REGULATION = "careful_and_competent"
"""The reference driver of UN R157, by which failures are called preventable."""
UPPER_BOUND = "upper_bound"
_VERDICTS = {
    "from_conflict": "prevented_from_conflict",
    "moving_over": "prevented_moving_over",
    "from_start": "prevented_from_start",
}
"""The verdicts in preventability.csv, each with its column of reference_drivers.csv."""
_WORDS = {REGULATION: "careful and competent driver", "fuzzy": "fuzzy safety model", "rss": "RSS"}
"""Reference drivers in prose."""
TAKES_OVER = _WORDS | {"rss": "RSS driver", UPPER_BOUND: "driver that brakes fully"}
"""Reference drivers that take over a game, after "the"."""


def count_prevented(games: pd.DataFrame, episodes: pd.DataFrame) -> pd.DataFrame:
    """The rows of `preventability.csv`: for each arm and training seed, each reference driver.

    `games` is the table `reference_drivers`, `episodes` the table of this name. Shares are of the failures with a
    verdict, rates of all games that were played; both have the 95 % interval of all rates of a run.
    """
    rows: list[dict[str, object]] = []
    for (arm, persona, seed), judged in games.groupby(["arm", "persona", "seed"], sort=False):
        played = episodes[(episodes["arm"] == arm) & (episodes["seed"] == seed) & (episodes["error"] == "")]
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


def sentences_of(counts: pd.DataFrame, games: pd.DataFrame, arm: str) -> dict[int, list[str]]:
    """By training seed, the verdicts on an arm in words; without those that have no failures. `counts` and `games` are
    the tables `preventability.csv` and `reference_drivers.csv`."""
    found = {}
    for seed, rows in counts[counts["arm"] == arm].groupby("seed", sort=False):
        drivers = rows.set_index("driver")
        of_arm = games[(games["arm"] == arm) & (games["seed"] == seed)]
        last_chances_s = (of_arm["failed_s"] - of_arm["preventable_until_s"]).dropna()
        if drivers.loc[REGULATION, "failures"]:
            found[int(seed)] = list(_sentences(drivers, last_chances_s))
    return found


def _sentences(drivers: pd.DataFrame, last_chances_s: pd.Series) -> Iterator[str]:
    first, others = drivers.loc[REGULATION], drivers.drop(index=[REGULATION, UPPER_BOUND], errors="ignore")
    name = f"the {_WORDS[REGULATION]} of UN R157"
    if first["from_conflict_judged"]:
        bound = drivers["from_conflict_prevented"].get(UPPER_BOUND, 0)
        yield (
            f"Taking over when the danger shows, {name} prevents {_of(first, 'from_conflict')} collisions, and "
            f"{first['moving_over_prevented'] or 'none'} if the other moves on into its line "
            f"({_by_driver(others['from_conflict_prevented'])}; full braking in the first moment of danger {bound})."
        )
    if first["from_start_judged"]:
        rate, low, high = (100.0 * first[f"from_start_rate{end}"] for end in ("", "_low", "_high"))
        yield (
            f"In its place from the start, {name} prevents {_of(first, 'from_start')} failures "
            f"({_by_driver(others['from_start_prevented'])}): {rate:.1f} % of {first['episodes']} games "
            f"(95 %: {low:.1f}–{high:.1f} %)."
        )
    if len(last_chances_s):
        yield f"Full braking prevents the collision until {last_chances_s.median():.1f} s before it (median)."


def _of(row: pd.Series, verdict: str) -> str:
    return f"{row[f'{verdict}_prevented'] or 'none'} of {row[f'{verdict}_judged']}"


def _by_driver(prevented: pd.Series) -> str:
    return ", ".join(f"{_WORDS.get(str(name), name)} {count}" for name, count in prevented.items())
