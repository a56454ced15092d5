"""Two runs beside each other: did a change make the ego better?

Arms of the same name and training seed are compared. On the same scene, game k has the same start in both runs, so the
games are compared in pairs; on different scenes there are no pairs, and only the rates are shown.

| measure | test, two-sided |
| --- | --- |
| failures, near misses | McNemar's exact test |
| average speed | paired t-test, and equivalence by the 95 % interval |
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from scipy import stats

from harness.evaluation.comparisons.comparison import (
    Floats,
    games_by_arm,
    holm,
    mean_interval,
    measured_values,
    rate_interval,
)

MEASURES = {"failures": "ego_failed", "near misses": "near_miss", "average speed": "ego_mean_speed_mps"}
"""What is compared, and its column in episodes.csv."""
RATES = ("failures", "near misses")


@dataclass(frozen=True, kw_only=True)
class Side:
    """One run's games of an arm."""

    value: float
    """The rate, or the mean in m/s."""
    low: float
    high: float
    games: int


@dataclass(frozen=True, kw_only=True)
class Difference:
    """One measure of one arm and training seed in both runs."""

    measure: str
    arm: str
    seed: int
    before: Side
    after: Side
    pairs: int
    """0 without pairs: on different scenes."""
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


def differences_of(before: pd.DataFrame, after: pd.DataFrame, same_scene: bool) -> list[Difference]:
    """Every measure of every arm and seed that both runs have, in the order of the first run.

    `before` and `after` are tables of games. Raises ValueError where an arm has two games for one episode.
    """
    then, now = games_by_arm(before), games_by_arm(after)
    found = [
        _difference(measure, arm, seed, then[arm, seed], now[arm, seed], same_scene)
        for arm, seed in then
        if (arm, seed) in now
        for measure, column in MEASURES.items()
        if all(column in rows and rows[column].notna().any() for rows in (then[arm, seed], now[arm, seed]))
    ]
    corrected = holm(np.array([each["p_value"] for each in found], dtype=np.float64))
    return [Difference(**each, p_holm=float(p)) for each, p in zip(found, corrected, strict=True)]


def _difference(
    measure: str, arm: str, seed: int, before: pd.DataFrame, after: pd.DataFrame, paired: bool
) -> dict[str, Any]:
    sides = [measured_values(rows, [MEASURES[measure]]) for rows in (before, after)]
    if not all(side.index.is_unique for side in sides):
        raise ValueError(f"arm {arm!r}, seed {seed}: an episode appears more than once")
    values = [side.iloc[:, 0].dropna().to_numpy(dtype=np.float64) for side in sides]
    described = {"measure": measure, "arm": arm, "seed": seed}
    described |= {name: _side(measure, each) for name, each in zip(("before", "after"), values, strict=True)}
    pairs = pd.concat(sides, axis=1).dropna().to_numpy(dtype=np.float64) if paired else np.zeros((0, 2))
    return described | {"pairs": len(pairs)} | dict(_test(measure, pairs))


def _side(measure: str, values: Floats) -> Side:
    is_rate = measure in RATES
    low, high = rate_interval(int(values.sum()), len(values)) if is_rate else mean_interval(values)
    return Side(value=float(values.mean()) if len(values) else np.nan, low=low, high=high, games=len(values))


def _test(measure: str, pairs: Floats) -> Mapping[str, float]:
    if not len(pairs):
        return dict.fromkeys(("mean", "low", "high", "p_value"), np.nan)
    differences = pairs[:, 1] - pairs[:, 0]
    low, high = mean_interval(differences)
    if measure in RATES:
        more, fewer = int((differences > 0).sum()), int((differences < 0).sum())
        p = float(stats.binomtest(more, more + fewer, 0.5).pvalue) if more + fewer else 1.0
    else:
        p = float(stats.ttest_1samp(differences, 0.0).pvalue) if np.isfinite(low) else np.nan
    return {"mean": float(differences.mean()), "low": low, "high": high, "p_value": p}
