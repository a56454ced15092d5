"""The script behind docs/robust.md: its tables, of a run that is small enough to count."""

from __future__ import annotations

import json
import shutil
from itertools import product
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from tests.support.scripts import script

table = script("robust/robust_egos.py")

RESPONSE = "robust_vs_bert_non_ego_response"
FAILED = {
    "naive_vs_anna": [1, 2],
    "robust_vs_anna": [0, 3],
    "naive_vs_bert": [4, 4],
    "robust_vs_bert": [1, 0],
    RESPONSE: [2, 3],
}
"""Of ten games, by training seed. Anna is met in training."""


@pytest.fixture
def run(tmp_path: Path) -> Path:
    arms = [f"{ego}_{other}" for ego, other in product(("naive", "robust"), ("alone", "vs_sumo", "vs_anna", "vs_bert"))]
    games: list[dict[str, Any]] = [
        {
            "arm": arm,
            "seed": seed,
            "ego_outcome": "goal",
            "ego_failed": float(k < FAILED.get(arm, [0, 0])[seed - 1]),
            "ego_mean_speed_mps": 9.7 if arm == "robust_alone" else 10.0,
            "ego_max_deceleration_mps2": 8.0 if arm == "robust_vs_bert" and k < 3 else 2.0,
        }
        for arm, seed, k in product([*arms, RESPONSE], (1, 2), range(10))
    ]
    games.append({**games[0], "ego_outcome": "error", "ego_failed": None})
    pd.DataFrame(games).to_csv(tmp_path / "episodes.csv.gz", index=False)
    judged = {"driver": "careful_and_competent", "arm": "robust_vs_anna", "episodes": 10}
    prevented = [{**judged, "from_conflict_prevented": n, "from_start_prevented": 1 + n} for n in (0, 1)]
    other = {**judged, "driver": "rss", "from_conflict_prevented": 10, "from_start_prevented": 10}
    pd.DataFrame([*prevented, other]).to_csv(tmp_path / "preventability.csv", index=False)
    manifest = {"personas": ["anna", "bert"], "campaign": {"retraining": {"against": ["anna"]}}}
    (tmp_path / "manifest.json").write_text(json.dumps(manifest))
    return tmp_path


def test_persons__a_row_for_each_with_rates_over_all_seeds(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table.persons(run)
    lines = capsys.readouterr().out.splitlines()
    assert lines[2] == "| nobody |  | 0.0% (0.0% to 16.8%) | 0.0% (0.0% to 16.8%) | 0.0% | 0 of 2 |"
    assert lines[4] == "| anna | yes | 15.0% (3.2% to 37.9%) | 15.0% (3.2% to 37.9%) | 30.0% | 1 of 2 |"
    assert lines[5] == "| bert | no | 40.0% (19.1% to 63.9%) | 5.0% (0.1% to 24.9%) | 10.0% | 0 of 2 |"


def test_bounds__each_is_that_of_the_worst_person(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table.bounds(run)
    *_, met, others, response, preventable, slower, hard = capsys.readouterr().out.splitlines()
    assert met.endswith("| 15.0% (3.2% to 37.9%) against anna |")
    assert others.endswith("| 5.0% (0.1% to 24.9%) against bert |")
    assert response.endswith("| 25.0% (8.7% to 49.1%) against bert |")
    assert preventable.endswith("| 5.00% from the danger on, 15.00% from the start |")
    assert slower.endswith("| 3.0% |")
    assert hard.endswith("| 30.0% (11.9% to 54.3%) against bert |")


def test_compare__of_the_seeds_that_both_have(run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    apart = tmp_path / "apart"
    shutil.copytree(run, apart, ignore=shutil.ignore_patterns("apart"))
    games = pd.read_csv(apart / "episodes.csv.gz")
    games = games[games["seed"] == 2]
    games.loc[games["arm"] == "robust_vs_anna", "ego_failed"] = 0.0
    games.to_csv(apart / "episodes.csv.gz", index=False)
    table.compare(run, apart)
    *_, anna, bert = capsys.readouterr().out.splitlines()
    assert anna == "| anna | 20.0% | 20.0% | +0.0 | 30.0% | 0.0% | +30.0 |"
    assert bert == "| bert | 40.0% | 40.0% | +0.0 | 0.0% | 0.0% | +0.0 |"
