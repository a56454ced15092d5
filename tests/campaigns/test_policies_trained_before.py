"""A campaign whose players were trained before: nothing is trained, and it plays what the full campaign played."""

from __future__ import annotations

import json
import shutil
import warnings
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
import torch

from harness.campaign.execution.cache_keys import stage_keys
from harness.campaign.plan.paper_rounds import questions
from harness.campaign.plan.plan import plan
from harness.campaign.plan.stages import AssessmentStage
from harness.campaign.preflight import open_campaign
from harness.cli import messages
from harness.drivers.policy_file import Policy, write_policy
from harness.environments.gymnasium_env import ParallelDrivingEnv
from harness.errors import LEARNERS, UsageError
from harness.evaluation.tables import read_csv
from harness.game.observation_layout import SIZE
from tests.support.policies import some_policy
from tests.support.shared import built_once
from tests.support.tiny import (
    CAREFUL,
    TRAINING,
    carried_out,
    files_in,
    harness,
    learned_run,
    tables,
    without,
    write_campaign,
    write_persona,
)

NAMES = ("naive", "speedy", "retrained_speedy")
MISSING = "needs PyTorch and Stable-Baselines3, which are not installed (pip install 'safedriverl-harness[training]')"


def write_played(folder: Path, **changes: Any) -> Path:
    """A tiny campaign that trains nothing."""
    return write_campaign(folder, **{"name": "played", "training": None, "policies": "policies", **changes})


@pytest.fixture
def policies(tmp_path: Path) -> Path:
    """A folder with a policy for each player of seed 1."""
    for number, name in enumerate(NAMES):
        policy = Policy(some_policy(number).tensors, {"stage": f"{name}-seed1"})
        write_policy(policy, tmp_path / "policies" / f"{name}-seed1")
    return tmp_path / "policies"


def keys(campaign: Path) -> dict[str, str]:
    """The keys of a campaign's stages, by their names without the seed."""
    opened = open_campaign(campaign)
    found = stage_keys(opened, plan(opened.document, ["speedy"]))
    return {name.removesuffix("-seed1"): key for name, key in found.items()}


OF_SPEEDY = {"speedy_alone", "naive_vs_speedy", "retrained_vs_speedy"}


# --- the plan ---------------------------------------------------------------------------------------------------------


def test_plan__has_the_same_arms_which_read_policies_and_no_trainings(tmp_path: Path, policies: Path) -> None:
    full = open_campaign(write_campaign(tmp_path)).document
    played = open_campaign(write_played(tmp_path)).document
    stages = plan(played, ["speedy"])
    assert [each.id for each in stages] == [
        each.id for each in plan(full, ["speedy"]) if isinstance(each, AssessmentStage)
    ]
    assert {stage.needs for stage in stages} == {()}
    assert questions(played, ["speedy"]) == questions(full, ["speedy"])
    assert {stage.name: stage.reads for stage in stages if isinstance(stage, AssessmentStage)} == {
        "naive_alone": ("naive-seed1",),
        "naive_vs_sumo": ("naive-seed1",),
        "speedy_alone": ("speedy-seed1",),
        "naive_vs_speedy": ("naive-seed1", "speedy-seed1"),
        "retrained_vs_speedy": ("retrained_speedy-seed1", "speedy-seed1"),
        "retrained_alone_speedy": ("retrained_speedy-seed1",),
    }


def test_keys__a_policy_changes_those_of_its_arms_and_its_place_changes_none(tmp_path: Path, policies: Path) -> None:
    moved = shutil.copytree(policies, tmp_path / "elsewhere" / "mine")
    found = [keys(write_played(tmp_path))]
    assert keys(write_played(tmp_path / "there", policies=str(moved))) == found[0]
    write_policy(Policy(some_policy(9).tensors, {"stage": "speedy-seed1"}), policies / "speedy-seed1")
    found.append(keys(write_played(tmp_path)))
    card = policies / "speedy-seed1" / "policy.json"
    card.write_text(card.read_text() + "\n")
    found.append(keys(write_played(tmp_path)))
    for before, after in pairwise(found):
        assert {name for name in before if before[name] != after[name]} == OF_SPEEDY


# --- policies that others trained -------------------------------------------------------------------------------------


def of_others(folder: Path, network: torch.nn.Module) -> Path:
    """A policy's folder with a network of others, as their own tools export it."""
    folder.mkdir(parents=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        torch.onnx.export(network, (torch.zeros(1, SIZE),), str(folder / "mine.onnx"), dynamo=False)
    (folder / "driver.toml").write_text('kind = "onnx"\nfile = "mine.onnx"\n')
    return folder


def small_network(seed: int) -> torch.nn.Module:
    torch.manual_seed(seed)
    return torch.nn.Sequential(torch.nn.Linear(SIZE, 8), torch.nn.Tanh(), torch.nn.Linear(8, 2), torch.nn.Tanh())


def test_of_others__the_network_is_part_of_the_keys_of_its_arms(tmp_path: Path, policies: Path) -> None:
    found = []
    for seed in (1, 2):
        shutil.rmtree(policies / "speedy-seed1")
        of_others(policies / "speedy-seed1", small_network(seed))
        campaign = open_campaign(write_played(tmp_path))
        assert campaign.policy_drivers.keys() == {"speedy-seed1"}
        assert "policies/speedy-seed1/mine.onnx" in campaign.hashes
        found.append(keys(write_played(tmp_path)))
    assert {name for name in found[0] if found[0][name] != found[1][name]} == OF_SPEEDY


def test_of_others__code_needs_permission_and_what_does_not_fit_is_refused(tmp_path: Path, policies: Path) -> None:
    shutil.rmtree(policies / "speedy-seed1")
    (policies / "speedy-seed1").mkdir()
    for text, message in (
        ('kind = "process"\ncommand = ["perl"]\n', "--allow-code"),
        ('kind = "sumo"\nvehicle_type = "ego_car"\n', "SUMO's models are no policy"),
        ('kind = "onnx"\nfile = "mine.onnx"\n', "'mine.onnx': there is no such file"),
    ):
        (policies / "speedy-seed1" / "driver.toml").write_text(text)
        with pytest.raises(UsageError, match=message):
            open_campaign(write_played(tmp_path))


@pytest.mark.slow
def test_of_others__both_players_trained_together_come_back_as_ego_and_person(tmp_path: Path) -> None:
    """A trainer of its own: two networks, each with a step of REINFORCE, in the environment with both players."""
    networks = {agent: small_network(seed) for seed, agent in enumerate(("ego", "non_ego"))}
    game = ParallelDrivingEnv(ego_persona="careful", non_ego_persona="speedy")
    try:
        seen, _ = game.reset(seed=1)
        chances, returns = {agent: [] for agent in networks}, dict.fromkeys(networks, 0.0)
        for _ in range(20):
            actions = {}
            for agent in game.agents:
                drawn = torch.distributions.Normal(networks[agent](torch.from_numpy(seen[agent])), 0.1)
                sample = drawn.sample()
                chances[agent].append(drawn.log_prob(sample).sum())
                actions[agent] = sample.clamp(-1.0, 1.0).numpy()
            seen, rewards, *_ = game.step(actions)
            returns = {agent: returns[agent] + rewards.get(agent, 0.0) for agent in networks}
    finally:
        game.close()
    for agent, network in networks.items():
        (-torch.stack(chances[agent]).sum() * returns[agent]).backward()
        torch.optim.SGD(network.parameters(), 1e-3).step()
    ego = of_others(tmp_path / "egos", networks["ego"]) / "driver.toml"
    of_others(tmp_path / "policies" / "speedy-seed1", networks["non_ego"])
    campaign = write_played(tmp_path, ego={"driver": str(ego), "persona": str(CAREFUL)}, assessment={"episodes": 2})
    carried_out(campaign, tmp_path / "run")
    episodes = read_csv(tmp_path / "run" / "episodes.csv")
    assert set(episodes["arm"]) == {"naive_alone", "naive_vs_sumo", "speedy_alone", "naive_vs_speedy"}
    assert set(episodes["error"]) == {""}


def test_open_campaign__an_ego_of_ones_own_needs_the_people_only(tmp_path: Path, policies: Path) -> None:
    for name in ("naive", "retrained_speedy"):
        shutil.rmtree(policies / f"{name}-seed1")
    campaign = open_campaign(write_played(tmp_path, ego={"driver": "sumo", "persona": str(CAREFUL)}))
    stages = plan(campaign.document, ["speedy"])
    assert [stage.id.removesuffix("-seed1") for stage in stages] == [
        *("naive_alone", "naive_vs_sumo", "speedy_alone", "naive_vs_speedy")
    ]


def test_open_campaign__there_is_nothing_to_make_quick(tmp_path: Path, policies: Path) -> None:
    quick, full = (open_campaign(write_played(tmp_path), quick) for quick in (True, False))
    assert not quick.quick
    assert quick.document == full.document


# --- what is refused --------------------------------------------------------------------------------------------------


def without_the_naive_ego(policies: Path) -> None:
    shutil.rmtree(policies / "naive-seed1")


def of_other_shapes(policies: Path) -> None:
    policy = some_policy()
    tensors = {**policy.tensors, "actor.0.weight": policy.tensors["actor.0.weight"][:, :-1]}
    write_policy(Policy(tensors, {"stage": "naive-seed1"}), policies / "naive-seed1")


def of_other_observations(policies: Path) -> None:
    file = policies / "naive-seed1" / "policy.json"
    file.write_text(json.dumps({**json.loads(file.read_text()), "observation": ["speed_mps"]}))


def of_another_player(policies: Path) -> None:
    shutil.rmtree(policies / "speedy-seed1")
    shutil.copytree(policies / "naive-seed1", policies / "speedy-seed1")


def of_nobody_in_the_campaign(policies: Path) -> None:
    write_persona(policies.parent, "spedy")


@pytest.mark.parametrize(
    ("spoil", "changes", "place", "words"),
    [
        (None, {"policies": "polices"}, "played.toml: policies", "there is no such folder (name one laid out as"),
        (None, {"policies": "nowhere/policies"}, "played.toml: policies", "there is no folder"),
        (without_the_naive_ego, {}, "played.toml: policies", "holds no policy 'naive-seed1' (valid: retrained_speedy"),
        (None, {"seeds": [2]}, "played.toml: policies", "holds no policy 'speedy-seed2' (there is 'speedy' of seed 1"),
        (of_nobody_in_the_campaign, {"personas": ["spedy.toml"]}, "played.toml: policies", "did you mean 'speedy'?"),
        (of_other_shapes, {}, "policy.safetensors", "do not fit"),
        (of_other_observations, {}, "policy.json: observation", "observation layout"),
        (of_another_player, {}, "speedy-seed1: stage", "called 'speedy-seed1'"),
        (None, {"training": TRAINING}, "played.toml: training", "would be ignored"),
        (None, {"retraining": {"starts": "regret"}}, "played.toml: retraining", "would be ignored"),
        *(
            (None, {table: {"alone_share": 0.5}}, f"played.toml: {table}", "would be ignored")
            for table in ("naive_training", "retraining", "non_ego_training")
        ),
    ],
)
def test_open_campaign__refuses(
    spoil: Callable[[Path], None] | None,
    changes: dict[str, Any],
    place: str,
    words: str,
    tmp_path: Path,
    policies: Path,
) -> None:
    if spoil:
        spoil(policies)
    with pytest.raises(UsageError) as error:
        open_campaign(write_played(tmp_path, **changes))
    said = [str(each) for each in error.value.problems if each.remedy]
    assert [each for each in said if f"/{place}: " in each and words in each], said


def test_open_campaign__names_every_policy_that_is_missing_at_once(tmp_path: Path, policies: Path) -> None:
    with pytest.raises(UsageError) as error:
        open_campaign(write_played(tmp_path, seeds=[1, 7]))
    assert [problem.message for problem in error.value.problems] == [
        f"'policies' holds no policy '{name}-seed7'" for name in sorted(NAMES)
    ]


# --- played again -----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def played() -> Path:
    """The run folder of a campaign whose players another run has trained."""

    def build(folder: Path) -> None:
        shutil.copytree(learned_run() / "policies", folder / "policies")
        printed = carried_out(write_played(folder), folder / "run", "--quick")
        assert messages.NOTHING_TO_SHORTEN in printed
        assert "started  naive-seed1" not in printed

    return built_once("played", build) / "run"


@pytest.mark.slow
def test_played__the_tables_are_those_of_the_full_campaign_to_the_byte(played: Path) -> None:
    assert tables(played) == tables(learned_run())
    assert (played / "manoeuvres.csv").read_bytes() == (learned_run() / "manoeuvres.csv").read_bytes()
    assert read_csv(played / "training.csv").empty
    assert files_in(played.parent / "policies") == files_in(learned_run() / "policies")  # nothing is written there


@pytest.mark.slow
def test_played__without_pytorch(tmp_path: Path) -> None:
    """An ego by rules, whose parameters are searched, against a person who was trained before."""
    shutil.copytree(learned_run() / "policies", tmp_path / "policies")
    file = write_played(
        tmp_path, ego={"driver": "adas", "persona": str(CAREFUL)}, reconfiguration={"trials": 2, "games": 2}
    )
    done = harness("campaign", file, "--out", tmp_path / "run", env=without(tmp_path, *LEARNERS))
    assert done.returncode == 0, done.stdout + done.stderr
    assert (tmp_path / "run" / "report.html").is_file()


@pytest.mark.slow
def test_played__manifest_and_report_say_where_the_players_are_from_and_that_nothing_was_trained(played: Path) -> None:
    manifest = json.loads((played / "manifest.json").read_text())
    assert not manifest["quick"]
    assert manifest["campaign"]["policies"] == "policies"
    assert not {"training", "naive_training", "non_ego_training", "retraining"} & set(manifest["campaign"])
    assert {stage["kind"] for stage in manifest["stages"].values()} == {"assessment"}
    hashed = {f"policies/{name}-seed1/policy.{ending}" for name in NAMES for ending in ("json", "safetensors")}
    assert hashed <= set(manifest["hashes"])
    page, full = ((run / "report.html").read_text(encoding="utf-8") for run in (played, learned_run()))
    assert "<code>policies</code>" in page
    for words, trained in (
        ("Nothing was trained in this run.", False),
        ('id="learning"', True),
        ("#learning", True),
        ("Training budget", True),
    ):
        assert (words in full, words in page) == (trained, not trained), words


# --- without the extra `training` -------------------------------------------------------------------------------------


def test_without_learners__a_training_is_refused_before_anything_runs(tmp_path: Path) -> None:
    run = tmp_path / "run"
    refused = harness("campaign", write_campaign(tmp_path), "--out", run, env=without(tmp_path, *LEARNERS))
    assert (refused.returncode, refused.stderr) == (2, f"training naive-seed1: {MISSING}\n")
    assert not list(run.glob(".stages/*/*.parquet"))


def test_without_learners__a_command_that_needs_them_says_so(tmp_path: Path, policies: Path) -> None:
    network = ["policy", "export", policies / "naive-seed1", tmp_path / "naive.pt"]
    refused = harness(*network, env=without(tmp_path, *LEARNERS))
    assert (refused.returncode, refused.stderr) == (2, f"harness {' '.join(map(str, network))}: {MISSING}\n")
