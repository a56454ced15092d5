"""The document of perception errors: what it means, and what is wrong with it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from harness.config.campaign import Campaign
from harness.config.ego_perception import EgoPerception
from harness.config.toml_reading import read_document
from harness.errors import Problem, UsageError
from harness.game.perception_errors import PerceptionErrors
from harness.shipped_documents import shipped, shipped_names

DOCUMENT = """
name = "mine"
description = "Something to test with."
"""
GHOSTS = "[ghosts]\nper_min = 60.0\nmean_lifetime_s = 2.5\nahead_m = [5.0, 9.0]\nleft_m = [-1.0, 1.0]\n"
CAMPAIGN = 'name = "c"\nscene = "paper_merge"\npersonas = []\n'


def problem_of(folder: Path, text: str, model: type = EgoPerception) -> Problem:
    file = folder / "document.toml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(UsageError) as error:
        read_document(file, model)
    (problem,) = error.value.problems
    assert problem.file == str(file)
    return problem


def test_perception__without_errors_the_ego_sees_all_that_an_observation_has(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(DOCUMENT, encoding="utf-8")
    errors = read_document(tmp_path / "mine.toml", EgoPerception).errors
    assert errors == PerceptionErrors(range_m=120.0, field_of_view_rad=2.0 * np.pi)


def test_perception__the_shipped_documents_are_in_order_and_name_assumptions() -> None:
    for name in shipped_names("perception"):
        document = read_document(shipped("perception") / f"{name}.toml", EgoPerception)
        assert document.name == name
        assert "assumptions" in document.description or document.sources
    assert shipped_names("perception") == ["radar_camera"]


@pytest.mark.parametrize(
    ("text", "key", "message", "remedy"),
    [
        ("range_m = 200.0", "range_m", "200.0 is not possible", "less than or equal to 120"),
        ("latency = 0.1", "latency", "unknown key", "latency_s"),
        ("[[loss]]\ndistance_m = 5.0\nlosses_per_min = 1.0", "loss[0].mean_duration_s", "is missing", "add it"),
        (
            "[[loss]]\ndistance_m = 5.0\nlosses_per_min = 1.0\nmean_duration_s = 1.0\n" * 2,
            "loss[1].distance_m",
            "5 m is not farther",
            "sort the tables",
        ),
        (GHOSTS, "ghosts.per_min", "2.5 ghosts are there at a time", "at most 48"),
    ],
)
def test_perception__what_is_wrong_has_a_key_and_a_remedy(
    tmp_path: Path, text: str, key: str, message: str, remedy: str
) -> None:
    problem = problem_of(tmp_path, DOCUMENT + text)
    assert problem.key == key
    assert message in problem.message
    assert remedy in problem.remedy


def test_perception__may_be_a_table_of_the_campaign(tmp_path: Path) -> None:
    file = tmp_path / "c.toml"
    table = "\n".join(f"ego.perception.{line}" for line in DOCUMENT.split("\n") if line)
    file.write_text(f"{CAMPAIGN}{table}\nego.perception.latency_s = 0.2\n", encoding="utf-8")
    errors = read_document(file, Campaign).ego.perception_errors
    assert errors is not None
    assert errors.latency_s == 0.2
    wrong = problem_of(tmp_path, f"{CAMPAIGN}{table}\nego.perception.latency_s = -0.2\n", Campaign)
    assert wrong.key == "ego.perception.latency_s"


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ('[ego]\ndriver = "sumo"\nperception = "radar_camera"\n', "ego.perception"),
        ('[ego]\nperception = "radar_camera"\n[crossplay]\negos = ["sumo"]\n', "crossplay.egos"),
    ],
)
def test_perception__sumos_driver_is_refused(tmp_path: Path, text: str, key: str) -> None:
    problem = problem_of(tmp_path, CAMPAIGN + text, Campaign)
    assert problem.key == key
    assert "SUMO" in problem.message
    assert problem.remedy.startswith("leave out")
