"""The tables of a run as the cards look them up."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from harness.reports import wording
from harness.reports.treatment import ARMS, RECONFIGURED, RETRAINED, Change
from harness.reports.wording import Row, Conclusion, played


@dataclass(frozen=True)
class Results:
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
    drove: Sequence[Row] = ()
    """Rows of `populations`: each arm against a population by who drove."""

    def of(self, arm: str) -> dict[int, Row]:
        """The arm's rows by seed, where there are games that could be played."""
        rows = {seed: self.arms.get((arm, seed)) for seed in self.seeds}
        return {seed: row for seed, row in rows.items() if row is not None and played(row)}

    @property
    def change(self) -> Change:
        """What round 2 makes of the ego, if it is played."""
        arms = {*self.planned, *(arm for arm, _ in self.arms)}
        return RECONFIGURED if any(arm.startswith(f"{RECONFIGURED.made}_vs_") for arm in arms) else RETRAINED

    def asked(self, question: str, persona: str) -> list[int]:
        """The training seeds of which a question is asked: its treatment is played, or it is compared."""
        _, treatment = ARMS[question](persona, self.change)
        compared = {row["seed"] for row in self.comparisons if (row["question"], row["persona"]) == (question, persona)}
        return [seed for seed in self.seeds if f"{treatment}-seed{seed}" in self.planned or seed in compared]

    def verdicts(self, question: str, persona: str) -> Conclusion:
        """The answer to a question about a persona, in words."""
        rows = [row for row in self.comparisons if (row["question"], row["persona"]) == (question, persona)]
        seeds = self.asked(question, persona)
        return wording.verdicts(question, persona, seeds, rows, self.arms, self.significance, self.change)


def results(
    manifest: Mapping[str, Any],
    episodes: pd.DataFrame,
    summary: pd.DataFrame,
    comparisons: pd.DataFrame,
    populations: pd.DataFrame | None = None,
) -> Results:
    """The frames, looked up by arm and seed."""
    good = episodes[~unplayed(episodes)]
    return Results(
        {(row["arm"], row["seed"]): row for row in summary.to_dict("records")},
        comparisons.to_dict("records"),
        {key: games.dropna() for key, games in good.groupby(["arm", "seed"])["ego_mean_speed_mps"]},
        good,
        sorted({*manifest.get("seeds", ()), *summary["seed"].tolist(), *comparisons["seed"].tolist()}),
        manifest.get("campaign", {}).get("assessment", {}).get("significance"),
        manifest.get("stages", {}),
        populations.to_dict("records") if populations is not None else (),
    )


def unplayed(episodes: pd.DataFrame) -> pd.Series:
    """Which games could not be played."""
    return (episodes["ego_outcome"] == "error") | (episodes["error"] != "")
