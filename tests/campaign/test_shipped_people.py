"""The shipped people of a scene, as an ego of a campaign meets them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from harness.campaign.shipped_people import ShippedPerson, shipped_people
from harness.config.persona import Persona
from harness.errors import UsageError
from harness.game.observation_layout import LAYOUT
from harness.shipped_documents import shipped

NETWORKS = shipped("networks").resolve()


def person_of(scene: str, name: str) -> ShippedPerson:
    return next(each for each in shipped_people(NETWORKS / scene) if each.persona.name == name)


@pytest.mark.parametrize(("scene", "name"), [("cut_in", "impatient"), ("merge", "tailgater")])
def test_policy__of_a_person_is_one_that_any_game_takes(scene: str, name: str) -> None:
    """The tailgater of the merge is one of the personas of one network."""
    person = person_of(scene, name)
    for folder in person.folders:
        assert person.policy(folder).card["observation"] == list(LAYOUT)


def test_policy__of_another_payoff_is_refused() -> None:
    person = person_of("cut_in", "impatient")
    operational = person.persona.operational.model_copy(update={"weight": 2.0})
    other: Persona = person.persona.model_copy(update={"operational": operational})
    with pytest.raises(UsageError, match="another payoff or limits than the shipped 'impatient'"):
        replace(person, persona=other).policy(person.folders[0])


def test_without__leaves_out_one_training_counted_from_the_first_again() -> None:
    person = person_of("cut_in", "impatient")
    first, second, third = person.folders
    assert [person.without(k) for k in (0, 1, 2, 3)] == [
        (second, third),
        (first, third),
        (first, second),
        (second, third),
    ]
    only = replace(person, folders=(first,))
    assert only.without(0) == (first,)


def test_people__of_a_folder_that_is_no_shipped_scene_are_none(tmp_path: Path) -> None:
    assert shipped_people(tmp_path / "cut_in") == ()
