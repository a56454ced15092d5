"""Which failures of the ego a reference driver would have prevented: the tables, their counts, and the sentence.

Two verdicts are kept apart, because they answer different questions and agree in few games:

| verdict | question |
| --- | --- |
| from the conflict on | once the danger is there, could a driver still have prevented it? |
| driven so from the start | does a driver who drives so get into it at all? |

From the conflict on, the reference driver takes over the recorded game when its own rule says danger, and the others
repeat their recorded course. From the start, it plays the same seeded game from its first step, and the others react.

A cell is empty where the verdict does not exist: a contact with a rail and a timeout have no conflict to take over at,
and a game may fail to be played.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from harness.evaluation.comparisons.comparison import rate_interval
from harness.evaluation.tables import table_of

ANY = "any"
"""The row of `preventability.csv` on the games that at least one person among the reference drivers prevents."""
UPPER_BOUND = "upper_bound"
FROM_CONFLICT, FROM_START = "from_conflict", "from_start"


@dataclass(frozen=True, kw_only=True)
class Prevented:
    """How many failures of an arm are prevented, in one of the two verdicts."""

    judged: int
    """Failures on which there is a verdict."""
    by_any: int
    """Prevented by at least one reference driver but the upper bound."""
    by_driver: dict[str, int]
    by_upper_bound: int


@dataclass(frozen=True, kw_only=True)
class Preventability:
    """What the failures of one arm and training seed come to."""

    arm: str
    seed: int
    episodes: int
    """Games that were played."""
    failures: int
    from_conflict: Prevented
    from_start: Prevented
    rate: float
    """Preventable failure rate: failures that a reference driver prevents from the start, per game."""
    rate_low: float
    rate_high: float
    last_chance_s: float | None
    """Median time before the failure at which full braking still prevents it; None if it is not known."""

    @property
    def sentences(self) -> list[str]:
        """The verdicts in words, one sentence each; empty without failures."""
        return list(_sentences(self)) if self.failures else []


def count_prevented(games: pd.DataFrame, episodes: pd.DataFrame) -> pd.DataFrame:
    """The rows of `preventability.csv`: for each arm and training seed, each reference driver and `ANY`.

    `games` is the table `reference_drivers`, `episodes` the table of this name. Shares are of the failures with a
    verdict, rates of all games that were played; both have the 95 % interval of all rates of a run.
    """
    rows: list[dict[str, object]] = []
    for (arm, persona, seed), judged in games.groupby(["arm", "persona", "seed"], sort=False):
        played = _played(episodes, str(arm), int(seed))
        counted = {"arm": arm, "persona": persona, "seed": seed, "episodes": len(played)}
        counted["failures"] = int(played["ego_failed"].sum())
        for name, driver in judged.groupby("driver", sort=False):
            rows.append({**counted, "driver": name, **_verdicts(driver, len(played))})
        persons = judged[judged["driver"] != UPPER_BOUND]
        columns = [f"prevented_{FROM_CONFLICT}", f"prevented_{FROM_START}"]
        rows.append({**counted, "driver": ANY, **_verdicts(persons.groupby("episode")[columns].max(), len(played))})
    return table_of("preventability", rows)


def preventability_of(counts: pd.DataFrame, games: pd.DataFrame, arm: str) -> list[Preventability]:
    """The verdicts on an arm, one for each training seed; empty where none was judged. `counts` and `games` are the
    tables `preventability.csv` and `reference_drivers.csv`."""
    found = []
    for seed, rows in counts[counts["arm"] == arm].groupby("seed", sort=False):
        by_driver = {str(row["driver"]): row for row in rows.to_dict("records")}
        both = by_driver[ANY]
        of_arm = games[(games["arm"] == arm) & (games["seed"] == seed)]
        left_s = (of_arm["failed_s"] - of_arm["preventable_until_s"]).dropna()
        found.append(
            Preventability(
                arm=arm,
                seed=int(seed),
                episodes=int(both["episodes"]),
                failures=int(both["failures"]),
                from_conflict=_prevented(by_driver, FROM_CONFLICT),
                from_start=_prevented(by_driver, FROM_START),
                rate=float(both[f"{FROM_START}_rate"]),
                rate_low=float(both[f"{FROM_START}_rate_low"]),
                rate_high=float(both[f"{FROM_START}_rate_high"]),
                last_chance_s=float(left_s.median()) if len(left_s) else None,
            )
        )
    return found


def _played(episodes: pd.DataFrame, arm: str, seed: int) -> pd.DataFrame:
    games = episodes[(episodes["arm"] == arm) & (episodes["seed"] == seed)]
    return games[(games["error"] == "") & games["ego_failed"].notna()]


def _verdicts(games: pd.DataFrame, episodes: int) -> dict[str, float]:
    """The columns of both verdicts, from one row per failure."""
    cells: dict[str, float] = {}
    for verdict in (FROM_CONFLICT, FROM_START):
        judged = games[f"prevented_{verdict}"].dropna()
        prevented = int(judged.sum())
        cells |= {f"{verdict}_judged": len(judged), f"{verdict}_prevented": prevented}
        for name, total in (("share", len(judged)), ("rate", episodes)):
            low, high = rate_interval(prevented, total)
            cells[f"{verdict}_{name}"] = prevented / total if total else np.nan
            cells |= {f"{verdict}_{name}_low": low, f"{verdict}_{name}_high": high}
    return cells


def _prevented(by_driver: dict[str, dict[str, object]], verdict: str) -> Prevented:
    counts = {name: int(str(row[f"{verdict}_prevented"])) for name, row in by_driver.items()}
    judged = int(str(by_driver[ANY][f"{verdict}_judged"]))
    by_any, by_upper_bound = counts.pop(ANY), counts.pop(UPPER_BOUND, 0)
    return Prevented(judged=judged, by_any=by_any, by_driver=counts, by_upper_bound=by_upper_bound)


def _sentences(found: Preventability) -> Iterator[str]:
    start, conflict = found.from_start, found.from_conflict
    if start.judged:
        count, who = _of(start.by_any, start.judged), _by_driver(start.by_driver)
        yield f"A reference driver in its place from the start prevents {count} failures ({who})."
        low, high = 100.0 * found.rate_low, 100.0 * found.rate_high
        yield (
            f"Preventable failure rate: {100.0 * found.rate:.1f} % of {found.episodes} games "
            f"(95 %: {low:.1f}–{high:.1f} %)."
        )
    if conflict.judged:
        count, who = _of(conflict.by_any, conflict.judged), _by_driver(conflict.by_driver)
        bound = f"full braking in the first moment of danger {conflict.by_upper_bound}"
        yield f"Taking over when the danger shows, it prevents {count} collisions ({who}; {bound})."
    if found.last_chance_s is not None:
        yield f"Full braking prevents the collision until {found.last_chance_s:.1f} s before it (median)."


def _of(count: int, total: int) -> str:
    return f"{'none' if count == 0 else count} of {total}"


def _by_driver(counts: dict[str, int]) -> str:
    return ", ".join(f"{in_words(name)} {count}" for name, count in counts.items())


_WORDS = {
    "careful_and_competent": "careful and competent",
    "fuzzy": "fuzzy safety model",
    "rss": "RSS",
    UPPER_BOUND: "upper bound",
    ANY: "any of them",
}


def in_words(driver: str) -> str:
    """A reference driver's name in prose."""
    return _WORDS.get(driver, driver.replace("_", " "))


def driver_names(counts: pd.DataFrame) -> Sequence[str]:
    """The reference drivers of a table, in its order, without `ANY`."""
    return [str(name) for name in dict.fromkeys(counts["driver"]) if name != ANY]
