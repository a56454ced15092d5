"""Learning curves of trainings that are done, and of one that goes on."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pandas as pd
import pytest

from harness.campaign.storage.manifest import planned
from harness.campaign.storage.run_folder import RunFolder
from harness.campaign.storage.training_curves import CHECKPOINT, curves_so_far
from harness.evaluation.tables import read_csv
from tests.support.tiny import learned_run

pytestmark = pytest.mark.slow


@pytest.fixture
def folder(tmp_path: Path) -> RunFolder:
    return RunFolder(shutil.copytree(learned_run(), tmp_path / "run"))


def curves(folder: RunFolder) -> pd.DataFrame:
    return curves_so_far(folder, planned(json.loads(folder.manifest_file.read_bytes())))


def test_curves__of_a_training_that_goes_on_are_those_of_its_checkpoint(folder: RunFolder) -> None:
    done = curves(folder)
    assert done.equals(read_csv(folder.path / "training.csv")[done.columns])
    work = folder.work("naive-seed1")
    (work / "training.csv").unlink()
    going_on = curves(folder)
    of_naive = going_on["stage"] == "naive"
    assert (going_on.loc[of_naive, "stopped"] == "").all()
    pd.testing.assert_frame_equal(going_on.drop(columns="stopped"), done.drop(columns="stopped"))
    for damaged in (b"", b"x" * 100):
        (work / CHECKPOINT).write_bytes(damaged)
        assert set(curves(folder)["stage"]) == set(done["stage"]) - {"naive"}
