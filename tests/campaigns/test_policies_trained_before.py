"""A campaign whose players were trained before: nothing is trained, and it plays what the full campaign played."""

from __future__ import annotations

import json
import shutil
import warnings
from collections.abc import Callable
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
from harness.config.campaign import Campaign
from harness.drivers.policy_file import write_policy
from harness.environments.gymnasium_env import ParallelDrivingEnv
from harness.errors import Problem, UsageError
from harness.evaluation.tables import read_csv
from harness.game.observation_layout import SIZE
from tests.support.policies import some_policy
from tests.support.shared import built_once
from tests.support.tiny import CAREFUL, SPEEDY, TRAINING, harness, learned_run, tables, write_campaign, write_persona

NAMES = ("naive", "speedy", "retrained_speedy")


def write_played(folder: Path, **changes: Any) -> Path:
    """A tiny campaign that trains nothing."""
    return write_campaign(folder, **{"name": "played", "training": None, "policies": "policies", **changes})


@pytest.fixture
def policies(tmp_path: Path) -> Path:
    """A folder with a policy for each player of seed 1."""
    for number, name in enumerate(NAMES):
        policy = some_policy(number)
        write_policy(type(policy)(policy.tensors, {"stage": f"{name}-seed1"}), tmp_path / "policies" / f"{name}-seed1")
    return tmp_path / "policies"


# --- the plan ---------------------------------------------------------------------------------------------------------


def test_plan__has_the_same_arms_and_no_trainings(tmp_path: Path, policies: Path) -> None:
    full = open_campaign(write_campaign(tmp_path)).document
    played = open_campaign(write_played(tmp_path)).document
    arms = [stage.id for stage in plan(full, ["speedy"]) if isinstance(stage, AssessmentStage)]
    stages = plan(played, ["speedy"])
    assert [stage.id for stage in stages] == arms
    assert {stage.needs for stage in stages} == {()}
    assert questions(played, ["speedy"]) == questions(full, ["speedy"])


def test_plan__says_which_policies_an_arm_reads(tmp_path: Path, policies: Path) -> None:
    stages = plan(open_campaign(write_played(tmp_path)).document, ["speedy"])
    assert {stage.name: stage.reads for stage in stages if isinstance(stage, AssessmentStage)} == {
        "naive_alone": ("naive-seed1",),
        "naive_vs_sumo": ("naive-seed1",),
        "speedy_alone": ("speedy-seed1",),
        "naive_vs_speedy": ("naive-seed1", "speedy-seed1"),
        "retrained_vs_speedy": ("retrained_speedy-seed1", "speedy-seed1"),
        "retrained_alone_speedy": ("retrained_speedy-seed1",),
    }


@pytest.mark.parametrize("file", ["policy.safetensors", "policy.json"])
def test_keys__a_policy_changes_the_arms_it_plays_in(file: str, tmp_path: Path, policies: Path) -> None:
    def keys() -> dict[str, str]:
        campaign = open_campaign(write_played(tmp_path))
        return stage_keys(campaign, plan(campaign.document, ["speedy"]))

    before, place = keys(), policies / "speedy-seed1" / file
    if file == "policy.json":
        place.write_text(place.read_text() + "\n")
    else:
        write_policy(type(some_policy())(some_policy(9).tensors, {"stage": "speedy-seed1"}), place.parent)
    after = keys()
    changed = {name.removesuffix("-seed1") for name in before if before[name] != after[name]}
    assert changed == {"speedy_alone", "naive_vs_speedy", "retrained_vs_speedy"}


def test_keys__do_not_depend_on_where_the_policies_lie(tmp_path: Path, policies: Path) -> None:
    def keys(file: Path) -> dict[str, str]:
        campaign = open_campaign(file)
        return stage_keys(campaign, plan(campaign.document, ["speedy"]))

    moved = shutil.copytree(policies, tmp_path / "elsewhere" / "mine")
    assert keys(write_played(tmp_path)) == keys(write_played(tmp_path / "there", policies=str(moved)))


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
    def keys() -> dict[str, str]:
        campaign = open_campaign(write_played(tmp_path))
        assert campaign.policy_drivers.keys() == {"speedy-seed1"}
        assert "policies/speedy-seed1/mine.onnx" in campaign.hashes
        return stage_keys(campaign, plan(campaign.document, ["speedy"]))

    found = []
    for seed in (1, 2):
        shutil.rmtree(policies / "speedy-seed1")
        of_others(policies / "speedy-seed1", small_network(seed))
        found.append(keys())
    changed = {name.removesuffix("-seed1") for name in found[0] if found[0][name] != found[1][name]}
    assert changed == {"speedy_alone", "naive_vs_speedy", "retrained_vs_speedy"}


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
    done = harness("campaign", campaign, "--out", tmp_path / "run")
    assert done.returncode == 0, done.stdout + done.stderr
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


def without(name: str) -> Callable[[Path], dict[str, Any]]:
    def remove(policies: Path) -> dict[str, Any]:
        shutil.rmtree(policies / name)
        return {}

    return remove


def of_other_shapes(policies: Path) -> dict[str, Any]:
    policy = some_policy()
    tensors = {**policy.tensors, "actor.0.weight": policy.tensors["actor.0.weight"][:, :-1]}
    write_policy(type(policy)(tensors, {"stage": "naive-seed1"}), policies / "naive-seed1")
    return {}


def of_other_observations(policies: Path) -> dict[str, Any]:
    file = policies / "naive-seed1" / "policy.json"
    file.write_text(json.dumps({**json.loads(file.read_text()), "observation": ["speed_mps"]}))
    return {}


def another_player(policies: Path) -> dict[str, Any]:
    shutil.rmtree(policies / "speedy-seed1")
    shutil.copytree(policies / "naive-seed1", policies / "speedy-seed1")
    return {}


def of_somebody_else(policies: Path) -> dict[str, Any]:
    return {"personas": [str(write_persona(policies.parent, "spedy"))]}


# what is wrong -> changes to the campaign or its policies; the problem's file, its key, and words of it
REFUSED: dict[str, tuple[Callable[[Path], dict[str, Any]], str, str, list[str]]] = {
    "folder that is not there": (
        lambda policies: {"policies": "polices"},
        "played.toml",
        "policies",
        ["'polices'", "there is no such folder", "did you mean 'policies'?"],
    ),
    "folder in no folder": (
        lambda policies: {"policies": "nowhere/policies"},
        "played.toml",
        "policies",
        ["'nowhere/policies'", "there is no folder"],
    ),
    "policy that is not there": (
        without("naive-seed1"),
        "played.toml",
        "policies",
        ["'policies' holds no policy 'naive-seed1'", "valid: retrained_speedy, speedy"],
    ),
    "seed that was not trained": (
        lambda policies: {"seeds": [2]},
        "played.toml",
        "policies",
        ["holds no policy 'speedy-seed2'", "there is 'speedy' of seed 1"],
    ),
    "person who was not trained": (
        of_somebody_else,
        "played.toml",
        "policies",
        ["holds no policy 'spedy-seed1'", "did you mean 'speedy'?"],
    ),
    "policy of other shapes": (of_other_shapes, "policy.safetensors", "", ["do not fit"]),
    "policy of other observations": (of_other_observations, "policy.json", "observation", ["observation layout"]),
    "policy of another player": (another_player, "speedy-seed1", "stage", ["'naive-seed1'", "called 'speedy-seed1'"]),
    "training, which would be ignored": (
        lambda policies: {"training": TRAINING},
        "played.toml",
        "training",
        ["nothing is trained", "would be ignored", "leave out"],
    ),
    "training of the naive ego, which would be ignored": (
        lambda policies: {"naive_training": {"alone_share": 0.5}},
        "played.toml",
        "naive_training",
        ["would be ignored"],
    ),
    "retraining, which would be ignored": (
        lambda policies: {"retraining": {"alone_share": 0.5}},
        "played.toml",
        "retraining",
        ["would be ignored"],
    ),
    "training of non-egos, which would be ignored": (
        lambda policies: {"non_ego_training": {"alone_share": 0.5}},
        "played.toml",
        "non_ego_training",
        ["would be ignored"],
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_open_campaign__refuses(name: str, tmp_path: Path, policies: Path) -> None:
    change, file, key, words = REFUSED[name]
    campaign = write_played(tmp_path, **change(policies))
    with pytest.raises(UsageError) as error:
        open_campaign(campaign)

    def fits(problem: Problem) -> bool:
        named = (Path(problem.file).name, problem.key) == (file, key)
        return named and bool(problem.remedy) and all(word in str(problem) for word in words)

    assert any(map(fits, error.value.problems)), str(error.value)


def test_open_campaign__names_every_policy_that_is_missing_at_once(tmp_path: Path, policies: Path) -> None:
    with pytest.raises(UsageError) as error:
        open_campaign(write_played(tmp_path, seeds=[1, 7]))
    assert [problem.message for problem in error.value.problems] == [
        f"'policies' holds no policy '{name}-seed7'" for name in sorted(NAMES)
    ]


def test_command__a_folder_that_is_not_there_is_the_users_mistake(tmp_path: Path) -> None:
    said = harness("campaign", write_played(tmp_path), cwd=tmp_path)
    assert said.returncode == 2
    (line,) = said.stderr.strip().splitlines()
    assert "played.toml: policies: 'policies': there is no such folder (" in line
    assert [each.name for each in tmp_path.iterdir()] == ["played.toml"]


# --- played again -----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def played() -> Path:
    """The run folder of a campaign whose players another run has trained."""

    def build(folder: Path) -> None:
        shutil.copytree(learned_run() / "policies", folder / "policies")
        done = harness("campaign", write_played(folder), "--out", folder / "run", "--quick")
        assert done.returncode == 0, done.stdout + done.stderr
        assert messages.NOTHING_TO_SHORTEN in done.stdout
        assert "started  naive-seed1" not in done.stdout

    return built_once("played", build) / "run"


@pytest.mark.slow
def test_played__the_tables_are_those_of_the_full_campaign_to_the_byte(played: Path) -> None:
    assert tables(played) == tables(learned_run())
    assert (played / "manoeuvres.csv").read_bytes() == (learned_run() / "manoeuvres.csv").read_bytes()
    assert read_csv(played / "training.csv").empty


@pytest.mark.slow
def test_played__the_manifest_records_the_policies_and_no_training(played: Path) -> None:
    manifest = json.loads((played / "manifest.json").read_text())
    assert not manifest["quick"]
    assert manifest["campaign"]["policies"] == "policies"
    assert not {"training", "naive_training", "non_ego_training", "retraining"} & set(manifest["campaign"])
    assert {stage["kind"] for stage in manifest["stages"].values()} == {"assessment"}
    hashed = {f"policies/{name}-seed1/policy.{ending}" for name in NAMES for ending in ("json", "safetensors")}
    assert hashed <= set(manifest["hashes"])
    assert Campaign.model_validate(manifest["campaign"], strict=False).policies == "policies"


@pytest.mark.slow
def test_played__the_report_says_where_the_players_are_from_and_draws_no_learning_curve(played: Path) -> None:
    page = (played / "report.html").read_text(encoding="utf-8")
    assert "Nothing was trained in this run." in page
    assert "<code>policies</code>" in page
    assert 'id="learning"' not in page
    assert "#learning" not in page
    assert "Training budget" not in page
    full = (learned_run() / "report.html").read_text(encoding="utf-8")
    assert "Nothing was trained in this run." not in full
    assert 'id="learning"' in full


@pytest.mark.slow
def test_played__nothing_is_written_to_the_folder_of_the_policies(played: Path) -> None:
    def files(folder: Path) -> dict[str, bytes]:
        return {each.relative_to(folder).as_posix(): each.read_bytes() for each in folder.rglob("*") if each.is_file()}

    assert files(played.parent / "policies") == files(learned_run() / "policies")


@pytest.mark.slow
def test_played__again_is_skipped_and_report_and_replay_work(played: Path, tmp_path: Path) -> None:
    run = shutil.copytree(played, tmp_path / "run")
    before = (run / "report.html").read_bytes()
    again = harness("campaign", played.with_name("played.toml"), "--out", run)
    assert again.returncode == 0, again.stderr
    assert "started" not in again.stdout
    assert harness("report", run).returncode == 0
    assert (run / "report.html").read_bytes() == before
    listed = harness("replay", run, "--list")
    assert listed.returncode == 0
    assert listed.stdout.count("naive_alone ") == 4


@pytest.mark.slow
def test_check__says_that_nothing_is_trained(played: Path) -> None:
    said = harness("check", played.with_name("played.toml"))
    assert said.returncode == 0
    assert f"read from {played.parent / 'policies'}: nothing is trained, 6 arms of 4 episodes" in said.stdout
    assert "assess naive_vs_speedy-seed1  with naive-seed1, speedy-seed1" in said.stdout


@pytest.mark.slow
def test_played__a_policy_that_was_changed_is_played_anew_in_its_arms_only(played: Path, tmp_path: Path) -> None:
    shutil.copytree(played.parent / "policies", tmp_path / "policies")
    run = shutil.copytree(played, tmp_path / "run")
    policy = some_policy()
    write_policy(type(policy)(policy.tensors, {"stage": "speedy-seed1"}), tmp_path / "policies" / "speedy-seed1")
    done = harness("campaign", write_played(tmp_path, personas=[str(SPEEDY)]), "--out", run, "--jobs", 1)
    assert done.returncode == 0, done.stdout + done.stderr
    started = {line.split()[1] for line in done.stdout.splitlines() if line.startswith("started")}
    assert started == {"speedy_alone-seed1", "naive_vs_speedy-seed1", "retrained_vs_speedy-seed1"}
