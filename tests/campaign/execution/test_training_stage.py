"""A training of a campaign: what it is given, and the table that it leaves."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import harness.campaign.execution.training_stage
from harness.campaign.execution.stage_run import RunContext, StageRun
from harness.campaign.execution.training_stage import carry_out_training
from harness.campaign.plan.stages import TrainingStage
from harness.campaign.storage.run_folder import RunFolder
from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.config.training import CurvePoint
from harness.drivers.policy_file import LearnedDriver, write_policy
from harness.evaluation.tables import read_csv
from harness.game.roles import EGO
from harness.road.scene.open_scene import open_scene
from harness.training.checkpoint import Progress
from harness.training.ppo import TrainingResult
from harness.training.training_games import TrainingSpec
from tests.support.plans import campaign_of, stages_of
from tests.support.policies import some_policy
from tests.support.tiny import CAREFUL, PAPER_MERGE, SPEEDY


@pytest.mark.parametrize("starts", ["uniform", "regret"])
def test_training__by_regret_is_given_the_naive_ego_and_its_table_has_the_regret(
    starts: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    specs: list[TrainingSpec] = []
    of_window = 0.5 if starts == "regret" else None
    window = CurvePoint(
        steps=8, mean_payoff=1.5, failure_rate=0.25, games=4, mean_duration_s=3.0, mean_regret=of_window
    )
    progress = Progress(
        segments=1, steps=8, segment_payoffs=[1.5], curve=[window], alone_games=[{"merge": 1}], alone_failures=[{}]
    )

    def recording(spec: TrainingSpec, **options: Any) -> TrainingResult:
        specs.append(spec)
        assert (options["card"]["alone_share"], options["card"]["attentive_share"]) == (0.25, 0.0)
        return TrainingResult(policy=some_policy(seed=9), progress=progress, stopped="budget")

    monkeypatch.setattr(harness.campaign.execution.training_stage, "train", recording)
    folder, policies = RunFolder(tmp_path), {"naive-seed1": some_policy(seed=1), "speedy-seed1": some_policy(seed=2)}
    for name, policy in policies.items():
        write_policy(policy, folder.policy(name))
    stage = stages_of("speedy", retraining={"starts": starts})["retrained_speedy"]
    assert isinstance(stage, TrainingStage)
    context = RunContext(
        folder=folder,
        document=campaign_of("speedy", retraining={"starts": starts}),
        ego_persona=read_document(CAREFUL, Persona),
        people={"speedy": read_document(SPEEDY, Persona)},
        keys={stage.id: "key"},
    )
    folder.begin(stage.id, "key")
    carry_out_training(stage, StageRun(context=context), open_scene(PAPER_MERGE))
    (spec,) = specs
    assert spec.places[0].player == EGO
    table = read_csv(folder.work(stage.id) / "training.csv")
    if starts == "uniform":
        assert spec.best_known is None
        assert "mean_regret" not in table
        return
    assert isinstance(spec.best_known, LearnedDriver)
    driver = harness.campaign.execution.training_stage.PlayerFactory(context=context, scene=spec.scene)
    assert stage.best_known is not None
    assert driver.policy_folder(stage.best_known) == folder.policy("naive-seed1")
    assert table["mean_regret"].tolist() == [0.5]
