"""The output of a parameter search: its table, and the driver that it found, as a document for campaigns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from harness.campaign.execution.crash_retries import OnProgress, OnStart
from harness.config.driver import read_driver
from harness.config.toml_writing import toml_of
from harness.config.tunable import Adjustable, Tunable
from harness.drivers.external import ExternalDriver
from harness.errors import StageFailed
from harness.evaluation.tables import RECONFIGURATION_COLUMNS, typed, write_csv
from harness.files import make_folder, write_atomically
from harness.training.parameter_search import Search, Trial, best, run_search

DRIVER = "driver.toml"
TABLE = "reconfiguration.csv"


def reconfigure(
    search: Search,
    *,
    labels: Mapping[str, Any],
    trials_file: Path,
    folder: Path,
    on_progress: OnProgress,
    on_start: OnStart,
) -> tuple[dict[str, Any], list[Path]]:
    """Carry out a search. Writes the driver that it found into `folder`, and its table beside `trials_file`.

    `labels` are the cells that all rows of the table share. Returns facts for the manifest, and the files. Raises as
    `run_search` does.
    """
    trials = run_search(search, trials_file, on_progress, on_start)
    chosen = best(trials)
    first, found = trials[0], trials[chosen]
    comments = [
        f"{search.driver.in_words}, reconfigured against the persona {labels['persona']}, seed {labels['seed']}.",
        f"Found in {len(trials)} trials of {search.settings.games} games each, as trial {chosen}: mean payoff "
        f"{found.mean_payoff:.4g} instead of {first.mean_payoff:.4g}.",
        "A campaign takes this file as [ego] driver; paths in it are relative to its folder.",
    ]
    driver = search.driver.tuned(found.values) if chosen else search.driver
    make_folder(folder)
    write_atomically(folder / DRIVER, toml_of(driver.document_in(folder), comments).encode())
    table = trials_file.with_name(TABLE)
    _write_table(trials, search.driver.searched, labels, table)
    unplayed = sum(each.mean_payoff is None for each in trials)
    info = {"trials": len(trials), "trials_unplayed": unplayed, "chosen_trial": chosen}
    return info, [folder / DRIVER, table]


def read_found(ego: ExternalDriver, folder: Path) -> ExternalDriver:
    """The ego with the parameters that a search wrote into this folder."""
    document = read_driver(folder / DRIVER)
    if not isinstance(document, Adjustable):
        raise StageFailed(f"{folder / DRIVER}: is not the result of a search")
    return ego.tuned({key: document.numbers[key] for key in ego.numbers})


def _write_table(trials: Sequence[Trial], searched: Sequence[Tunable], labels: Mapping[str, Any], file: Path) -> None:
    """A row for each trial and parameter."""
    chosen, best_payoff = best(trials), float("-inf")
    rows = []
    for number, trial in enumerate(trials):
        best_payoff = max(best_payoff, best_payoff if trial.mean_payoff is None else trial.mean_payoff)
        results = {
            "mean_payoff": trial.mean_payoff,
            "failure_rate": trial.failure_rate,
            "best_payoff": best_payoff,
            "chosen": number == chosen,
            "error": trial.error,
        }
        rows += [
            {
                **labels,
                "trial": number,
                "parameter": key,
                "value": trial.values[key],
                "low": low,
                "high": high,
                **results,
            }
            for key, low, high in searched
        ]
    write_csv(typed(pd.DataFrame(rows).reindex(columns=list(RECONFIGURATION_COLUMNS))), file)
