"""Rounds end early only where a pair that can drive is an approximate equilibrium."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from harness.campaign.execution.run_stage import closed_gate_before
from harness.campaign.plan.stages import EquilibriumGate, TrainingStage
from harness.campaign.storage.run_folder import RunFolder
from harness.evaluation.competence import AloneBound
from harness.evaluation.strategies import PersonaNonEgo
from tests.support.game_tables import arm
from tests.support.plans import campaign_of

BOUND = AloneBound(player="ego", words="the retrained ego", arm="retrained_alone_anna", goal_share=0.97)
GATE = EquilibriumGate(
    pair="retrained_vs_anna-seed1",
    ego_response="retrained_vs_anna_ego_response-seed1",
    non_ego_response="retrained_vs_anna_non_ego_response-seed1",
    alone=("retrained_alone_anna-seed1",),
    bounds=(BOUND,),
)
ROUND_3 = TrainingStage(
    seed=1,
    persona="anna",
    strategy=PersonaNonEgo(persona="anna", round=3),
    opponent=(),
    initial=None,
    alone_share=0.0,
    gates=(GATE,),
)


@pytest.mark.parametrize(("failures", "ends"), [(0, True), (4, False)])
def test_equilibrium__of_a_pair_that_cannot_drive_is_none(
    failures: int, ends: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def tables(folder: RunFolder, stage: str) -> Any:  # no best response earns anything more
        failed = [1] * failures + [0] * (20 - failures) if stage in GATE.alone else [0] * 20
        return SimpleNamespace(episodes=arm(stage.removesuffix("-seed1"), ego_failed=failed))

    monkeypatch.setattr("harness.campaign.storage.arm_tables.arm_tables", tables)
    campaign = campaign_of("anna", best_response={})
    assert closed_gate_before(ROUND_3, RunFolder(tmp_path), campaign) == (GATE if ends else None)
