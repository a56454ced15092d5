"""Policies of another run: each was learned by the persona that it is read for, or is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from harness.campaign.preflight import open_campaign
from harness.config.persona import Persona
from harness.config.toml_reading import read_document
from harness.drivers.policy_file import Policy, persona_hash, write_policy
from harness.errors import Problem, UsageError
from tests.support.policies import some_policy
from tests.support.tiny import CAREFUL, write_campaign, write_persona


def persona_of(file: Path) -> Persona:
    return read_document(file, Persona)


@pytest.fixture
def anna(tmp_path: Path) -> Path:
    return write_persona(tmp_path, "anna")


def campaign_with_policies(folder: Path, anna: Path, **hashes: str) -> Path:
    """A campaign that reads its players; `hashes` replaces the persona hash of a policy, by stage name."""
    for name, player, file in (
        ("naive", "ego", CAREFUL),
        ("anna", "non_ego", anna),
        ("retrained_anna", "ego", CAREFUL),
    ):
        persona = persona_of(file)
        card = {"stage": f"{name}-seed1", "player": player, "persona": persona.name}
        card["persona_sha256"] = hashes.get(name, persona_hash(persona))
        write_policy(Policy(some_policy().tensors, card), folder / "policies" / f"{name}-seed1")
    return write_campaign(folder, personas=[str(anna)], policies="policies", training=None)


def problems_of(campaign: Path) -> list[Problem]:
    with pytest.raises(UsageError) as error:
        open_campaign(campaign)
    return error.value.problems


def test_policies__of_the_campaigns_personas_are_read(tmp_path: Path, anna: Path) -> None:
    assert open_campaign(campaign_with_policies(tmp_path, anna)).policies == tmp_path / "policies"


def test_policies__learned_by_another_payoff_are_refused(tmp_path: Path, anna: Path) -> None:
    campaign = campaign_with_policies(tmp_path, anna)
    write_persona(tmp_path, "anna", goal=2.5)
    (problem,) = problems_of(campaign)
    assert (Path(problem.file).name, problem.key) == ("anna-seed1", "persona_sha256")
    assert "another payoff or limits than the campaign's 'anna' has" in problem.message


def test_policies__of_another_ego_persona_are_refused_one_by_one(tmp_path: Path, anna: Path) -> None:
    wrong = "0" * 64
    problems = problems_of(campaign_with_policies(tmp_path, anna, naive=wrong, retrained_anna=wrong))
    assert [Path(each.file).name for each in problems] == ["naive-seed1", "retrained_anna-seed1"]


def test_policies__without_a_hash_are_refused(tmp_path: Path, anna: Path) -> None:
    campaign = campaign_with_policies(tmp_path, anna)
    card = {"stage": "anna-seed1", "player": "non_ego", "persona": "anna"}
    write_policy(Policy(some_policy().tensors, card), tmp_path / "policies" / "anna-seed1")
    assert [each.key for each in problems_of(campaign)] == ["persona_sha256"]


def test_persona_hash__leaves_out_what_nothing_is_learned_by(anna: Path) -> None:
    persona = persona_of(anna)
    described = persona.model_copy(update={"name": "bert", "description": "the same driver by another name"})
    assert persona_hash(described) == persona_hash(persona)
    assert persona_hash(persona.model_copy(update={"decisions": "sampled"})) != persona_hash(persona)
