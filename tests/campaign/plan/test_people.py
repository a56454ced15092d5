"""Campaigns on scenes with several people: crowds, which arms there are, and what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from harness.campaign.plan.paper_rounds import questions
from harness.campaign.plan.planned_drivers import description
from harness.campaign.preflight import open_campaign
from harness.errors import UsageError
from tests.support.plans import campaign_of, planned, stages_of
from tests.support.scenes import THREE_PEOPLE, build_scene
from tests.support.tiny import PAPER_MERGE, TRAINING, write_campaign, write_persona

MIXED = {"name": "mixed", "personas": ["anna", "bert", "anna"]}


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> str:
    return str(build_scene(tmp_path_factory.mktemp("scenes") / "three", places=THREE_PEOPLE).folder)


@pytest.fixture
def personas(tmp_path: Path) -> list[str]:
    return [str(write_persona(tmp_path, name)) for name in ("anna", "bert")]


def test_plan__a_crowd_is_met_and_trained_against_like_a_persona() -> None:
    stages = stages_of("anna", "bert", crowd=[MIXED])
    people = ["anna-seed1", "bert-seed1", "anna-seed1"]
    training = stages.pop("retrained_mixed")
    assert {name: [*map(description, stage.drivers)] for name, stage in stages.items() if "mixed" in name} == {
        "naive_vs_mixed": ["naive-seed1", *people],
        "retrained_vs_mixed": ["retrained_mixed-seed1", *people],
        "retrained_alone_mixed": ["retrained_mixed-seed1"],
    }
    assert [*map(description, training.opponent)] == people
    assert training.needs == ("anna-seed1", "bert-seed1")


def test_plan__questions_about_a_crowd_ask_each_of_its_personas_to_drive_alone() -> None:
    campaign = campaign_of("anna", "bert", crowd=[MIXED])
    asked = [each for each in questions(campaign, ["anna", "bert"]) if each.persona == "mixed"]
    assert [(each.question, each.baseline, each.treatment) for each in asked] == [
        ("RQ1", "naive_alone", "naive_vs_mixed"),
        ("RQ2", "naive_vs_mixed", "retrained_vs_mixed"),
    ]
    assert [each.arm for each in asked[0].alone] == ["naive_alone", "naive_vs_sumo", "anna_alone", "bert_alone"]


def test_keys__of_a_crowd_depend_on_who_is_in_which_place(scene: str, personas: list[str], tmp_path: Path) -> None:
    other = {"name": "mixed", "personas": ["bert", "anna", "anna"]}
    keys = [planned(tmp_path, scene=scene, personas=personas, crowd=[each])[1] for each in (MIXED, other)]
    changed = {name for name in keys[0] if keys[0][name] != keys[1][name]}
    assert changed == {name for name in keys[0] if "mixed" in name}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"crowd": [MIXED | {"personas": ["anna", "bert"]}]},
            "crowd[0].personas: 2 personas, and people of the scene: 3",
        ),
        ({"crowd": [MIXED | {"personas": ["anna", "bart", "anna"]}]}, "crowd[0].personas: there is no persona 'bart'"),
        ({"crowd": [MIXED | {"name": "anna"}]}, "crowd[0].name: 'anna' is the name of a persona"),
        (
            {"best_response": {"steps": 2048}},
            "best_response: is about games of two players, and the scene has 3 people",
        ),
        ({"crossplay": {}}, "crossplay: is about games of two players, and the scene has 3 people"),
        ({"rounds": {"count": 4}}, "rounds.count: is about games of two players, and the scene has 3 people"),
        (
            {"training": TRAINING | {"games": 2}},
            "training.games: 2 games at once, and a person learns in 3 places",
        ),
        ({"scene": str(PAPER_MERGE), "crowd": [MIXED]}, "crowd[0].personas: 3 personas, and people of the scene: 1"),
    ],
)
def test_campaign__what_does_not_fit_the_people_is_refused(
    changes: dict[str, Any], message: str, scene: str, personas: list[str], tmp_path: Path
) -> None:
    file = write_campaign(tmp_path, **{"scene": scene, "personas": personas, **changes})
    with pytest.raises(UsageError) as refused:
        open_campaign(file)
    assert f"{file}: {message}" in str(refused.value)
    assert len(str(refused.value).splitlines()) == 1


def test_campaign__mistakes_about_people_and_about_names_are_told_at_once(
    scene: str, personas: list[str], tmp_path: Path
) -> None:
    wrong = {"crossplay": {"egos": ["learned"]}, "roads": [str(PAPER_MERGE)]}
    file = write_campaign(tmp_path, scene=scene, personas=personas, **wrong)
    with pytest.raises(UsageError) as refused:
        open_campaign(file)
    assert [each.key for each in refused.value.problems] == ["crossplay", "crossplay.egos", "roads"]
