"""Two runs beside each other: did a change make the ego better?

Arms of the same name and training seed are compared. On the same scene and with the same first training seed, game k
has the same start in both runs, so the games are compared in pairs; otherwise only the rates are shown.

| measure | test, two-sided |
| --- | --- |
| failures, near misses, failures of others without the ego | McNemar's exact test |
| average speed | paired t-test, and equivalence by the 95 % interval |
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import pandas as pd
import scipy

from harness.evaluation.comparisons.arm_clauses import ANY_CRITERION
from harness.evaluation.comparisons.comparison import (
    games_by_arm,
    holm,
    mcnemar,
    mean_cells,
    mean_interval,
    measured_values,
    rate_cells,
)
from harness.game.arrays import FloatArray

_RATES = {
    "failures": "ego_failed",
    f"near misses by {ANY_CRITERION}": "near_miss",
    "failures of people without the ego": "person_failed",
    "failures of bystanders without the ego": "bystander_failed",
}
MEASURES = {**_RATES, "average speed": "ego_mean_speed_mps"}
"""What is compared, and its column in episodes.csv."""
RATES = (*_RATES,)


@dataclass(frozen=True, kw_only=True)
class Side:
    value: float
    """The rate, or the mean in m/s."""
    low: float
    high: float
    games: int

    @property
    def failures(self) -> int:
        """Of a rate: the games that it counts."""
        return round(self.value * self.games)


@dataclass(frozen=True, kw_only=True)
class Difference:
    """One measure of one arm and training seed in both runs."""

    measure: str
    arm: str
    seed: int
    before: Side
    after: Side
    pairs: int
    """0 without pairs: the starts differ."""
    mean: float
    """Of after - before, over the pairs; NaN without pairs."""
    low: float
    high: float
    """Its 95 % t interval."""
    p_value: float
    p_holm: float
    """Corrected for all differences of the comparison."""

    @property
    def is_rate(self) -> bool:
        """Whether it is a share of games; else it is a speed in m/s."""
        return self.measure in RATES


def differences_of(before: pd.DataFrame, after: pd.DataFrame, same_starts: bool) -> list[Difference]:
    """Every measure of every arm and seed that both runs have, in the order of the first run.

    `before` and `after` are tables of games. Raises ValueError where an arm has two games for one episode.
    """
    then, now = games_by_arm(before), games_by_arm(after)
    found = [
        _difference(measure, column, (then[place], now[place]), same_starts)
        for place in then
        if place in now
        for measure, column in MEASURES.items()
        if all(column in rows and rows[column].notna().any() for rows in (then[place], now[place]))
    ]
    corrected = holm(np.array([each.p_value for each in found]))
    return [replace(each, p_holm=float(p)) for each, p in zip(found, corrected, strict=True)]


def _difference(measure: str, column: str, runs: tuple[pd.DataFrame, pd.DataFrame], paired: bool) -> Difference:
    """A measure in two runs' games of one arm and seed; its `p_holm` is not corrected yet."""
    sides = [measured_values(rows, [column])[column] for rows in runs]
    before, after = (_side(measure, side.dropna().to_numpy()) for side in sides)
    pairs = pd.concat(sides, axis=1).dropna().to_numpy() if paired else np.zeros((0, 2))
    differences = pairs[:, 1] - pairs[:, 0]
    low, high = mean_interval(differences)
    p_value = np.nan
    if measure in RATES and len(pairs):
        p_value = mcnemar(differences, "two-sided")
    elif np.isfinite(low):
        p_value = float(scipy.stats.ttest_1samp(differences, 0.0).pvalue)
    return Difference(
        measure=measure,
        arm=str(runs[0]["arm"].iloc[0]),
        seed=int(runs[0]["seed"].iloc[0]),
        before=before,
        after=after,
        pairs=len(pairs),
        mean=float(differences.mean()) if len(pairs) else np.nan,
        low=low,
        high=high,
        p_value=p_value,
        p_holm=p_value,
    )


def _side(measure: str, values: FloatArray) -> Side:
    cells = rate_cells("value", values.sum(), len(values)) if measure in RATES else mean_cells("value", values)
    return Side(value=cells["value"], low=cells["value_low"], high=cells["value_high"], games=len(values))


_GAME = ["arm", "seed", "episode"]
GameChange = Literal["fixed", "new", "came back"]
"""A game is fixed if the ego fails in the run before and not in this one. A failure that is not in the run before came
back if it is in an earlier run, and is new otherwise."""


@dataclass(frozen=True, kw_only=True)
class ChangedGame:
    """A game that ends in a failure in one of two runs and not in the other."""

    change: GameChange
    arm: str
    seed: int
    episode: int


def failure_rates(episodes: pd.DataFrame) -> dict[tuple[str, int], Side]:
    """How often the ego of a run fails, by arm and training seed, of the games that could be played."""
    played = episodes[episodes["ego_failed"].notna()]
    groups = played.groupby(["arm", "seed"], sort=False)["ego_failed"]
    return {(str(arm), int(seed)): _side("failures", failed.to_numpy(float)) for (arm, seed), failed in groups}


def changed_games(runs: Sequence[pd.DataFrame], starts: Sequence[Hashable]) -> list[list[ChangedGame]]:
    """For each run but the first, the games that change from the run before it, by arm, seed and episode.

    `runs` are tables of games in order, and `starts` says for each which starts its games have: game k of two runs is
    the same only if these are equal. Raises ValueError where an arm has two games for one episode.
    """
    failed = [run[run["ego_failed"].notna()].set_index(_GAME, verify_integrity=True)["ego_failed"] == 1 for run in runs]
    changes: list[list[ChangedGame]] = []
    for place in range(1, len(runs)):
        if starts[place] != starts[place - 1]:
            changes.append([])
            continue
        both = pd.concat([failed[place - 1], failed[place]], axis=1, keys=["before", "after"], join="inner")
        both = both[both["before"] != both["after"]].sort_index()
        earlier = [each for each, of in zip(failed[:place], starts[:place], strict=True) if of == starts[place]]
        before: set[Hashable] = set().union(*(each[each].index for each in earlier))
        changes.append(
            [
                ChangedGame(
                    change="fixed" if row.before else "came back" if game in before else "new",
                    arm=game[0],
                    seed=int(game[1]),
                    episode=int(game[2]),
                )
                for game, row in zip(both.index, both.itertuples(), strict=True)
            ]
        )
    return changes
