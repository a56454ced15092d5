"""Paired comparisons of arms: is the persona's effect significant, and does retraining reduce it?

Pure functions from a table of games to a table of comparisons. Method: SafeDriveRL section 4.2, the paired-samples
one-tailed t-test of H0 (mu_diff = 0) against H1 (mu_diff > 0). The paper writes H1 as mu_diff > 0 for both
questions and does not state the order of the subtraction. The direction here is that of its sections 4.3.1
and 4.3.2: in every row a positive `mean_difference` supports H1:

    question  arms (baseline -> treatment)                     metric      difference (H1: its mean > 0)
    RQ1       naive_alone -> naive_vs_<persona>                failure     treatment - baseline (fails more)
    RQ1                                                        mean_speed  baseline - treatment (slower)
    RQ2       naive_vs_<persona> -> retrained_vs_<persona>     failure     baseline - treatment (fails less)
    RQ2                                                        mean_speed  treatment - baseline (faster)

For RQ2 there are rows on harm to others, too (`HARM`): treatment - baseline of the games in which a person, or a
bystander, fails without the ego, and of the follower's strongest braking. Their H1 is the harm.

The same row also contains: the two-sided 95 % t interval of the mean difference; the effect
size (Cohen's d_z, mean / standard deviation of the differences); for failures McNemar's exact test,
one-tailed in the direction of H1 like the t-test (of the pairs in which exactly one game failed, is H1 right
in more than half? Binomial with p = 1/2; 1 when there are no such pairs). Where all pairs differ alike, as in
100 failures instead of none, there is no t statistic, and the p-value of a share is that of McNemar's test.

Every row is about one trained pair. The t-tests of failures are the primary tests, and Holm's correction is over all
that the campaign plans (`evaluation.planned_tests`), whatever comes of them: a question that is not answered, not
played or shows no difference counts as a test with p = 1. Tests of the average speed are secondary and not corrected.
Those of harm to others are secondary, and a family of their own.

A question whose players were not shown to drive the scene alone, or whose person does not drive as people do
(`competence.gate_of`), is not answered: its rows have pairs and a mean difference, which describe the games, and no
test.

`rejects_h0` is the paper's criterion, the uncorrected p-value. The verdict is stricter: see `Verdict`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Literal

import numpy as np
import pandas as pd
import scipy  # loads `scipy.stats` at its first use: workers do without

from harness.evaluation.columns import TABLES
from harness.evaluation.competence import Question, ResearchQuestion, Verdict, gate_of
from harness.evaluation.planned_tests import PRIMARY, About
from harness.evaluation.tables import typed
from harness.evaluation.unplayed_games import were_played
from harness.game.arrays import FloatArray

CONFIDENCE = 0.95
"""The confidence of every interval in the tables; it does not depend on the campaign's significance."""
ROUNDING = 1e-12
"""Differences with a spread below this share of the largest value count as equal: otherwise the rounding of
0.3 - 0.2 against 0.2 - 0.1 would give a tiny standard deviation and a huge t."""
METRICS: Mapping[str, tuple[str, Mapping[ResearchQuestion, int]]] = {
    "failure": ("ego_failed", {"RQ1": +1, "RQ2": -1}),
    "mean_speed": ("ego_mean_speed_mps", {"RQ1": -1, "RQ2": +1}),
    "person_failure": ("person_failed", {"RQ2": +1}),
    "bystander_failure": ("bystander_failed", {"RQ2": +1}),
    "follower_braking": ("follower_max_deceleration_mps2", {"RQ2": +1}),
}
"""The compared quantities: the column of each, and for the questions that compare it the sign of `treatment - baseline`
under H1."""
SHARES = frozenset({"failure", "person_failure", "bystander_failure"})
"""The quantities that are 0 or 1 in a game."""
HARM = frozenset({"person_failure", "bystander_failure", "follower_braking"})
"""Harm to others than the ego."""


def compare(
    questions: Iterable[Question], episodes: pd.DataFrame, significance: float, planned: int | None = None
) -> pd.DataFrame:
    """A row for each question and metric, in that order, the table `comparisons`.

    `planned` is the number of questions that the campaign plans; left out: that of these.

    `episodes` has the columns of episodes.csv: arm, seed, episode, ego_outcome, error, and the metrics'.
    Games are paired by seed and episode. A pair is left out, and counted in `pairs_left_out`, when either
    game errored, has an empty value, or is missing. A value that can't be computed is NaN. Where all differences are
    equal, t, interval and effect size are NaN. The p-value is then that of McNemar's test, if they are of shares and
    not 0; otherwise it is NaN, and `rejects_h0` is false. All of these are NaN for fewer than two pairs, and for a
    question whose players miss a bound of `Question.alone`, or whose person is unlike people.

    Raises ValueError when an arm has two games for one episode.
    """
    questions, games = list(questions), games_by_arm(episodes)
    planned = len(questions) if planned is None else planned
    rows = [
        _row(question, metric, games, gate_of(question, games))
        for question in questions
        for metric, (_, signs) in METRICS.items()
        if question.question in signs
    ]
    table = pd.DataFrame(rows, columns=list(TABLES["comparisons"]))
    is_primary = table["metric"] == PRIMARY
    table["about"] = About.TRAINED_PAIR.value
    table["planned_tests"] = is_primary.map({True: planned, False: None})
    table["rejects_h0"] = table["p_value"].astype("float64") < significance
    is_harm, p_values = table["metric"].isin(HARM).to_numpy(), table["p_value"].to_numpy(dtype=np.float64)
    table["p_holm"] = holm(np.where(is_primary, p_values, np.nan), planned)
    table.loc[is_harm, "p_holm"] = holm(p_values[is_harm])
    return typed(with_verdicts(table, significance))


def with_verdicts(
    table: pd.DataFrame, significance: float, difference: str = "mean_difference", pairs: str = "pairs"
) -> pd.DataFrame:
    """A table with the verdict of each row by its pairs, p-values and difference, in the columns of these names. A row
    that has a verdict keeps it: that of a closed gate."""
    verdicts = [
        row["verdict"] or _verdict(row, row[pairs], row[difference], significance).value
        for row in table.to_dict("records")
    ]
    return table.assign(verdict=verdicts)


def _verdict(row: Mapping[Any, Any], pairs: int, difference: float, significance: float) -> Verdict:
    """NaN as p_value: there is no test; as p_holm: it is secondary."""
    if pairs < 2:
        return Verdict.NOT_ENOUGH_PAIRS
    if np.isnan(row["p_value"]):
        return Verdict.NO_DIFFERENCE if difference == 0 else Verdict.ALL_EQUAL
    if row["p_value"] >= significance:
        return Verdict.NOT_SIGNIFICANT
    if np.isnan(row["p_holm"]):
        return Verdict.SECONDARY
    return Verdict.SIGNIFICANT if row["p_holm"] < significance else Verdict.BEFORE_HOLM_ONLY


def holm(p_values: FloatArray, planned: int | None = None) -> FloatArray:
    """Holm's step-down adjusted p-values [N] in a family of `planned` tests; left out: N.

    NaN means that a test could not be made. It stays NaN and counts as p = 1, as does each planned test that is not
    among the p-values.

    Source: S. Holm, "A simple sequentially rejective multiple test procedure", Scand. J. Statist. 6 (1979).
    The i-th smallest of m p-values is multiplied by m - i + 1, made no smaller than the previous one, and capped at 1.
    """
    adjusted = np.full(p_values.shape, np.nan)
    tests = np.flatnonzero(~np.isnan(p_values))
    family = len(p_values) if planned is None else planned
    assert family >= len(tests), "more tests than planned"
    ascending = tests[np.argsort(p_values[tests], kind="stable")]
    steps = p_values[ascending] * (family - np.arange(len(ascending)))
    adjusted[ascending] = np.minimum(np.maximum.accumulate(steps), 1.0)
    return adjusted


def mean_interval(values: FloatArray) -> tuple[float, float]:
    """Two-sided 95 % t interval of the mean of values [N]; NaN, NaN without a spread."""
    if len(values) < 2 or _all_equal(values, largest=float(np.abs(values).max())):
        return np.nan, np.nan
    mean, error = values.mean(), values.std(ddof=1) / np.sqrt(len(values))
    half_width = scipy.stats.t.ppf((1 + CONFIDENCE) / 2, len(values) - 1) * error
    return float(mean - half_width), float(mean + half_width)


def mean_cells(name: str, values: FloatArray) -> dict[str, float]:
    """The mean of values [N] with the ends of its interval, as the cells of three columns; NaN without values."""
    low, high = mean_interval(values)
    return {name: float(values.mean()) if len(values) else np.nan, f"{name}_low": low, f"{name}_high": high}


def rate_cells(name: str, successes: float, games: int) -> dict[str, float]:
    """A rate with the ends of its two-sided 95 % Clopper-Pearson interval, as the cells of three columns; NaN without
    games."""
    if games == 0:
        return dict.fromkeys((name, f"{name}_low", f"{name}_high"), np.nan)
    interval = scipy.stats.binomtest(int(successes), games).proportion_ci(CONFIDENCE, method="exact")
    return {name: successes / games, f"{name}_low": float(interval.low), f"{name}_high": float(interval.high)}


def _row(
    question: Question, metric: str, games: Mapping[Any, pd.DataFrame], closed: dict[str, str]
) -> dict[str, object]:
    column, sign = METRICS[metric]
    baseline, treatment, left_out = pairs_of(games, question.seed, question.baseline, question.treatment, [column])
    low, high = (baseline, treatment) if sign[question.question] > 0 else (treatment, baseline)
    low, high = low[:, 0], high[:, 0]
    row = vars(question) | closed | {"metric": metric, "pairs": len(low), "pairs_left_out": left_out}
    return row | (paired_share_test if metric in SHARES else paired_t_test)(low, high, closed)


def games_by_arm(episodes: pd.DataFrame) -> Mapping[Any, pd.DataFrame]:
    """The rows of episodes.csv by (arm, seed)."""
    return dict(iter(episodes.groupby(["arm", "seed"], sort=False)))


def pairs_of(
    games: Mapping[Any, pd.DataFrame], seed: int, baseline: str, treatment: str, columns: Sequence[str]
) -> tuple[FloatArray, FloatArray, int]:
    """Baseline values [N, C], treatment values [N, C] of the same N episodes, and the number of pairs left out:
    those with a game that errored, is missing, or lacks one of the columns [C].

    Raises ValueError when an arm has two games for one episode.
    """
    both = pairs_by_episode(games, seed, baseline, treatment, columns).to_numpy(dtype=np.float64)
    measured = np.isfinite(both).all(axis=1)
    return both[measured, : len(columns)], both[measured, len(columns) :], int((~measured).sum())


def pairs_by_episode(
    games: Mapping[Any, pd.DataFrame], seed: int, baseline: str, treatment: str, columns: Sequence[str]
) -> pd.DataFrame:
    """The columns of the baseline, then those of the treatment, by episode; NaN as in `measured_values`, and where an
    arm has no such game. Raises ValueError when an arm has two games for one episode."""
    return pd.concat([measured_values(games.get((arm, seed)), columns) for arm in (baseline, treatment)], axis=1)


def measured_values(rows: pd.DataFrame | None, columns: Sequence[str]) -> pd.DataFrame:
    """The columns of an arm's games by episode; NaN where one is empty or the game could not be played.

    Raises ValueError when the arm has two games for one episode.
    """
    if rows is None:
        return pd.DataFrame(columns=list(columns), dtype="float64")
    values = rows.set_index("episode")
    if not values.index.is_unique:
        first = rows.iloc[0]
        raise ValueError(f"arm {first['arm']!r}, seed {first['seed']}: an episode appears more than once")
    return values[list(columns)].astype("Float64").astype("float64").where(were_played(values))


def paired_t_test(low: FloatArray, high: FloatArray, closed: dict[str, str]) -> dict[str, float]:
    """H1: the mean of `high - low`, [N] each, is > 0. The result has the table's columns that exist for these pairs.

    Behind a closed gate there is no test: only the mean difference, which describes the games.
    """
    differences = high - low
    if len(differences) == 0:
        return {}
    largest = float(np.abs([low, high]).max())
    mean = float(differences.mean())
    if closed["reason"] or len(differences) < 2 or _all_equal(differences, largest):
        return {"mean_difference": 0.0 if abs(mean) <= ROUNDING * largest else mean}
    ci_low, ci_high = mean_interval(differences)
    test = scipy.stats.ttest_rel(high, low, alternative="greater")
    return {
        "mean_difference": mean,
        "ci_low": ci_low,
        "ci_high": ci_high,
        "t": float(test.statistic),
        "p_value": float(test.pvalue),
        "effect_size": mean / float(differences.std(ddof=1)),
    }


def paired_share_test(low: FloatArray, high: FloatArray, closed: dict[str, str]) -> dict[str, float]:
    """`paired_t_test` of values that are 0 or 1, with `mcnemar_p`: the p-value where all pairs differ alike."""
    cells = paired_t_test(low, high, closed)
    if not closed["reason"] and len(low) >= 2:
        cells["mcnemar_p"] = mcnemar(high - low, "greater")
        if cells["mean_difference"] != 0:
            cells.setdefault("p_value", cells["mcnemar_p"])
    return cells


def _all_equal(values: FloatArray, largest: float) -> bool:
    """Whether values [N] are equal up to the rounding of numbers as large as `largest`."""
    return bool(np.ptp(values) <= ROUNDING * largest or values.std(ddof=1) == 0)


def mcnemar(differences: FloatArray, alternative: Literal["greater", "two-sided"]) -> float:
    """The p-value of McNemar's exact test of differences [N] of failures; 1 where no pair differs."""
    more, fewer = int((differences > 0).sum()), int((differences < 0).sum())
    return float(scipy.stats.binomtest(more, more + fewer, 0.5, alternative).pvalue) if more + fewer else 1.0
