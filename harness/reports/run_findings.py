"""The tables of a run as the cards look them up."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from harness.config.campaign import LEARNED, ego_called
from harness.evaluation.comparisons.preventability import Preventability, preventability_of
from harness.evaluation.rule_book.cause_lines import cause_lines
from harness.evaluation.strategies import Arm, ReconfiguredEgo
from harness.reports.differences import Row
from harness.reports.run_tables import RunTables
from harness.reports.verdict_wording import ARMS, RECONFIGURED, RETRAINED, Asked, Change, Conclusion, conclusion, played


@dataclass(frozen=True, kw_only=True)
class RunFindings:
    """The tables as the cards look them up."""

    arms: Mapping[tuple[str, int], Row]
    """Rows of `summary` by arm and seed."""
    comparisons: Sequence[Row]
    speeds: Mapping[tuple[str, int], pd.Series]
    """The ego's average speed in each game, by arm and seed."""
    games: pd.DataFrame
    """Rows of `episodes` that could be played."""
    seeds: Sequence[int]
    significance: float | None
    planned: Collection[str]
    """Ids of the stages of the campaign, whether they are done or not."""
    is_reconfigured: bool
    """Whether round 2 searches the parameters of an external ego."""
    naive: str
    """The ego before round 2 in sentences, after "the"."""
    """Non-egos of the scene."""
    non_ego_drives: bool
    """Whether they are drivers."""
    crowds: Mapping[str, Sequence[str]]
    """The personas of each crowd, in the order of the scene's people."""
    preventability: Mapping[str, Sequence[Preventability]]
    """By arm: what reference drivers prevent, for each training seed."""
    persona_documents: Mapping[str, Mapping[str, Any]]
    """The documents of the personas, by name."""
    planned_arms: Mapping[str, Arm]
    """The arms of the campaign, by name."""
    by_driver: Sequence[Row]
    """Rows of `populations`: each arm against a population, by the persona that drove."""
    failures: pd.DataFrame
    """Rows of `causes`."""

    @property
    def person(self) -> str:
        """What a persona is in sentences, after "this"."""
        return "driver" if self.non_ego_drives else "person"

    def of(self, arm: str) -> dict[int, Row]:
        """The arm's rows by seed, where there are games that could be played."""
        rows = {seed: self.arms.get((arm, seed)) for seed in self.seeds}
        return {seed: row for seed, row in rows.items() if row is not None and played(row)}

    @property
    def change(self) -> Change:
        """What round 2 makes of the ego, if it is played."""
        return (RECONFIGURED if self.is_reconfigured else RETRAINED)._replace(naive=self.naive)

    def asked(self, question: str, persona: str) -> list[int]:
        """The training seeds of which a question is asked: its treatment is planned, or it is compared."""
        _, treatment = ARMS[question](persona, self.change)
        compared = {row["seed"] for row in self._rows(question, persona)}
        return [seed for seed in self.seeds if f"{treatment}-seed{seed}" in self.planned or seed in compared]

    def verdicts(self, question: str, persona: str) -> Conclusion:
        """The answer to a question about a persona, in words."""
        asked = Asked(
            question=question,
            persona=persona,
            who=self.who(persona) or f"the {persona} driver",
            comparisons=self._rows(question, persona),
            arms=self.arms,
            significance=self.significance,
            change=self.change,
        )
        return conclusion(asked, self.asked(question, persona))

    def causes(self, question: str, persona: str) -> tuple[str, ...]:
        """Why the ego failed against a persona in the arm that a question is about, a line for each kind of cause."""
        if question not in ARMS:
            return ()
        _, treatment = ARMS[question](persona, self.change)
        return tuple(cause_lines(self.failures[self.failures["arm"] == treatment]))

    def who(self, persona: str) -> str:
        """What the ego meets, if it is not one driver with a persona; else empty."""
        if persona in self.crowds:
            return f"the crowd {persona}"
        return "" if self.non_ego_drives else f"the {persona}"

    def _rows(self, question: str, persona: str) -> list[Row]:
        return [row for row in self.comparisons if (row["question"], row["persona"]) == (question, persona)]


def results(tables: RunTables) -> RunFindings:
    """The frames of a run, looked up by arm and seed."""
    manifest, summary, comparisons = tables.manifest, tables.summary, tables.comparisons
    good = tables.episodes[~unplayed(tables.episodes)]
    return RunFindings(
        arms={(row["arm"], row["seed"]): row for row in summary.to_dict("records")},
        comparisons=comparisons.to_dict("records"),
        speeds={key: games.dropna() for key, games in good.groupby(["arm", "seed"])["ego_mean_speed_mps"]},
        games=good,
        seeds=sorted({*manifest.get("seeds", ()), *summary["seed"].tolist(), *comparisons["seed"].tolist()}),
        naive=ego_called(manifest.get("campaign", {}).get("ego", {}).get("driver", LEARNED)),
        significance=manifest.get("campaign", {}).get("assessment", {}).get("significance"),
        planned=tables.stages,
        is_reconfigured=any(isinstance(arm.ego, ReconfiguredEgo) for arm in tables.arms.values()),
        non_ego_drives=tables.non_ego_drives,
        crowds={each["name"]: each["personas"] for each in manifest.get("campaign", {}).get("crowd", ())},
        preventability={
            arm: preventability_of(tables.preventability, tables.reference_drivers, arm)
            for arm in tables.preventability["arm"].unique()
        },
        persona_documents=manifest.get("persona_documents", {}),
        planned_arms=tables.arms,
        by_driver=tables.populations.to_dict("records"),
        failures=tables.causes,
    )


def unplayed(episodes: pd.DataFrame) -> pd.Series:
    """Which games could not be played."""
    return (episodes["ego_outcome"] == "error") | (episodes["error"] != "")
