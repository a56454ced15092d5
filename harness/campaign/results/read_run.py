"""Reading a run folder: what its finished stages stored, checked, and the tables of its arms."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
from rich.console import Console

from harness.campaign.plan.stages import Stage, arms_of, strategies_of
from harness.campaign.results.drawn_starts import drawn_starts, people_drive
from harness.campaign.results.shown_work import doing
from harness.campaign.storage.arm_tables import PLAYED, ArmTables, arm_tables
from harness.campaign.storage.manifest import campaign_in, done_in, planned
from harness.campaign.storage.run_folder import RunFolder
from harness.config.campaign import Campaign
from harness.drivers.policy_file import policy_files, read_card
from harness.errors import UsageError
from harness.evaluation.strategies import stage_id
from harness.evaluation.tables import is_of_a_search, joined, read_csv
from harness.evaluation.trace_file import check_traces
from harness.reports.run_tables import RunTables
from harness.road.scene.open_scene import OpenScene, open_scene


@dataclass(frozen=True, kw_only=True)
class ReadRun:
    """What a run folder holds, before it is evaluated."""

    campaign: Campaign
    stages: Sequence[Stage]
    """All that are planned."""
    scene: OpenScene
    policies: Mapping[str, Mapping[str, Any]]
    """The policy.json of each policy that was trained, derived or selected, by its stage."""
    tables: RunTables
    """What the stages that are done stored."""

    @property
    def manifest(self) -> Mapping[str, Any]:
        return self.tables.manifest

    @property
    def done(self) -> set[str]:
        """The stages that are done, by id."""
        return set(done_in(self.manifest))

    @property
    def is_judged(self) -> bool:
        """Whether reference drivers judged the failures of an arm."""
        return bool(done_in(self.manifest, "preventability"))


def read_run(folder: RunFolder, console: Console) -> ReadRun:
    """Read a run. Tables of arms whose log or whose metrics have changed are made anew. Raises UsageError where files
    are missing or damaged."""
    manifest = folder.manifest()
    folder.check_whole(manifest)
    scene, stages = open_scene(folder.scene), planned(manifest)
    for stage in done_in(manifest, "assessment"):
        _check_log(folder, stage, manifest["stages"][stage])
    frames: dict[str, Any] = {}
    for name, kind in _MADE_BY.items():
        frames[name] = joined(name, _gathered(folder, manifest, kind, f"{name}.csv"))
    made = [stage for kind in ("training", "conditioning", "selection") for stage in done_in(manifest, kind)]
    policies = {stage: _policy(folder.policy(stage)) for stage in made}
    with doing(console, "measuring the games"):
        arms = [arm_tables(folder, stage, scene) for stage in done_in(manifest, "assessment")]
    for name in ArmTables.__dataclass_fields__:
        frames[name] = joined(name, [getattr(arm, name) for arm in arms])
    tables = RunTables(
        manifest=manifest,
        arms=arms_of(stages),
        strategies=strategies_of(stages),
        starts=drawn_starts(scene, campaign_in(manifest).start_seed, frames["episodes"]["episode"]),
        non_ego_drives=people_drive(scene),
        **frames,
    )
    return ReadRun(campaign=campaign_in(manifest), stages=stages, scene=scene, policies=policies, tables=tables)


_MADE_BY = {
    "training": "training",
    "reconfiguration": "reconfiguration",
    "selections": "selection",
    "reference_drivers": "preventability",
    "takeovers": "preventability",
}
"""Tables that stages store, each with the kind of these stages."""


def result_table(folder: RunFolder, name: str) -> pd.DataFrame:
    """A table of the results that a run wrote. Raises UsageError for a folder that is no run, and one without it."""
    folder.manifest()
    return read_csv(folder.result(f"{name}.csv"))


def episodes_of(folder: RunFolder) -> pd.DataFrame:
    """The rows of `episodes.csv`. Raises UsageError unless the folder is one of a run that has games, with the results
    that it wrote."""
    episodes = result_table(folder, "episodes")
    if episodes.empty:
        raise UsageError.of(folder.path, "", "has no games: none of its arms is finished", "run the campaign again")
    return episodes


def _policy(folder: Path) -> dict[str, Any]:
    """The content of a policy's JSON. Raises UsageError where it is damaged, or lacks what a training writes."""
    card = read_card(folder)
    missing = [key for key in ("player", "scene", "training") if card.get(key) is None]
    missing += [key for key in ("against", "began_from") if key not in card]
    if missing:
        raise UsageError.of(policy_files(folder)[0], missing[0], "is missing", "train the policy again")
    return card


def _check_log(folder: RunFolder, stage: str, entry: Mapping[str, Any]) -> None:
    """Raises UsageError unless the log of an arm is its own, and has a trace of each game that was played: a report is
    refused before anything is measured."""
    file = folder.work(stage) / PLAYED
    played = read_csv(file)
    _check_rows(file, entry, played["arm"], played["seed"])
    check_traces(folder.traces(stage), played.loc[played["error"] == "", "episode"])


def _gathered(folder: RunFolder, manifest: Mapping[str, Any], kind: str, table: str) -> Iterator[pd.DataFrame]:
    for stage in done_in(manifest, kind):
        file = folder.work(stage) / table
        frame = read_csv(file)
        match kind:
            case "preventability":
                names = frame["arm"] + "_preventability"
            case "selection":
                names = frame["strategy"]
            case _:
                names = frame["stage"]
        _check_rows(file, manifest["stages"][stage], names, frame["seed"])
        if kind == "reconfiguration" and not is_of_a_search(frame):
            raise UsageError.of(file, "", "has rows of no search", "run the campaign again")
        yield frame


def _check_rows(file: Path, entry: Mapping[str, Any], names: pd.Series, seeds: pd.Series) -> None:
    """Raises UsageError unless these rows are of this stage."""
    if not ((names == entry["name"]) & (seeds == entry["seed"])).all():
        message = f"has rows that are not of {stage_id(entry['name'], entry['seed'])}"
        raise UsageError.of(file, "", message, "run the campaign again")
