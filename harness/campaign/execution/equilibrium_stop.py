"""Whether an exchange has settled: neither player's best response gains anything distinguishable from 0."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from harness.campaign.plan.stages import Gate, Stage
from harness.campaign.storage.run_folder import RunFolder
from harness.evaluation.game_theory.best_response_gap import gaps, nothing_to_gain
from harness.evaluation.game_theory.records import Response
from harness.evaluation.tables import read_csv


def settled(stage: Stage, folder: RunFolder, significance: float) -> Gate | None:
    """The gate by which a stage has nothing to do; None if it has."""
    return next((gate for gate in stage.unless if _has_settled(gate, stage, folder, significance)), None)


def _has_settled(gate: Gate, stage: Stage, folder: RunFolder, significance: float) -> bool:
    arms = (gate.pair, gate.ego_response, gate.non_ego_response)
    episodes = pd.concat([read_csv(folder.work(arm) / "episodes.csv") for arm in arms], ignore_index=True)
    pair, *responses = (str(name) for name in episodes["arm"].unique())
    asked: Sequence[Response] = [
        Response(stage.seed, role, stage.persona, 0, pair, arm, "", "")  # type: ignore[arg-type]
        for role, arm in zip(("ego", "non_ego"), responses, strict=True)
    ]
    return nothing_to_gain(gaps(asked, episodes, significance))
