"""What the selections of a run's later rounds say in sentences: which answers were taken, and which rejected."""

from __future__ import annotations

import pandas as pd

from harness.reports.numbers import number
from harness.reports.run_tables import Row


def selection_sentences(selections: pd.DataFrame) -> list[tuple[int, str]]:
    """Seed and sentence of each selection, in the order of the table."""
    found = selections.groupby(["seed", "persona", "round"], sort=False)
    return [(int(seed), _sentence(rows.to_dict("records"))) for (seed, _, _), rows in found]


def _sentence(candidates: list[Row]) -> str:
    """E.g. "Round 4, the ego against speedy: its answer is rejected. …". The last candidate is the new answer."""
    *before, answer = candidates
    games = f"{answer['episodes']} games, {answer['alone']} of them alone"
    who = f"the ego against {answer['persona']}" if answer["role"] == "ego" else f"the {answer['persona']} driver"
    earned = f"In {games}, it earned {number(answer['payoff'], 2)} on average"
    if answer["chosen"]:
        best = max(before, key=lambda row: row["payoff"])
        fate = "is taken"
        other = f"the best policy before it, {best['candidate']}, {number(best['payoff'], 2)}."
    else:
        chosen = next(row for row in before if row["chosen"])
        fate = "is rejected"
        other = f"{chosen['candidate']} {number(chosen['payoff'], 2)}: the player goes on with this policy."
    return f"Round {answer['round']}, {who}: the new answer {fate}. {earned}, {other}"
