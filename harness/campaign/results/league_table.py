"""The results of a league, from the run folders of its campaigns.

league.csv     a row for each pairing, worst first; after them those with a player that can't drive the scene alone
league_games.csv    which games of each pairing the ego failed, for `harness league-table`
league.html    the matrix of scenes and people, and the rows; their cells open games in the reports of the scenes
result.json    the rows, what failed, and the exit code
junit.xml      a test for each pairing and each stage: an error where games could not be played
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from harness.campaign.results.ci_files import JUNIT, RESULT, write_record
from harness.campaign.results.kept_results import RunResult
from harness.campaign.results.league_games import LEAGUE_GAMES
from harness.campaign.results.league_rows import league_rows
from harness.campaign.storage.run_folder import RunFolder
from harness.campaign.storage.versions import versions
from harness.errors import FAILED
from harness.evaluation.comparisons.tied_ranks import with_shield
from harness.evaluation.tables import rows_in_json, table_of, write_csv
from harness.files import write_atomically
from harness.reports.junit import case_of, write_junit
from harness.reports.league_page import render_league, sentence_of

_NOT_FINISHED = "it is not finished"


@dataclass(frozen=True, kw_only=True)
class LeagueResult:
    """The result of a league, for the terminal and the exit code."""

    table: pd.DataFrame
    """The table `league`."""
    failed: Sequence[str]
    """What failed, in sentences."""
    exit_code: int
    record: Mapping[str, Any]
    """The content of `result.json`."""


def write_league(ego: str, folder: Path, results: Mapping[str, RunResult]) -> LeagueResult:
    """Write the results of a league into its folder. `results` are those of its campaigns, by the name of their run
    folder."""
    runs = [RunFolder(folder / name) for name in results]
    rows, games = league_rows(ego, [run for run in runs if (run.path / "summary.csv").is_file()])
    table = worst_pairings_first(table_of("league", rows))
    write_csv(table, folder / "league.csv")
    write_csv(table_of("league_games", rows), folder / LEAGUE_GAMES)
    addresses = [games[row["scene"], row["arm"], row["seed"]] for row in table.to_dict("records")]
    failed = list(_failures(results))
    write_atomically(folder / "league.html", render_league(ego, table, addresses, failed).encode())
    _write_junit(ego, folder / JUNIT, table, results)
    # of a league, what fails is that something was not played: it has no bounds
    exit_code = FAILED if failed else 0
    record = {"ego": ego, "exit_code": exit_code, "failed": failed, "rows": rows_in_json(table), "versions": versions()}
    write_record(folder / RESULT, record)
    return LeagueResult(table=table, failed=failed, exit_code=exit_code, record=record)


def worst_pairings_first(table: pd.DataFrame) -> pd.DataFrame:
    return table.sort_values(
        ["reason", "failure_rate", "serious_injuries", "scene", "person", "seed", "shield"],
        ascending=[True, False, False, True, True, True, True],
        key=lambda column: column != "" if column.name == "reason" else column,
        kind="stable",
        ignore_index=True,
    )


def _failures(results: Mapping[str, RunResult]) -> Iterator[str]:
    for name, result in results.items():
        for stage, reason in result.failed_stages.items():
            yield f"{name}: {stage}: {reason or _NOT_FINISHED}"
        if result.error_games:
            reasons = "; ".join(result.error_reasons)
            yield f"{name}: {result.error_games} games could not be played: {reasons}"


def _write_junit(ego: str, file: Path, table: pd.DataFrame, results: Mapping[str, RunResult]) -> None:
    cases = []
    for row in table.to_dict("records"):
        error = f"{row['errors']} of {row['episodes']} games could not be played" if row["errors"] else ""
        name = with_shield(f"{row['person']}, seed {row['seed']}", row["shield"])
        group = f"league.{row['scene']}"
        cases.append(case_of(name, group, error=error, details=sentence_of(row)))
    for name, result in results.items():
        for stage, reason in result.failed_stages.items():
            cases.append(case_of(stage, f"stages.{name}", error=reason or _NOT_FINISHED))
    write_junit(file, f"harness league {ego}", cases, {"harness": versions()["harness"], "ego": ego})
