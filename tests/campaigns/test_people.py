"""A whole campaign on a scene with three people, by the real command."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from harness.evaluation.tables import read_csv
from harness.evaluation.trace_file import TraceReader
from tests.support.scenes import THREE_PEOPLE, build_scene
from tests.support.shared import built_once
from tests.support.tiny import SPEEDY, TRAINING, finished, harness, write_persona

pytestmark = pytest.mark.slow

PEOPLE = ["non_ego", "non_ego_2", "non_ego_3"]
MIXED: dict[str, Any] = {"name": "mixed", "personas": ["speedy", "anna", "speedy"]}


def three_people(folder: Path) -> None:
    build_scene(folder / "scene", places=THREE_PEOPLE)
    write_persona(folder, "anna")


@pytest.fixture(scope="module")
def run() -> Path:
    folder = built_once("three_people", three_people)
    return finished(
        "--quick",
        name="people",
        scene=str(folder / "scene"),
        personas=[str(SPEEDY), str(folder / "anna.toml")],
        training={**TRAINING, "steps": TRAINING["segment_steps"]},
        crowd=[MIXED],
    )


def test_campaign__has_the_arms_of_the_crowd(run: Path) -> None:
    episodes = read_csv(run / "episodes.csv")
    of_one = ("_alone", "naive_vs_{}", "retrained_vs_{}", "retrained_alone_{}")
    named = {arm.format(name) if "{" in arm else name + arm for name in ("speedy", "anna", "mixed") for arm in of_one}
    assert set(episodes["arm"]) == (named | {"naive_alone", "naive_vs_sumo"}) - {"mixed_alone"}
    assert (episodes["error"] == "").all()


def test_campaign__all_people_take_part_beside_the_ego_and_one_at_a_time_without(run: Path) -> None:
    games = read_csv(run / "episodes.csv").set_index(["arm", "episode"])
    there = games[[f"{name}_outcome" for name in PEOPLE]] != ""
    assert there.loc[["naive_vs_mixed", "naive_vs_sumo"]].all(axis=None)
    assert not there.loc["naive_alone"].any(axis=None)
    assert there.loc["speedy_alone"].to_numpy().tolist() == [
        [True, False, False],
        [False, True, False],
        [False, False, True],
        [True, False, False],
    ]


def test_campaign__a_crowd_has_the_policies_of_its_personas(run: Path) -> None:
    def first_acceleration_mps2(arm: str, person: str) -> float:
        trace = TraceReader().read(run / "traces" / f"{arm}-seed1.parquet", 0)
        return float(trace[(trace["player"] == person) & (trace["step"] == 1)]["acceleration_mps2"].iloc[0])

    # The first decision is made from the start, which is the same in all arms.
    for person, persona in zip(PEOPLE, MIXED["personas"], strict=True):
        found = {arm: first_acceleration_mps2(f"naive_vs_{arm}", person) for arm in ("mixed", "speedy", "anna")}
        other = {"speedy": "anna", "anna": "speedy"}[persona]
        assert found["mixed"] == found[persona] != found[other]


def test_campaign__terminal_report_and_replays_name_the_people(run: Path) -> None:
    assert "mixed, RQ2" in (run.parent / "printed").read_text(encoding="utf-8")
    page = (run / "report.html").read_text(encoding="utf-8")
    assert "not for conclusions" in page  # it is a quick run
    assert "the naive ego against the crowd mixed" in page
    assert "the non-ego mixed" not in page
    listed = harness("replay", run, "--list")
    assert listed.returncode == 0, listed.stderr
    assert re.search(r"ego +non-ego +non-ego 2 +non-ego 3", listed.stdout)
    replay = run / "replays" / "naive_vs_mixed-seed1-000"
    assert all(f'id="{name}"' in (replay / "episode.fcd.xml").read_text(encoding="utf-8") for name in PEOPLE)


def test_check__lists_the_people_and_show_draws_them(run: Path, tmp_path: Path) -> None:
    checked = harness("check", run / "scene")
    assert checked.returncode == 0, checked.stderr
    assert [line.split(":")[0] for line in checked.stdout.splitlines() if ": vehicle" in line] == ["ego", *PEOPLE]
    page = tmp_path / "scene.html"
    shown = harness("scene", "show", run / "scene", "--html", page)
    assert shown.returncode == 0, shown.stderr
    assert all(f"route of {name}" in page.read_text(encoding="utf-8") for name in PEOPLE)
