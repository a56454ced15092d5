"""The rows of a league, from the tables of its campaigns: one for each pairing of the ego with a person in a scene, and
one for the ego with its shield."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from harness.campaign.plan.alone_bounds import alone_bounds
from harness.campaign.plan.stages import AssessmentStage, arms_of
from harness.campaign.results.league_games import games_sha256, outcome_cells
from harness.campaign.storage.manifest import campaign_in, planned
from harness.campaign.storage.run_folder import RunFolder
from harness.config.campaign import Campaign
from harness.evaluation.comparisons.comparison import games_by_arm, rate_cells
from harness.evaluation.comparisons.preventability import by_regulation
from harness.evaluation.competence import gate
from harness.evaluation.league_columns import NOBODY, SUMO_DRIVER, UNTRAINED
from harness.evaluation.strategies import Arm, ShieldedEgo, SumoNonEgo, strategy_name
from harness.evaluation.tables import read_csv
from harness.evaluation.worst_first import worst_first
from harness.reports.embedding import key
from harness.reports.provenance import scene_of

_COPIED = (
    *("arm", "seed", "episodes", "errors", "failure_rate", "failure_rate_low", "failure_rate_high"),
    *("collisions", "rails", "timeouts", "mean_speed_mps"),
    *("harm_to_others_rate", "harm_to_others_rate_low", "harm_to_others_rate_high"),
)
"""Columns that are those of `summary.csv`."""


def league_rows(
    ego: str, runs: Sequence[RunFolder]
) -> tuple[list[Mapping[str, Any]], Mapping[tuple[str, str, int], str]]:
    """The rows of the campaigns, and the address of the worst game of each that a report contains, by scene, arm and
    seed."""
    rows, games = list[dict[str, Any]](), dict[tuple[str, str, int], str]()
    for run in runs:
        rows += _rows(ego, run, games)
    return list(_each_once(rows)), games


def person_in(arm: Arm) -> str:
    match arm.non_ego:
        case None:
            return NOBODY
        case SumoNonEgo():
            return SUMO_DRIVER
        case _:
            return strategy_name(arm.non_ego)


def shield_in(arm: Arm, campaign: Campaign) -> str:
    """The rule of the shield of an arm's ego; empty: it has none."""
    return (campaign.ego.shield or "") if isinstance(arm.ego, ShieldedEgo) else ""


def _each_once(rows: Sequence[Mapping[str, Any]]) -> Iterator[Mapping[str, Any]]:
    """The rows without repetitions: for every training seed of the people, nobody and SUMO's driver meet the ego in the
    same games."""
    seen = set[tuple[str, str, str]]()
    for row in rows:
        pairing = (row["scene"], row["person"], row["shield"])
        if row["person"] not in UNTRAINED or pairing not in seen:
            yield row
        seen.add(pairing)


def _rows(ego: str, run: RunFolder, games: dict[tuple[str, str, int], str]) -> Iterator[dict[str, Any]]:
    """The rows of a campaign; the address of the worst game of each that its report contains is added to `games`."""
    summary, episodes, manoeuvres = (
        read_csv(run.path / f"{name}.csv") for name in ("summary", "episodes", "manoeuvres")
    )
    manifest, games_of = run.manifest(), games_by_arm(episodes)
    scene, campaign = scene_of(manifest), campaign_in(manifest)
    plan = planned(manifest)
    arms = arms_of(plan)
    digests = games_sha256(run, manifest, [each for each in plan if isinstance(each, AssessmentStage)])
    file = run.path / "preventability.csv"
    prevented = read_csv(file) if file.is_file() else None
    page = (run.path / "report.html").read_text(encoding="utf-8")
    for row in summary.to_dict("records"):
        arm, seed = row["arm"], row["seed"]
        if arms[arm].ego is None:
            continue
        person = person_in(arms[arm])
        of_arm = games_of[arm, seed]
        played = of_arm[of_arm["error"] == ""]
        brakes = manoeuvres[(manoeuvres["arm"] == arm) & (manoeuvres["seed"] == seed)]
        hard = brakes[(brakes["player"] == "ego") & (brakes["manoeuvre"] == "hard_brake")]["episode"].nunique()
        cells = {name: row[name] for name in _COPIED} | {"scene": scene, "person": person}
        cells |= {"ego": ego, "shield": shield_in(arms[arm], campaign)}
        cells |= {"serious_injuries": played["mais3_risk_high"].sum() / len(played) if len(played) else np.nan}
        cells |= rate_cells("hard_brake_rate", hard, len(played))
        cells["reason"] = "" if person == NOBODY else gate(alone_bounds(campaign, arms[arm]), seed, games_of)["reason"]
        cells |= outcome_cells(of_arm) | {"games_sha256": digests[arm, seed]}
        of_regulation = [] if prevented is None else by_regulation(prevented[prevented["seed"] == seed], arm)
        for end in ("", "_low", "_high"):
            cells[f"preventable_rate{end}"] = of_regulation[0][f"from_start_rate{end}"] if of_regulation else np.nan
        keys = [key(arm, seed, int(episode)) for episode in worst_first(of_arm)["episode"]]
        shown = next((each for each in keys if f'{each}"' in page), "")
        games[scene, arm, seed] = f"{run.path.name}/report.html" + (f"#game={shown}" if shown else "")
        yield cells
