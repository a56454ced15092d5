"""Whether an approximate equilibrium is reached: no player's best response gains anything distinguishable from 0.

A pair of which a player can't drive the scene alone is in none: that no training found anything better shows nothing.
"""

from __future__ import annotations

from harness.campaign.plan.stages import EquilibriumGate, Stage
from harness.campaign.storage.run_folder import RunFolder


def equilibrium_before(stage: Stage, folder: RunFolder, significance: float) -> EquilibriumGate | None:
    """The first gate of a stage whose pair is an approximate equilibrium; None if the stage has to be carried out."""
    return next((gate for gate in stage.gates if _is_equilibrium(gate, stage, folder, significance)), None)


def _is_equilibrium(gate: EquilibriumGate, stage: Stage, folder: RunFolder, significance: float) -> bool:
    import pandas as pd  # slow to import, and few stages have gates

    from harness.evaluation.game_theory.best_response_gap import gaps, nothing_to_gain
    from harness.evaluation.game_theory.records import Response, Role
    from harness.evaluation.tables import read_csv

    episodes = pd.concat([read_csv(folder.work(each) / "episodes.csv") for each in gate.stages], ignore_index=True)
    pair, *responses = (str(name) for name in episodes["arm"].unique()[:3])
    roles: tuple[Role, Role] = ("ego", "non_ego")
    asked = [
        Response(
            seed=stage.seed,
            role=role,
            persona=stage.persona,
            round=0,
            pair_arm=pair,
            response_arm=arm,
            ego="",
            non_ego="",
            alone=gate.bounds,
        )
        for role, arm in zip(roles, responses, strict=True)
    ]
    return nothing_to_gain(gaps(asked, episodes, significance))
