"""The results of a league, from the run folders of its campaigns.

league.csv     a row for each pairing, worst first; after them those with a player that can't drive the scene alone
league.html    the matrix of scenes and people, and the rows; their cells open games in the reports of the scenes
result.json    the rows, what failed, and the exit code
junit.xml      a test for each pairing and each stage: an error where games could not be played
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from harness.campaign.plan.alone_bounds import alone_bounds
from harness.campaign.plan.stages import AssessmentStage
from harness.campaign.results.ci_files import JUNIT, RESULT
from harness.campaign.results.kept_results import RunResult
from harness.campaign.storage.manifest import planned
from harness.campaign.storage.run_folder import RunFolder
from harness.campaign.storage.versions import versions
from harness.config.campaign import Campaign
from harness.errors import FAILED
from harness.evaluation.comparisons.comparison import games_by_arm, rate_cells
from harness.evaluation.comparisons.preventability import by_regulation
from harness.evaluation.competence import gate
from harness.evaluation.result_columns import NOBODY, SUMO_DRIVER
from harness.evaluation.strategies import NAIVE_ALONE, NAIVE_VS_SUMO
from harness.evaluation.tables import read_csv, table_of, write_csv
from harness.evaluation.worst_first import worst_first
from harness.files import write_atomically
from harness.reports.embedding import key
from harness.reports.junit import case_of, write_junit
from harness.reports.league_page import render_league, sentence_of
from harness.reports.provenance import scene_of

_PLACED = {NAIVE_ALONE.name: NOBODY, NAIVE_VS_SUMO.name: SUMO_DRIVER}
_NOT_FINISHED = "it is not finished"
_COPIED = (
    *("arm", "seed", "episodes", "errors", "failure_rate", "failure_rate_low", "failure_rate_high"),
    *("collisions", "rails", "timeouts", "mean_speed_mps"),
    *("harm_to_others_rate", "harm_to_others_rate_low", "harm_to_others_rate_high"),
)
"""Columns that are those of `summary.csv`."""


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
    rows, games = list[dict[str, Any]](), dict[tuple[str, str, int], str]()
    for name in results:
        run = RunFolder(folder / name)
        if (run.path / "summary.csv").is_file():
            rows += _rows(ego, run, games)
    table = table_of("league", _each_once(rows)).sort_values(
        ["reason", "failure_rate", "serious_injuries", "scene", "person", "seed"],
        ascending=[True, False, False, True, True, True],
        key=lambda column: column != "" if column.name == "reason" else column,
        kind="stable",
        ignore_index=True,
    )
    write_csv(table, folder / "league.csv")
    addresses = [games[row["scene"], row["arm"], row["seed"]] for row in table.to_dict("records")]
    failed = list(_failures(results))
    write_atomically(folder / "league.html", render_league(ego, table, addresses, failed).encode())
    _write_junit(ego, folder / JUNIT, table, results)
    # of a league, what fails is that something was not played: it has no bounds
    exit_code = FAILED if failed else 0
    rows = [{name: _in_json(cell) for name, cell in row.items()} for row in table.to_dict("records")]
    record = {"ego": ego, "exit_code": exit_code, "failed": failed, "rows": rows, "versions": versions()}
    text = json.dumps(record, indent=1, ensure_ascii=False, allow_nan=False)
    write_atomically(folder / RESULT, (text + "\n").encode("utf-8", errors="backslashreplace"))
    return LeagueResult(table=table, failed=failed, exit_code=exit_code, record=record)


def person_of(arm: str, persona: str) -> str:
    return _PLACED.get(arm, persona)


def _in_json(cell: Any) -> Any:
    """A cell as JSON has it: null where it is empty."""
    return None if pd.isna(cell) else cell


def _each_once(rows: Sequence[Mapping[str, Any]]) -> Iterator[Mapping[str, Any]]:
    """The rows without repetitions: for every training seed of the people, nobody and SUMO's driver meet the ego in the
    same games."""
    seen = set[tuple[str, str]]()
    for row in rows:
        pairing = (row["scene"], row["person"])
        if row["person"] not in _PLACED.values() or pairing not in seen:
            yield row
        seen.add(pairing)


def _rows(ego: str, run: RunFolder, games: dict[tuple[str, str, int], str]) -> Iterator[dict[str, Any]]:
    """The rows of a campaign; the address of the worst game of each that its report contains is added to `games`."""
    summary, episodes, manoeuvres = (
        read_csv(run.path / f"{name}.csv") for name in ("summary", "episodes", "manoeuvres")
    )
    manifest, games_of = run.manifest(), games_by_arm(episodes)
    scene, campaign = scene_of(manifest), Campaign.model_validate(manifest["campaign"], strict=False)
    arms = {stage.name: stage.arm for stage in planned(manifest) if isinstance(stage, AssessmentStage)}
    file = run.path / "preventability.csv"
    prevented = read_csv(file) if file.is_file() else None
    page = (run.path / "report.html").read_text(encoding="utf-8")
    for row in summary.to_dict("records"):
        arm, seed = row["arm"], row["seed"]
        person = person_of(arm, row["persona"])
        if row["failure_rate"] != row["failure_rate"] and not row["errors"]:
            continue  # a persona alone
        of_arm = games_of[arm, seed]
        played = of_arm[of_arm["error"] == ""]
        brakes = manoeuvres[(manoeuvres["arm"] == arm) & (manoeuvres["seed"] == seed)]
        hard = brakes[(brakes["player"] == "ego") & (brakes["manoeuvre"] == "hard_brake")]["episode"].nunique()
        cells = {name: row[name] for name in _COPIED} | {"ego": ego, "scene": scene, "person": person}
        cells |= {"serious_injuries": played["mais3_risk_high"].sum() / len(played) if len(played) else np.nan}
        cells |= rate_cells("hard_brake_rate", hard, len(played))
        cells["reason"] = "" if person == NOBODY else gate(alone_bounds(campaign, arms[arm]), seed, games_of)["reason"]
        of_regulation = [] if prevented is None else by_regulation(prevented[prevented["seed"] == seed], arm)
        for end in ("", "_low", "_high"):
            cells[f"preventable_rate{end}"] = of_regulation[0][f"from_start_rate{end}"] if of_regulation else np.nan
        keys = [key(arm, seed, int(episode)) for episode in worst_first(of_arm)["episode"]]
        shown = next((each for each in keys if f'{each}"' in page), "")
        games[scene, arm, seed] = f"{run.path.name}/report.html" + (f"#game={shown}" if shown else "")
        yield cells


def _failures(results: Mapping[str, RunResult]) -> Iterator[str]:
    """What failed, in sentences."""
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
        name, group = f"{row['person']}, seed {row['seed']}", f"league.{row['scene']}"
        cases.append(case_of(name, group, error=error, details=sentence_of(row)))
    for name, result in results.items():
        for stage, reason in result.failed_stages.items():
            cases.append(case_of(stage, f"stages.{name}", error=reason or _NOT_FINISHED))
    write_junit(file, f"harness league {ego}", cases, {"harness": versions()["harness"], "ego": ego})
