"""The columns of `reconfiguration.csv`: a row per trial and parameter of a search."""

from __future__ import annotations

import pandas as pd

RECONFIGURATION_COLUMNS = {
    "stage": "object",
    "persona": "object",
    "seed": "int64",
    "trial": "int64",
    "parameter": "object",
    "value": "float64",
    "low": "float64",
    "high": "float64",
    "mean_payoff": "float64",
    "failure_rate": "float64",
    "best_payoff": "float64",
    "chosen": "bool",
    "error": "object",
}
"""In order, each with its pandas dtype. `low` and `high` are what the parameter was searched between, `best_payoff` is
the best mean payoff so far, `chosen` true of the trial that was taken; one that could not be played has an `error`."""


def is_of_a_search(trials: pd.DataFrame) -> bool:
    """Whether the ego as it was given is among the trials of a stage, and one of them was chosen."""
    payoffs = trials.groupby("trial")["mean_payoff"].first()
    return 0 in payoffs.index and payoffs.notna()[0] and trials.loc[trials["chosen"], "trial"].nunique() == 1
