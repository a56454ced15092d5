"""Everything a campaign names is looked at before anything runs."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest

from harness.campaign.preflight import QUICK_RESPONSE_STEPS, QUICK_SEGMENT_STEPS, QUICK_STEPS, open_campaign
from harness.drivers.policy_file import Policy, write_policy
from harness.errors import Problem, UsageError
from tests.support.policies import some_policy
from tests.support.shipped import people_seeds
from tests.support.tiny import CAREFUL, PAPER_MERGE, write_campaign, write_persona


def problems_of(campaign: Path) -> list[Problem]:
    with pytest.raises(UsageError) as error:
        open_campaign(campaign)
    return error.value.problems


def scene_copy(folder: Path, **edits: tuple[str, str]) -> Path:
    """The scene merge in a folder of its own; `edits` replaces text in its files."""
    shutil.copytree(PAPER_MERGE, folder / "merge")
    for name, (old, new) in edits.items():
        files = {"scene": "scene.toml", "routes": "paper_merge.rou.xml", "net": "paper_merge.net.xml"}
        file = folder / "merge" / files[name]
        text = file.read_text()
        assert old in text
        file.write_text(text.replace(old, new))
    return folder / "merge"


def files_in(folder: Path) -> dict[Path, bytes]:
    return {file: file.read_bytes() for file in folder.rglob("*") if file.is_file()}


def test_open_campaign__the_papers(repository: Path) -> None:
    campaign = open_campaign(repository / "campaigns" / "paper_merge.toml")
    assert [persona.name for persona in campaign.personas] == ["paper_speedy", "paper_distracted"]
    assert campaign.ego_persona.name == "careful"
    assert campaign.document.training.steps == 3_000_000
    named = {"paper_merge.toml", "careful.toml", "paper_speedy.toml", "scene.toml", "paper_merge.net.xml"}
    assert {Path(name).name for name in campaign.hashes} >= named
    assert all(len(each) == 64 for each in campaign.hashes.values())


def test_open_campaign__quick_is_the_same_with_fewer_steps(repository: Path, tmp_path: Path) -> None:
    file = repository / "campaigns" / "paper_merge.toml"
    quick, full = open_campaign(file, quick=True).document, open_campaign(file).document
    assert (quick.training.steps, quick.training.segment_steps) == (QUICK_STEPS, QUICK_SEGMENT_STEPS)
    assert quick.reconfiguration.trials < full.reconfiguration.trials
    same = {"training": full.training, "reconfiguration": full.reconfiguration}
    assert quick.model_copy(update=same) == full
    tiny = open_campaign(write_campaign(tmp_path, best_response={"steps": 10**6}), quick=True).document
    assert tiny.training.steps == 2048  # never more than was asked for
    assert tiny.best_response is not None
    assert tiny.best_response.steps == QUICK_RESPONSE_STEPS


def test_open_campaign__names_are_relative_to_the_campaigns_own_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene_copy(tmp_path)
    write_persona(tmp_path, "anna")
    file = write_campaign(tmp_path, scene="merge", personas=["anna.toml"])
    monkeypatch.chdir("/")
    assert open_campaign(file).scene.folder == tmp_path / "merge"


@pytest.mark.parametrize(
    ("file_of_scene", "edit"),
    [
        ("scene.toml", {"scene": ('lane = "approach_1"', 'lane = "approach_9"')}),
        ("paper_merge.rou.xml", {"routes": ('type="person_car" route="through"', 'type="person_car" route="trough"')}),
    ],
)
def test_open_campaign__all_mistakes_are_reported_at_once_and_nothing_is_written(
    file_of_scene: str, edit: dict[str, tuple[str, str]], tmp_path: Path
) -> None:
    scene = scene_copy(tmp_path, **edit)
    persona = write_persona(tmp_path, "anna")
    persona.write_text(persona.read_text().replace("progress = 1.0", "progres = 1.0"))
    ego = {"driver": "lerned", "persona": str(CAREFUL)}
    changes = {"ego": ego, "training": {"stepps": 5000}, "assessment": {"episodes": 1}}
    file = write_campaign(tmp_path, scene=str(scene), personas=[str(persona)], **changes)
    before = files_in(tmp_path)
    problems = problems_of(file)
    assert {problem.key for problem in problems} >= {"assessment.episodes", "ego.driver", "training.stepps"}
    assert {Path(problem.file).name for problem in problems} == {"tiny.toml", "anna.toml", file_of_scene}
    assert any(problem.key == "training.stepps" and "'steps'" in problem.remedy for problem in problems)
    assert any("progres" in str(problem) and "'progress'" in str(problem) for problem in problems)
    assert files_in(tmp_path) == before


@pytest.mark.parametrize(
    "names", [["naive"], ["sumo"], ["anna", "retrained_anna"], ["anna", "anna_alone"], ["naive_vs_sumo"]]
)
def test_open_campaign__a_persona_whose_stages_would_be_taken_for_others_is_refused(
    names: list[str], tmp_path: Path
) -> None:
    personas = [str(write_persona(tmp_path, name)) for name in names]
    problems = problems_of(write_campaign(tmp_path, personas=personas))
    assert problems
    assert all(problem.key == "personas" and repr(names[-1]) in problem.message for problem in problems)


def test_open_campaign__the_folder_of_a_policy(tmp_path: Path) -> None:
    write_policy(some_policy(), tmp_path / "policies" / "mine")
    ego = {"driver": "policies/mine", "persona": str(CAREFUL)}
    file = write_campaign(tmp_path, ego=ego)
    assert open_campaign(file).ego_driver.place == tmp_path / "policies" / "mine"
    (tmp_path / "policies" / "mine" / "policy.safetensors").write_bytes(b"PK")
    (problem,) = problems_of(file)
    assert Path(problem.file).name == "policy.safetensors"


def test_open_campaign__a_shield_needs_an_ego_that_decides(tmp_path: Path) -> None:
    (tmp_path / "krauss.toml").write_text('kind = "sumo"\nvehicle_type = "ego_car"\n', encoding="utf-8")
    ego = {"driver": "krauss.toml", "persona": str(CAREFUL), "shield": "rss"}
    (problem,) = problems_of(write_campaign(tmp_path, ego=ego))
    assert (problem.key, Path(problem.file).name) == ("ego.shield", "tiny.toml")
    assert "SUMO drives the ego 'krauss.toml'" in problem.message
    assert "another ego.driver" in problem.remedy


@pytest.mark.parametrize(
    ("changes", "key", "words"),
    [
        ({"roads": ["merge_convoy"]}, "roads", "its players"),
        ({"roads": ["merge"], "retraining": {"starts": "regret"}}, "retraining.starts", "one road"),
        ({"roads": ["merge"], "ego": {"driver": "sumo"}}, "roads", "no ego is trained"),
        ({"roads": ["merge"], "training": {"games": 1}}, "training.games", "give at least 2"),
    ],
)
def test_open_campaign__roads_on_which_no_ego_can_learn_are_refused(
    changes: dict[str, Any], key: str, words: str, tmp_path: Path
) -> None:
    (problem,) = problems_of(write_campaign(tmp_path, **changes))
    assert problem.key == key
    assert words in f"{problem.message}; {problem.remedy}"


def test_open_campaign__shipped_people_are_those_of_the_scene_and_of_its_roads(tmp_path: Path) -> None:
    shutil.copytree(PAPER_MERGE, tmp_path / "copy")
    asked = {"scene": "copy", "retraining": {"against": ["sumo", "shipped"]}, "personas": []}
    (problem,) = problems_of(write_campaign(tmp_path, **asked))
    assert problem.key == "retraining.against"
    assert "no people are shipped" in problem.message
    campaign = open_campaign(write_campaign(tmp_path, roads=["merge", "cut_in"], **asked))
    assert {name: sorted({each.persona.name for each in people}) for name, people in campaign.shipped.items()} == {
        "merge": ["careful", "cautious", "drowsy", "impaired", "late_merger", "speedy", "tailgater", "texting"],
        "cut_in": ["impatient", "speedy"],
    }
    seed = people_seeds("cut_in")[0]
    assert any(name.endswith(f"cut_in/impatient-seed{seed}/policy.safetensors") for name in campaign.hashes)


def test_open_campaign__perception_errors_need_an_ego_that_decides(tmp_path: Path) -> None:
    (tmp_path / "krauss.toml").write_text('kind = "sumo"\nvehicle_type = "ego_car"\n', encoding="utf-8")
    ego = {"driver": "krauss.toml", "persona": str(CAREFUL), "perception": "radar_camera"}
    (problem,) = problems_of(write_campaign(tmp_path, ego=ego))
    assert (problem.key, Path(problem.file).name) == ("ego.perception", "tiny.toml")
    assert "its driver models know what is there" in problem.message


def test_open_campaign__reads_the_perception_errors_that_it_names(tmp_path: Path) -> None:
    ego = {"persona": str(CAREFUL), "perception": "radar_camera"}
    campaign = open_campaign(write_campaign(tmp_path, ego=ego))
    errors = campaign.document.ego.perception_errors
    assert errors is not None
    assert errors.latency_s == 0.2
    assert any(name.endswith("perception/radar_camera.toml") for name in campaign.hashes)
    (problem,) = problems_of(write_campaign(tmp_path, ego={**ego, "perception": "radar_camra"}))
    assert problem.key == "ego.perception"
    assert "did you mean 'radar_camera'" in problem.remedy


def test_open_campaign__tells_of_egos_that_learned_in_other_games(tmp_path: Path) -> None:
    card = {"player": "ego", "persona": "hasty", "persona_sha256": "0" * 64, "scene": "merge"}
    for name, scene in (("mine", "paper_merge"), ("other", "crossing")):
        write_policy(Policy(some_policy().tensors, {**card, "scene": scene}), tmp_path / name)
    campaign = write_campaign(
        tmp_path, ego={"driver": "mine", "persona": str(CAREFUL)}, crossplay={"egos": ["other"]}, training=None
    )
    persona = "persona hasty, here careful"
    assert open_campaign(campaign).learned_elsewhere == {
        "mine": f"learned in other games: {persona}",
        "other": f"learned in other games: scene crossing, here paper_merge; {persona}",
    }


def test_open_campaign__refuses_an_ego_that_learned_with_another_car(tmp_path: Path) -> None:
    cars = [{"max_acceleration_mps2": 3.0, "max_braking_mps2": 6.0, "max_steering_rad": 0.6}]
    write_policy(Policy(some_policy().tensors, {"cars": cars}), tmp_path / "mine")
    (problem,) = problems_of(write_campaign(tmp_path, ego={"driver": "mine", "persona": str(CAREFUL)}, training=None))
    assert (Path(problem.file).name, problem.key) == ("policy.json", "cars")
    assert "max_braking_mps2 6 m/s², max_steering_rad 0.6 rad, and the ego of scene paper_merge has" in problem.message
