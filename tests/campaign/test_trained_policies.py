"""Policies of another run: each was learned by the persona that it is read for, or is refused."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

import pytest

from harness.campaign.preflight import open_campaign
from harness.config.persona import Persona, UnlikePeople
from harness.config.toml_reading import read_document
from harness.drivers.policy_file import Policy, persona_hash, read_policy, write_policy
from harness.errors import UsageError
from tests.support.policies import some_policy
from tests.support.tiny import CAREFUL, write_campaign, write_persona


def persona_of(file: Path) -> Persona:
    return read_document(file, Persona)


@pytest.fixture
def anna(tmp_path: Path) -> Path:
    return write_persona(tmp_path, "anna")


def campaign_with_policies(folder: Path, anna: Path, hashes: Mapping[str, str | None] = MappingProxyType({})) -> Path:
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


@pytest.mark.parametrize(
    "hashes", [{"naive": "0" * 64, "retrained_anna": "0" * 64}, {"anna": None}], ids=["another ego persona", "no hash"]
)
def test_policies__of_other_personas_are_refused_one_by_one(
    hashes: dict[str, str | None], tmp_path: Path, anna: Path
) -> None:
    campaign = campaign_with_policies(tmp_path, anna)
    assert open_campaign(campaign).policies == tmp_path / "policies"
    with pytest.raises(UsageError) as error:
        open_campaign(campaign_with_policies(tmp_path, anna, hashes))
    refused = [(Path(each.file).name, each.key) for each in error.value.problems]
    assert refused == [(f"{name}-seed1", "persona_sha256") for name in hashes]


def test_policies__learned_by_another_payoff_are_refused(tmp_path: Path, anna: Path) -> None:
    campaign = campaign_with_policies(tmp_path, anna)
    write_persona(tmp_path, "anna", goal=2.5)
    with pytest.raises(UsageError) as error:
        open_campaign(campaign)
    (problem,) = error.value.problems
    assert (Path(problem.file).name, problem.key) == ("anna-seed1", "persona_sha256")
    assert "another payoff or limits than the campaign's 'anna' has" in problem.message


def test_persona_hash__leaves_out_what_nothing_is_learned_by(anna: Path) -> None:
    persona = persona_of(anna)
    declared = [UnlikePeople(figure="max_jerk_mps3", reason="It is made for a test.")]
    others = {"name": "bert", "description": "the same driver by another name", "unlike_people": declared}
    described = persona.model_copy(update=others)
    assert persona_hash(described) == persona_hash(persona)
    assert persona_hash(persona.model_copy(update={"decisions": "sampled"})) != persona_hash(persona)


def test_policies__that_learned_in_other_games_are_told_in_one_line(tmp_path: Path, anna: Path) -> None:
    campaign = campaign_with_policies(tmp_path, anna)
    assert open_campaign(campaign).learned_elsewhere == {}
    for folder in (tmp_path / "policies").iterdir():
        policy = read_policy(folder)
        write_policy(Policy(policy.tensors, {**policy.card, "scene": "crossing", "step_s": 0.2}), folder)
    ((names, words),) = open_campaign(campaign).learned_elsewhere.items()
    assert sorted(names.split(", ")) == ["anna-seed1", "naive-seed1", "retrained_anna-seed1"]
    assert words == "learned in other games: scene crossing, here paper_merge; step_s 0.2, here 0.1"
