"""The campaigns of a league: egos whose kind can be seen, discovered people, and mistakes of the command line."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import pytest

from harness.campaign import league_campaigns, shipped_people
from harness.campaign.league_campaigns import name_of, open_league
from harness.campaign.shipped_people import People, people_of
from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.drivers.policy_file import Policy, write_policy
from harness.drivers.policy_of_many import card_of_many
from harness.errors import UsageError
from harness.shipped_documents import shipped
from tests.support.policies import some_policy


def drivers(ego: str, folder: Path, allow_code: bool = False) -> list[str]:
    """The kinds of the egos of a league on one scene, and their parameters to search."""
    (campaign,) = open_league(ego, ["zebra"], folder, episodes=2, allow_code=allow_code)
    driver = campaign.ego_driver
    return [] if driver is None else [driver.kind, *(each.key for each in driver.searched)]


def test_ego__of_each_kind_that_can_be_seen(tmp_path: Path) -> None:
    assert drivers("sumo", tmp_path / "a") == []
    assert drivers("adas", tmp_path / "b") == ["rules"]  # its tunable parameters are not searched
    assert drivers(str(shipped("egos") / "rss.toml"), tmp_path / "c") == ["rules"]
    assert drivers(str(shipped("policies") / "paper_merge" / "naive-seed11"), tmp_path / "d") == ["policy"]
    script = tmp_path / "my drive.py"
    shutil.copy(Path(__file__).parents[2] / "egos/examples/process/drive.pl", script)
    command = f"{sys.executable} '{script}'"
    with pytest.raises(UsageError, match="--allow-code"):
        drivers(command, tmp_path / "e")
    assert name_of(command) == "my drive"
    assert name_of(f"{sys.executable} -m drive") == Path(sys.executable).stem


@pytest.mark.parametrize(
    ("ego", "told"),
    [("", "'' names no ego"), (" ", "' ' names no ego"), ("python3 'drive.py", "a mistake: No closing quotation")],
)
def test_ego__that_is_no_command_is_told(ego: str, told: str, tmp_path: Path) -> None:
    for refused in (name_of, lambda each: open_league(each, ["zebra"], tmp_path, episodes=2)):
        with pytest.raises(UsageError, match=f"^--ego: .*{told}"):
            refused(ego)


def test_ego__of_a_file_with_a_quotation_mark_in_its_name(tmp_path: Path) -> None:
    mine = tmp_path / "driver's.toml"
    shutil.copy(shipped("egos") / "rss.toml", mine)
    assert drivers(str(mine), tmp_path / "out") == ["rules"]
    assert name_of(str(mine)) == "driver's"


def test_ego__that_fails_the_test_decision_is_named_by_its_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    file = Path("out") / "egos" / f"{Path(sys.executable).stem}.toml"
    with pytest.raises(UsageError, match=f"^{file}: the test decision failed: .*see harness check-driver {file}"):
        drivers(f"{sys.executable} nowhere.py", Path("out"), allow_code=True)


def test_scenes__of_one_name_are_refused(tmp_path: Path) -> None:
    for folder in ("old", "new"):
        shutil.copytree(shipped("networks") / "zebra", tmp_path / folder / "zebra")
    scenes = [str(tmp_path / folder / "zebra") for folder in ("old", "new", "new")]
    with pytest.raises(UsageError, match=f"^--scenes: {scenes[0]} and {scenes[1]} have the same name"):
        open_league("sumo", scenes, tmp_path / "out", episodes=2)


def test_people__are_discovered_by_their_seeds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A new person of other seeds has a campaign of its own; egos in the folder are no people."""
    both = People(personas=["paper_distracted", "paper_speedy"], seeds=[11], together=False)
    assert people_of(shipped("networks").resolve() / "paper_merge") == [both]
    assert people_of(tmp_path / "paper_merge") == []
    policies = tmp_path / "policies" / "paper_merge"
    shutil.copytree(shipped("policies") / "paper_merge", policies)
    (policies / "paper_speedy-seed11").rename(policies / "paper_speedy-seed12")
    real = shipped
    monkeypatch.setattr(shipped_people, "shipped", lambda kind: policies.parent if kind == "policies" else real(kind))
    scene = real("networks").resolve() / "paper_merge"
    assert [(each.personas, each.seeds) for each in people_of(scene)] == [
        (["paper_distracted"], [11]),
        (["paper_speedy"], [12]),
    ]
    names = [each["name"] for each in league_campaigns._campaigns(scene, "sumo", 2)]
    assert names == ["paper_merge", "paper_merge-seed12"]


def test_people__of_a_policy_of_several_are_found_in_its_card(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    policies = tmp_path / "policies" / "paper_merge"
    personas = [read_document(shipped("personas") / f"{name}.toml", Persona) for name in ("speedy", "texting")]
    for seed in (3, 4):
        write_policy(Policy(some_policy().tensors, card_of_many(personas)), policies / f"people-seed{seed}")
    real = shipped
    monkeypatch.setattr(shipped_people, "shipped", lambda kind: policies.parent if kind == "policies" else real(kind))
    scene = real("networks").resolve() / "paper_merge"
    assert people_of(scene) == [People(personas=["speedy", "texting"], seeds=[3, 4], together=True)]
    (campaign,) = league_campaigns._campaigns(scene, {"driver": "sumo"}, 2)
    assert campaign["non_ego_training"] == {"together": True}


def test_mistakes__are_all_told_before_anything_is_played(tmp_path: Path) -> None:
    with pytest.raises(UsageError) as caught:
        open_league("adsa", ["mergge", "zebra"], tmp_path, episodes=2)
    assert [str(each)[:60] for each in caught.value.problems] == [
        "--ego: there is no driver 'adsa' (did you mean 'adas'?; or n",
        "--scenes: there is no scene 'mergge' (did you mean 'merge'? ",
    ]
    with pytest.raises(UsageError, match="a league trains nothing"):
        open_league("learned", ["zebra"], tmp_path, episodes=2)
