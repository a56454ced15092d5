"""Compute every headline of published run folders again, from their games, with pandas and SciPy alone.

    python docs/publish/recompute.py                 # all folders in reports/
    python docs/publish/recompute.py reports/merge   # these

It reads episodes.csv, or episodes.csv.gz, and compares with summary.csv, comparisons.csv, over_trainings.csv,
attribution.csv, crossplay.csv, gaps.csv, generalisation.csv and equilibria.csv of the same folder. It imports nothing
of the harness: its formulas are written a second time, from the descriptions in docs/columns.md and docs/verdicts.md.
It prints how many cells agree, each that does not, and ends with exit code 1 if one does not.
"""

from __future__ import annotations

import math
import sys
from argparse import ArgumentParser, RawDescriptionHelpFormatter
from collections.abc import Iterator
from pathlib import Path

import pandas as pd
from scipy import stats

REPORTS = Path(__file__).parents[2] / "reports"
SIGNIFICANCE = 0.01
CLOSE = 1e-9  # relative, and absolute for what should be 0
COLUMNS = {
    "failure": "ego_failed",
    "mean_speed": "ego_mean_speed_mps",
    "person_failure": "person_failed",
    "bystander_failure": "bystander_failed",
    "follower_braking": "follower_max_deceleration_mps2",
}
HARM = ("person_failure", "bystander_failure", "follower_braking")
SIGNS = {("RQ1", "failure"): 1, ("RQ1", "mean_speed"): -1, ("RQ2", "failure"): -1, ("RQ2", "mean_speed"): 1}
Cell = tuple[str, float, float]  # where, as published, as computed here


class Games:
    """The games of a run folder, by arm and training seed."""

    def __init__(self, run: Path) -> None:
        episodes = next(path for name in ("episodes.csv", "episodes.csv.gz") if (path := run / name).exists())
        table = pd.read_csv(episodes, low_memory=False)
        self.played = table[(table["ego_outcome"] != "error") & table["error"].isna()]
        self.names = set(self.played["arm"])
        self.by_arm = {place: rows.set_index("episode") for place, rows in self.played.groupby(["arm", "seed"])}

    def of(self, arm: str, seed: int) -> pd.DataFrame:
        return self.by_arm.get((arm, seed), self.played.iloc[:0].set_index("episode"))

    def differences(self, less: str, more: str, seed: int, column: str) -> pd.Series:
        """`more` - `less` in the games of the same start."""
        pair = self.of(more, seed)[column] - self.of(less, seed)[column]
        return pair.astype(float).dropna()


def clopper_pearson(successes: float, games: int) -> tuple[float, float]:
    low = stats.beta.ppf(0.025, successes, games - successes + 1) if successes else 0.0
    high = stats.beta.ppf(0.975, successes + 1, games - successes) if successes < games else 1.0
    return float(low), float(high)


def t_interval(values: pd.Series) -> tuple[float, float]:
    error = values.std() / math.sqrt(len(values))
    reach = stats.t.ppf(0.975, len(values) - 1) * error
    return values.mean() - reach, values.mean() + reach


def mcnemar(differences: pd.Series, sides: int) -> float:
    """The exact p-value that more pairs are above 0 than below it; with two sides, that the two differ."""
    above, below = int((differences > 0).sum()), int((differences < 0).sum())
    pairs = above + below
    if sides == 1:
        return float(stats.binom.sf(above - 1, pairs, 0.5)) if pairs else 1.0
    return min(1.0, 2 * float(stats.binom.cdf(min(above, below), pairs, 0.5))) if pairs else 1.0


def holm(p_values: list[float], tests: int) -> list[float]:
    """Adjusted p-values in a family of so many tests; NaN stays."""
    adjusted, least = [math.nan] * len(p_values), 0.0
    made = sorted((p, place) for place, p in enumerate(p_values) if not math.isnan(p))
    for rank, (p, place) in enumerate(made):
        least = max(least, min(1.0, p * (tests - rank)))
        adjusted[place] = least
    return adjusted


def summary(table: pd.DataFrame, games: Games) -> Iterator[Cell]:
    for row in table.to_dict("records"):
        arm, where = games.of(row["arm"], row["seed"]), f"summary, {row['arm']}, seed {row['seed']}"
        shares = {"failure_rate": "ego_failed", "near_miss_rate": "near_miss", "harm_to_others_rate": "harm_to_others"}
        for name, column in shares.items():
            values = arm[column].dropna().astype(float)
            if not len(values):
                continue
            low, high = clopper_pearson(values.sum(), len(values))
            for end, value in (("", values.mean()), ("_low", low), ("_high", high)):
                yield f"{where}, {name}{end}", row[name + end], value
        if arm["ego_failed"].notna().any():
            for name, outcome in (("collisions", "collision"), ("rails", "rail"), ("timeouts", "timeout")):
                yield f"{where}, {name}", row[name], (arm["ego_outcome"] == outcome).sum()
            yield f"{where}, mean_speed_mps", row["mean_speed_mps"], arm["ego_mean_speed_mps"].mean()
            yield f"{where}, ego_payoff", row["ego_payoff"], arm["ego_payoff"].mean()


def arms(question: str, persona: str, games: Games) -> tuple[str, str]:
    """The two arms of a question. The second question is about the ego that was retrained against this persona, by
    learning or by a search of parameters, or else about the robust one."""
    naive = f"naive_vs_{persona}"
    if question == "RQ1":
        return "naive_alone", naive
    answers = [f"{ego}_vs_{persona}" for ego in ("retrained", "reconfigured", "robust")]
    return naive, next((arm for arm in answers if arm in games.names), answers[0])


def comparisons(table: pd.DataFrame, games: Games) -> Iterator[Cell]:
    for row in table.to_dict("records"):
        question, metric = row["question"], row["metric"]
        sign = SIGNS.get((question, metric), 1)
        values = sign * games.differences(*arms(question, row["persona"], games), row["seed"], COLUMNS[metric])
        where = f"comparisons, {question} {row['persona']}, seed {row['seed']}, {metric}"
        yield f"{where}, pairs", row["pairs"], len(values)
        if len(values):
            yield f"{where}, mean_difference", row["mean_difference"], values.mean()
        if not math.isnan(row["t"]):
            t = values.mean() / (values.std() / math.sqrt(len(values)))
            low, high = t_interval(values)
            found = {"ci_low": low, "ci_high": high, "t": t, "p_value": stats.t.sf(t, len(values) - 1)}
            for name, value in found.items():
                yield f"{where}, {name}", row[name], value
        elif pd.isna(row["reason"]) and len(values) > 1:
            yield f"{where}, spread without a t statistic", 0.0, values.std()
            if not math.isnan(row["p_value"]):
                yield f"{where}, p_value", row["p_value"], mcnemar(values, sides=1)
        if not math.isnan(row["mcnemar_p"]):
            yield f"{where}, mcnemar_p", row["mcnemar_p"], mcnemar(values, sides=1)
    for family in ((table["metric"] == "failure"), table["metric"].isin(HARM)):
        rows = table[family]
        tests = int(rows["planned_tests"].iloc[0]) if rows["planned_tests"].notna().any() else len(rows)
        for row, value in zip(rows.to_dict("records"), holm(rows["p_value"].tolist(), tests), strict=True):
            where = f"comparisons, {row['question']} {row['persona']}, seed {row['seed']}, {row['metric']}"
            yield f"{where}, p_holm", row["p_holm"], value
            if row["metric"] == "failure" and not math.isnan(value):
                yield f"{where}, significant", float(row["verdict"] == "significant"), float(value < SIGNIFICANCE)


def over_trainings(table: pd.DataFrame, games: Games, answered: pd.DataFrame) -> Iterator[Cell]:
    """`answered` is comparisons.csv, which says of which training seeds the question is answered."""
    for row in table.to_dict("records"):
        question, persona = row["question"], row["persona"]
        asked = answered[(answered["question"] == question) & (answered["persona"] == persona)]
        seeds = asked[(asked["metric"] == "failure") & asked["reason"].isna()]["seed"]
        sign, where = SIGNS[question, "failure"], f"over_trainings, {question} {persona}"
        columns = [sign * games.differences(*arms(question, persona, games), seed, "ego_failed") for seed in seeds]
        yield f"{where}, trainings", row["trainings"], len(columns)
        if math.isnan(row["mean_difference"]):
            continue
        both = pd.concat(columns, axis=1).dropna()  # a row for each start, a column for each training
        starts, trainings = both.shape
        mean = both.to_numpy().mean()
        yield f"{where}, mean_difference", row["mean_difference"], mean
        if math.isnan(row["p_value"]):
            continue
        centred = both - mean
        squares = (centred**2).to_numpy().sum()
        squares += (1 - 1 / starts) * (centred.sum(axis=0) ** 2).sum()
        squares += (1 - 1 / trainings) * (centred.sum(axis=1) ** 2).sum()
        of_trainings = both.mean().var() / trainings
        variance = squares / both.size**2 + of_trainings / trainings
        rest = max(variance - of_trainings, 0.0)
        degrees = variance**2 / (of_trainings**2 / (trainings - 1) + rest**2 / (starts - 1))
        t, reach = mean / math.sqrt(variance), stats.t.ppf(0.975, degrees) * math.sqrt(variance)
        found = {"t": t, "p_value": stats.t.sf(t, degrees), "standard_error": math.sqrt(variance), "degrees": degrees}
        found |= {"ci_low": max(-1.0, mean - reach), "ci_high": min(1.0, mean + reach)}
        for name, value in found.items():
            yield f"{where}, {name}", row[name], value
    tests = int(table["planned_tests"].iloc[0]) if len(table) else 0
    for row, value in zip(table.to_dict("records"), holm(table["p_value"].tolist(), tests), strict=True):
        yield f"over_trainings, {row['question']} {row['persona']}, p_holm", row["p_holm"], value


def attribution(table: pd.DataFrame, games: Games) -> Iterator[Cell]:
    p_values: list[float] = []
    for row in table.to_dict("records"):
        where = f"attribution, {row['persona']} {row['trait']}, seed {row['seed']}"
        sides = (("without", row["without_arm"], row["arm"]), ("alone", row["baseline_arm"], row["alone_arm"]))
        for side, less, more in sides:
            p_values.append(row[f"{side}_p"])
            if not isinstance(less, str) or not isinstance(more, str):
                continue
            values = games.differences(less, more, row["seed"], "ego_failed")
            yield f"{where}, {side}_pairs", row[f"{side}_pairs"], len(values)
            yield f"{where}, {side}_difference", row[f"{side}_difference"], values.mean()
            if not math.isnan(row[f"{side}_p"]):
                yield f"{where}, {side}_p", row[f"{side}_p"], mcnemar(values, sides=2)
    published = [row[f"{side}_p_holm"] for row in table.to_dict("records") for side in ("without", "alone")]
    for number, (as_published, value) in enumerate(zip(published, holm(p_values, len(p_values)), strict=True)):
        yield f"attribution, p_holm {number}", as_published, value


def crossplay(table: pd.DataFrame, games: Games) -> Iterator[Cell]:
    for row in table.to_dict("records"):
        arm, where = games.of(row["arm"], row["seed"]), f"crossplay, {row['arm']}, seed {row['seed']}"
        failed = arm["ego_failed"].dropna().astype(float)
        yield f"{where}, games", row["games"], len(failed)
        if not len(failed):
            continue
        low, high = clopper_pearson(failed.sum(), len(failed))
        for end, value in (("", failed.mean()), ("_low", low), ("_high", high)):
            yield f"{where}, failure_rate{end}", row[f"failure_rate{end}"], value
        for name, column in (("ego_payoff", "ego_payoff"), ("ego_mean_speed_mps", "ego_mean_speed_mps")):
            yield f"{where}, {name}", row[name], arm.loc[failed.index, column].mean()
        if not math.isnan(row["non_ego_payoff"]):
            yield f"{where}, non_ego_payoff", row["non_ego_payoff"], arm.loc[failed.index, "non_ego_payoff"].mean()


def gaps(table: pd.DataFrame, games: Games, cells: pd.DataFrame) -> Iterator[Cell]:
    """`cells` is crossplay.csv, which says in which arm two strategies meet. A player may keep its own strategy."""
    p_values = []
    for row in table.to_dict("records"):
        p_values.append(row["p_value"])
        seed, role, column = row["seed"], row["role"], f"{row['role']}_payoff"
        where = f"gaps, {row['ego']} {row['non_ego']} {role}, seed {seed}"
        of_seed = cells[cells["seed"] == seed]
        other = "non_ego" if role == "ego" else "ego"
        met = of_seed[(of_seed[other] == row[other]) & (of_seed["persona"].isin([row["persona"]]))]
        pair_arm = met.loc[met[role] == row[role], "arm"].item()
        own = games.of(pair_arm, seed)[column]
        answers = [own, games.of(f"{pair_arm}_{role}_response", seed)[column]]
        answers += [games.of(arm, seed)[column] for arm in met.loc[met[role] != row[role], "arm"]]
        both = pd.concat([own, *(each for each in answers if len(each))], axis=1).dropna().astype(float)
        yield f"{where}, pairs", row["pairs"], len(both)
        yield f"{where}, known", row["known"], both.shape[1] - 3
        if not len(both):
            continue
        pair, responses = both.iloc[:, 0], both.iloc[:, 1:].set_axis(range(both.shape[1] - 1), axis=1)
        even = both.index % 2 == 0
        best = responses[responses[~even].mean().idxmax()].where(even, responses[responses[even].mean().idxmax()])
        yield f"{where}, payoff", row["payoff"], pair.mean()
        yield f"{where}, gap", row["gap"], (best - pair).mean()
        yield f"{where}, search_gap", row["search_gap"], (responses[1] - pair).mean()
        if not math.isnan(row["p_value"]):
            t = (best - pair).mean() / ((best - pair).std() / math.sqrt(len(both)))
            low, high = t_interval(best - pair)
            found = {"ci_low": low, "ci_high": high, "p_value": stats.t.sf(t, len(both) - 1)}
            for name, value in found.items():
                yield f"{where}, {name}", row[name], value
    for row, value in zip(table.to_dict("records"), holm(p_values, len(p_values)), strict=True):
        yield f"gaps, {row['ego']} {row['non_ego']} {row['role']}, p_holm", row["p_holm"], value


def generalisation(table: pd.DataFrame, games: Games, cells: pd.DataFrame) -> Iterator[Cell]:
    arms = cells.set_index(["seed", "ego", "non_ego"])["arm"]
    for row in table.to_dict("records"):
        where = f"generalisation, {row['ego']} {row['non_ego']}, seed {row['seed']}"
        naive, now = (arms.get((row["seed"], ego, row["non_ego"]), "") for ego in ("naive", row["ego"]))
        fewer = games.differences(now, naive, row["seed"], "ego_failed")
        yield f"{where}, pairs", row["pairs"], len(fewer)
        if len(fewer):
            yield f"{where}, fewer_failures", row["fewer_failures"], fewer.mean()
        if not math.isnan(row["p_value"]):
            t = fewer.mean() / (fewer.std() / math.sqrt(len(fewer)))
            yield f"{where}, p_value", row["p_value"], stats.t.sf(t, len(fewer) - 1)
    for row, value in zip(table.to_dict("records"), holm(table["p_value"].tolist(), len(table)), strict=True):
        yield f"generalisation, {row['ego']} {row['non_ego']}, p_holm", row["p_holm"], value


def equilibria(table: pd.DataFrame, cells: pd.DataFrame) -> Iterator[Cell]:
    """What the published shares of each solution give, from crossplay.csv, and that nobody gains by a change."""
    for (seed, game, solution, number), rows in table.groupby(["seed", "game", "solution", "number"], dropna=False):
        egos, non_egos = (rows[rows["role"] == role].set_index("player") for role in ("ego", "non_ego"))
        of_seed = cells[cells["seed"] == seed].set_index(["ego", "non_ego"])
        failures, ego_payoff, non_ego_payoff = (
            of_seed[name].unstack().reindex(index=egos.index, columns=non_egos.index)
            for name in ("failure_rate", "ego_payoff", "non_ego_payoff")
        )
        where, x, y = f"equilibria, {game} {solution} {number}, seed {seed}", egos["share"], non_egos["share"]
        if solution == "safest":
            yield f"{where}, worst", rows["solution_failure_rate"].iloc[0], (x @ failures).max()
        elif solution == "nash":
            yield f"{where}, failures", rows["solution_failure_rate"].iloc[0], x @ failures @ y
            for role, shares, payoffs in (("ego", x, ego_payoff @ y), ("non_ego", y, x @ non_ego_payoff)):
                published = rows[rows["role"] == role].iloc[0]
                yield f"{where}, {role} payoff", published["solution_payoff"], shares @ payoffs
                yield f"{where}, {role} regret", published["regret"], max(0.0, payoffs.max() - shares @ payoffs)


def cells_of(run: Path) -> Iterator[Cell]:
    games, tables = Games(run), {path.stem: pd.read_csv(path) for path in sorted(run.glob("*.csv"))}
    yield from summary(tables["summary"], games)
    yield from comparisons(tables["comparisons"], games)
    if "over_trainings" in tables:
        yield from over_trainings(tables["over_trainings"], games, tables["comparisons"])
    if "attribution" in tables:
        yield from attribution(tables["attribution"], games)
    if "crossplay" in tables:
        met = tables["crossplay"]
        yield from crossplay(met, games)
        yield from gaps(tables["gaps"], games, met) if "gaps" in tables else ()
        yield from generalisation(tables["generalisation"], games, met) if "generalisation" in tables else ()
        yield from equilibria(tables["equilibria"], met)


def agree(published: float, computed: float) -> bool:
    if pd.isna(published) or pd.isna(computed):
        return bool(pd.isna(published) and pd.isna(computed))
    return math.isclose(published, computed, rel_tol=CLOSE, abs_tol=CLOSE)


def main(runs: list[Path]) -> int:
    mismatches = 0
    for run in runs:
        cells = list(cells_of(run))
        wrong = [cell for cell in cells if not agree(*cell[1:])]
        mismatches += len(wrong)
        print(f"{run.name}: {len(cells) - len(wrong)} of {len(cells)} cells agree")
        for where, published, computed in wrong:
            print(f"  {where}: published {published}, computed {computed}")
    return int(mismatches > 0)


def runs_named(arguments: list[str]) -> list[Path]:
    """The run folders of the command line: all that are published if it names none. Ends the program if one has no
    games."""
    parser = ArgumentParser(description=__doc__, formatter_class=RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="*", type=Path, metavar="RUN", help="a run folder with its tables")
    runs: list[Path] = parser.parse_args(arguments).runs
    for run in runs:
        if not (run / "summary.csv").is_file() or not list(run.glob("episodes.csv*")):
            parser.error(f"{run}: has no summary.csv, or no episodes.csv; name a run folder")
    return runs or sorted(each.parent for each in REPORTS.glob("*/summary.csv"))


if __name__ == "__main__":
    sys.exit(main(runs_named(sys.argv[1:])))
