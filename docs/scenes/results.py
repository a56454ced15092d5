"""The results of campaigns on scenes, seed by seed, as a Markdown table.

    python docs/scenes/results.py reports/left_across reports/roundabout

prints the shares of games in which the ego fails and the person reaches its goal, and the verdicts on failures: for
each training seed about this trained pair, and in the row "all" about trainings like this.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import pandas as pd
import typer

from harness.evaluation.tables import read_csv

HEADER = (
    *("scene", "person", "seed", "naive ego alone fails", "beside SUMO's driver", "person alone reaches its goal"),
    *("naive ego fails", "retrained ego fails", "RQ1", "RQ2"),
)


def main(runs: Annotated[list[Path], typer.Argument(metavar="RUN...", help="Run folders.")]) -> None:
    """Print the table."""
    rows = [row for run in runs for row in rows_of(run)]
    print("\n".join("| " + " | ".join(cells) + " |" for cells in (HEADER, ["---"] * len(HEADER), *rows)))


def rows_of(run: Path) -> Iterator[list[str]]:
    """A row for each person and training seed of a run folder."""
    summary = read_csv(run / "summary.csv").set_index(["arm", "seed"])
    verdicts = read_csv(run / "comparisons.csv").query("metric == 'failure'")
    over = run / "over_trainings.csv"
    for (person, seed), questions in verdicts.groupby(["persona", "seed"], sort=False):
        failures = summary["failure_rate"].xs(seed, level="seed")
        arms = ("naive_alone", "naive_vs_sumo", f"naive_vs_{person}", f"retrained_vs_{person}")
        alone, beside, naive, retrained = (_share(failures[arm]) for arm in arms)
        goals = _share(summary.loc[(f"{person}_alone", seed), "non_ego_goal_rate"])
        answers = questions.set_index("question")["verdict"]
        yield [run.name, str(person), str(seed), alone, beside, goals, naive, retrained, answers["RQ1"], answers["RQ2"]]
    for person, questions in read_csv(over).groupby("persona", sort=False) if over.is_file() else ():
        rows = questions.set_index("question")
        answers = rows["verdict"]
        changes = [_points(rows.loc["RQ1"], 1), _points(rows.loc["RQ2"], -1)]
        yield [run.name, str(person), "all", *[""] * 3, *changes, answers["RQ1"], answers["RQ2"]]


def _points(row: pd.Series, sign: int) -> str:
    """The change of the failures over trainings in points, with its interval. RQ2's difference is that of fewer."""
    if pd.isna(row["ci_low"]):
        return ""
    mean, *ends = (100 * sign * row[name] for name in ("mean_difference", "ci_low", "ci_high"))
    low, high = sorted(ends)
    return f"{mean:+.0f} points ({low:+.0f} to {high:+.0f})"


def _share(value: float) -> str:
    return "" if pd.isna(value) else f"{100 * value:.0f} %"


if __name__ == "__main__":
    typer.run(main)
