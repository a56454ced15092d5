"""The contents of a run's report: its manifest, its tables and its replays."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import pandas as pd

from harness.evaluation.comparisons.acceptance_checks import Check
from harness.evaluation.game_theory.records import GameFindings
from harness.evaluation.strategies import Arm, Strategy
from harness.evaluation.tables import table_of, typed

FINISHED = ("done", "settled")
"""Statuses of a stage that is complete."""


def _empty(name: str) -> Callable[[], pd.DataFrame]:
    return lambda: table_of(name)


@dataclass(frozen=True, kw_only=True)
class RunTables:
    """What a report is made of. The frames have the columns of `harness.evaluation.columns.TABLES`."""

    manifest: Mapping[str, Any]
    """The content of manifest.json."""
    arms: Mapping[str, Arm] = field(default_factory=dict)
    """The planned arms by name."""
    strategies: Mapping[str, Strategy] = field(default_factory=dict)
    """The strategies that are trained, by name."""
    episodes: pd.DataFrame = field(default_factory=_empty("episodes"))
    summary: pd.DataFrame = field(default_factory=_empty("summary"))
    comparisons: pd.DataFrame = field(default_factory=_empty("comparisons"))
    training: pd.DataFrame = field(default_factory=_empty("training"))
    reconfiguration: pd.DataFrame = field(default_factory=_empty("reconfiguration"))
    """Empty: the report has no section on searches."""
    populations: pd.DataFrame = field(default_factory=_empty("populations"))
    causes: pd.DataFrame = field(default_factory=_empty("causes"))
    reference_drivers: pd.DataFrame = field(default_factory=_empty("reference_drivers"))
    preventability: pd.DataFrame = field(default_factory=_empty("preventability"))
    """Empty: no failure was judged by reference drivers."""
    manoeuvres: pd.DataFrame | None = None
    """None: the report has no section on manoeuvres."""
    game: GameFindings | None = None
    """None: the report has no section on the game."""
    non_ego_drives: bool = True
    """Whether the people are drivers; else they are on foot, on bicycles or on e-scooters."""
    acceptance: Sequence[Check] | None = None
    """The checks of the campaign's bounds; None: it has none."""
    replays: Sequence[str] = ()
    """Names of the folders under `replays/`, in any order."""

    def with_types(self) -> RunTables:
        """The same with the dtypes of `TABLES`. Raises ValueError when a frame does not have a table's columns."""
        frames = {
            each.name: value for each in fields(self) if isinstance(value := getattr(self, each.name), pd.DataFrame)
        }
        return replace(self, **{name: typed(frame) for name, frame in frames.items()})

    @property
    def stages(self) -> Mapping[str, Mapping[str, Any]]:
        """The stages of the manifest, by id."""
        stages: Mapping[str, Mapping[str, Any]] = self.manifest.get("stages", {})
        return stages

    @property
    def unfinished(self) -> Mapping[str, Mapping[str, Any]]:
        """The stages that are not complete."""
        return {name: stage for name, stage in self.stages.items() if stage.get("status") not in FINISHED}

    @property
    def personas(self) -> list[str]:
        """Every persona that the manifest or a table names, in order of first appearance."""
        names = (*self.manifest.get("personas", ()), *self.comparisons["persona"], *self.summary["persona"])
        return [name for name in dict.fromkeys(names) if name]
