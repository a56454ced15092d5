"""Comparisons over trainings: what holds for trainings like those of a campaign, and not only for one trained pair.

The training is the unit. All trainings play the same starts, so the differences of failures are a matrix [R, K] of R
trainings and K starts, and trainings and starts are both samples of more. A two-level bootstrap resamples trainings
and, crossed with them, starts: each resample has the same starts for all of its trainings. The variance of its means
has a closed form, so that nothing is drawn.

That variance gives the standard error, and Student's t the interval and the test. Percentiles of the bootstrap itself
are too narrow for few trainings, because means of three trainings can't lie outside of them: where trainings differ
much, the percentile interval "of 95 %" has the mean of all trainings in it in 76 % of campaigns of three trainings, and
that of Student's t in 92 % (simulated as in `tests/evaluation/comparisons/test_over_trainings.py`).

Sources. Resampling both margins of a crossed table: A. B. Owen, "The pigeonhole bootstrap", Ann. Appl. Stat. 1 (2007),
which shows that its variance is not too small on average. The factor n / (n - 1) of a resampled variance: B. Efron and
R. J. Tibshirani, "An Introduction to the Bootstrap" (1993), section 5.3. Degrees of freedom of a sum of variances:
F. E. Satterthwaite, Biometrics Bulletin 2 (1946).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
import scipy

from harness.evaluation.comparisons.comparison import (
    CONFIDENCE,
    METRICS,
    games_by_arm,
    holm,
    pairs_by_episode,
    with_verdicts,
)
from harness.evaluation.competence import Question, Verdict, gate_of
from harness.evaluation.planned_tests import LEAST_TRAININGS, PRIMARY, About, PlannedTest, families
from harness.evaluation.tables import table_of, typed
from harness.game.arrays import FloatArray


@dataclass(frozen=True, kw_only=True)
class CrossedMean:
    """The mean over trainings and starts, with its uncertainty over both."""

    mean: float
    standard_error: float
    degrees: float
    """Of freedom, of Student's t: few where the trainings differ, many where the starts do."""

    @property
    def t(self) -> float:
        return self.mean / self.standard_error

    @property
    def p_value(self) -> float:
        """Of H0: the mean is 0, against H1: it is above 0."""
        return float(scipy.stats.t.sf(self.t, self.degrees))

    @property
    def interval(self) -> tuple[float, float]:
        """The two-sided 95 % interval of the mean, a difference of two rates: within -1 and 1."""
        half_width = float(scipy.stats.t.ppf((1 + CONFIDENCE) / 2, self.degrees)) * self.standard_error
        return max(self.mean - half_width, -1.0), min(self.mean + half_width, 1.0)


def crossed_mean(differences: FloatArray) -> CrossedMean | None:
    """The mean of differences [R, K] of R trainings in the same K starts, with the variance of a two-level bootstrap;
    None where all are equal: nothing tells then how far another training would be from them."""
    trainings, starts = differences.shape
    if np.ptp(differences) == 0:
        return None
    of_trainings = differences.mean(axis=1).var(ddof=1) / trainings  # where the trainings are drawn alone
    variance = _variance_of_both(differences) + of_trainings / trainings
    of_starts = max(variance - of_trainings, 0.0)
    degrees = variance**2 / (of_trainings**2 / (trainings - 1) + of_starts**2 / max(starts - 1, 1))
    return CrossedMean(mean=float(differences.mean()), standard_error=float(np.sqrt(variance)), degrees=float(degrees))


def _variance_of_both(differences: FloatArray) -> float:
    """The variance of the mean of differences [R, K] where both margins are drawn with replacement. How often training
    r and training s are drawn has the mean product 1 - 1 / R, and 1 more where r is s; likewise for starts."""
    centred = differences - differences.mean()  # their sum is 0, and with it one of the four parts
    trainings, starts = differences.shape
    of_trainings, of_starts = centred.sum(axis=1), centred.sum(axis=0)
    parts = (centred**2).sum(), (1 - 1 / starts) * (of_trainings**2).sum(), (1 - 1 / trainings) * (of_starts**2).sum()
    return float(sum(parts) / differences.size**2)


def compare_over_trainings(questions: Sequence[Question], episodes: pd.DataFrame, significance: float) -> pd.DataFrame:
    """A row for each planned test over trainings, the table `over_trainings`; none with fewer than three training
    seeds.

    `questions` are all that the campaign plans; `episodes` has the columns of episodes.csv. A training is left out, and
    counted, where its question is not answered, or has fewer than two pairs. A start is left out, and counted, where
    one of the other trainings has no pair of it. Raises ValueError when an arm has two games for one episode.
    """
    planned = families(questions).get(About.TRAININGS, [])
    games = games_by_arm(episodes)
    table = table_of("over_trainings", [_row(test, games) | {"planned_tests": len(planned)} for test in planned])
    table["p_holm"] = holm(table["p_value"].to_numpy(dtype=np.float64), len(planned))
    return typed(with_verdicts(table, significance, pairs="starts"))


def _row(test: PlannedTest, games: Mapping[Any, pd.DataFrame]) -> dict[str, Any]:
    measured, reasons = list[pd.Series](), list[str]()
    column, sign = METRICS[PRIMARY]
    for question in test:
        sides = pairs_by_episode(games, question.seed, question.baseline, question.treatment, [column]).dropna()
        closed = gate_of(question, games)
        if closed["reason"] or len(sides) < 2:
            reasons.append(f"training seed {question.seed}: {closed['reason'] or 'fewer than two pairs of games'}")
        else:
            measured.append(sign[test[0].question] * (sides.iloc[:, 1] - sides.iloc[:, 0]))
    row: dict[str, Any] = {"question": test[0].question, "persona": test[0].persona, "about": About.TRAININGS.value}
    row |= {"trainings": len(measured), "trainings_left_out": len(reasons)}
    if len(measured) < LEAST_TRAININGS:
        return row | {"verdict": Verdict.NOT_ENOUGH_TRAININGS.value, "reason": "; ".join(reasons)}
    table = pd.concat(measured, axis=1)
    differences = table.dropna().to_numpy(dtype=np.float64).T  # [R, K]
    starts = differences.shape[1]
    row |= {"starts": starts, "starts_left_out": len(table) - starts}
    if starts < 2:
        return row
    of_each = differences.mean(axis=1)
    row |= {"mean_difference": differences.mean(), "least": of_each.min(), "most": of_each.max()}
    found = crossed_mean(differences)
    if found is None:
        return row
    low, high = found.interval
    row |= {"ci_low": low, "ci_high": high, "t": found.t, "degrees": found.degrees, "p_value": found.p_value}
    return row | {"standard_error": found.standard_error}
