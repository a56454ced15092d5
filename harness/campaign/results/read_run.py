"""Reading a run folder: what its finished stages stored, checked, and the tables of its arms."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from harness.campaign.plan.plan import plan
from harness.campaign.plan.stages import Stage
from harness.campaign.results.policy_cards import trained_policies
from harness.campaign.storage.arm_tables import arm_tables
from harness.campaign.storage.manifest import is_tuned
from harness.campaign.storage.run_folder import JUDGED, RunFolder
from harness.config.campaign import Campaign
from harness.errors import UsageError
from harness.evaluation.tables import is_of_a_search, joined, read_csv
from harness.evaluation.trace_file import check_traces
from harness.road.scene.open_scene import OpenScene, open_scene


@dataclass(frozen=True, kw_only=True)
class ReadRun:
    """What a run folder holds. The frames are tables of `evaluation.columns.TABLES`, over all stages that are done."""

    manifest: Mapping[str, Any]
    campaign: Campaign
    stages: Sequence[Stage]
    """All that are planned."""
    scene: OpenScene
    policies: Mapping[str, Mapping[str, Any]]
    """The policy.json of each policy that was trained, by its stage."""
    episodes: pd.DataFrame
    causes: pd.DataFrame
    manoeuvres: pd.DataFrame
    training: pd.DataFrame
    reconfiguration: pd.DataFrame
    reference_drivers: pd.DataFrame | None
    """None where no arm's failures are judged."""


def read_run(folder: RunFolder) -> ReadRun:
    """Read a run. Tables of arms whose log or whose metrics have changed are made anew. Raises UsageError where files
    are missing or damaged."""
    manifest = folder.manifest()
    folder.check_whole(manifest)
    campaign = Campaign.model_validate(manifest["campaign"], strict=False)
    scene = open_scene(folder.scene)
    arms = [arm_tables(folder, stage, scene) for stage in _done(manifest, "assessment")]
    for stage, arm in zip(_done(manifest, "assessment"), arms, strict=True):
        _check_rows(folder, stage, manifest, "arm", arm.episodes)
        check_traces(folder.traces(stage), arm.episodes.loc[arm.episodes["error"] == "", "episode"])
    return ReadRun(
        manifest=manifest,
        campaign=campaign,
        stages=plan(campaign, manifest["personas"], is_tuned(manifest)),
        scene=scene,
        policies=trained_policies(folder, manifest),
        episodes=joined("episodes", [arm.episodes for arm in arms]),
        causes=joined("causes", [arm.causes for arm in arms]),
        manoeuvres=joined("manoeuvres", [arm.manoeuvres for arm in arms]),
        training=joined("training", _gathered(folder, manifest, "training", "training.csv")),
        reconfiguration=joined(
            "reconfiguration", _gathered(folder, manifest, "reconfiguration", "reconfiguration.csv")
        ),
        reference_drivers=_reference_drivers(folder, manifest),
    )


def _done(manifest: Mapping[str, Any], kind: str) -> list[str]:
    """The stages of a kind that are done."""
    entries = manifest["stages"].items()
    return [name for name, entry in entries if entry["kind"] == kind and entry["status"] == "done"]


def _gathered(folder: RunFolder, manifest: Mapping[str, Any], kind: str, table: str) -> Iterator[pd.DataFrame]:
    """The tables of the stages of a kind."""
    for stage in _done(manifest, kind):
        frame = read_csv(folder.work(stage) / table)
        _check_rows(folder, stage, manifest, "stage", frame)
        if kind == "reconfiguration" and not is_of_a_search(frame):
            raise _of_others(folder, stage)
        yield frame


def _reference_drivers(folder: RunFolder, manifest: Mapping[str, Any]) -> pd.DataFrame | None:
    stages = _done(manifest, "preventability")
    frames = [read_csv(folder.work(stage) / JUDGED) for stage in stages]
    for stage, frame in zip(stages, frames, strict=True):
        _check_rows(folder, stage, manifest, "arm", frame.assign(arm=frame["arm"] + "_preventability"))
    return joined("reference_drivers", frames) if stages else None


def _check_rows(folder: RunFolder, stage: str, manifest: Mapping[str, Any], column: str, rows: pd.DataFrame) -> None:
    """Raises UsageError unless these rows are of this stage."""
    entry = manifest["stages"][stage]
    if not ((rows[column] == entry["name"]) & (rows["seed"] == entry["seed"])).all():
        raise _of_others(folder, stage)


def _of_others(folder: RunFolder, stage: str) -> UsageError:
    return UsageError.of(folder.work(stage), "", f"has rows that are not of {stage}", "run the campaign again")
