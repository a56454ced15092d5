"""A whole campaign with three training seeds through the real command: what it says about trainings like these."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from harness.evaluation.tables import read_csv
from harness.evaluation.trace_file import TraceReader
from tests.support.tiny import BY_SUMO, finished, harness, sumo_run

pytestmark = pytest.mark.slow

THREE: dict[str, Any] = {**BY_SUMO, "name": "three_trainings", "seeds": [1, 2, 3], "assessment": {"episodes": 3}}
PLANNED = (
    "Holm's correction over 3 tests about this trained pair: RQ1 speedy (training seeds 1, 2, 3 each by itself)",
    "Holm's correction over 1 test about trainings like this: RQ1 speedy (training seeds 1, 2, 3 together)",
)


@pytest.fixture(scope="module")
def run() -> Path:
    return finished(**THREE)


def verdict_of(folder: Path) -> dict[str, Any]:
    """That on RQ1 in `result.json`."""
    verdicts = json.loads((folder / "result.json").read_text(encoding="utf-8"))["verdicts"]
    (verdict,) = [each for each in verdicts if each["question"] == "RQ1"]
    return dict(verdict)


def test_campaign__has_the_row_over_trainings_that_its_plan_names(run: Path) -> None:
    checked = harness("check", run.with_suffix(".toml")).stdout.splitlines()
    assert tuple(checked[-2:]) == PLANNED
    over, comparisons = read_csv(run / "over_trainings.csv"), read_csv(run / "comparisons.csv")
    (row,) = over.to_dict("records")
    assert (row["question"], row["persona"], row["about"]) == ("RQ1", "speedy", "trainings like this")
    assert (row["trainings"], row["starts"], row["planned_tests"]) == (3, 3, 1)
    failures = comparisons[comparisons["metric"] == "failure"]
    assert row["mean_difference"] == pytest.approx(failures["mean_difference"].mean())
    assert (row["least"], row["most"]) == (failures["mean_difference"].min(), failures["mean_difference"].max())
    assert set(comparisons["about"]) == {"this trained pair"}
    assert set(failures["planned_tests"]) == {3}
    verdict = verdict_of(run)
    assert (verdict["about"], verdict["planned_tests"]) == ("trainings like this", 1)
    assert "Over 3 trainings" in verdict["sentence"]
    page = (run / "report.html").read_text(encoding="utf-8")
    assert "About trainings like this, one of 1 planned test." in page
    assert "About trainings like this, one of 1 planned test." in (run.parent / "printed").read_text(encoding="utf-8")


def test_campaign__all_trainings_play_the_same_starts(run: Path) -> None:
    reader = TraceReader()
    starts = []
    for seed in (1, 2, 3):
        for episode in range(3):
            trace = reader.read(run / "traces" / f"naive_vs_speedy-seed{seed}.parquet", episode)
            first = trace[(trace["step"] == 0) & trace["player"].isin(["ego", "non_ego"])]
            starts.append((episode, *first[["x_m", "y_m", "speed_mps"]].to_numpy().ravel().tolist()))
    assert len(set(starts)) == 3
    episodes = read_csv(run / "episodes.csv")
    alone = [
        rows.drop(columns="seed").reset_index(drop=True)
        for (arm, _), rows in episodes.groupby(["arm", "seed"])
        if arm == "naive_alone"
    ]
    for other in alone[1:]:  # the ego is SUMO's driver, the same for each seed
        pd.testing.assert_frame_equal(alone[0], other, check_exact=True)


def test_campaign__with_one_training_is_about_this_trained_pair(run: Path) -> None:
    assert not (sumo_run() / "over_trainings.csv").exists()
    verdict = verdict_of(sumo_run())
    assert (verdict["about"], verdict["planned_tests"]) == ("this trained pair", 1)
    said = "About this trained pair, one of 1 planned test; trainings like this need 3 training seeds."
    assert said in (sumo_run().parent / "printed").read_text(encoding="utf-8")
    assert said in (sumo_run() / "report.html").read_text(encoding="utf-8")
    one, three = (read_csv(folder / "episodes.csv") for folder in (sumo_run(), run))
    same = three[(three["seed"] == 1) & (three["episode"] < 2)].reset_index(drop=True)
    pd.testing.assert_frame_equal(one, same, check_exact=True)  # the first seed's games are those without the others
