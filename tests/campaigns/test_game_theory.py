"""Campaigns that go on after the paper's rounds, by the real command: answers, best responses, everyone's games."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from harness.campaign.execution.mixture_weights import equilibrium_of
from harness.campaign.plan.planned_drivers import EquilibriumMixture, Trained
from harness.campaign.storage.run_folder import RunFolder
from tests.support.repository import REPOSITORY
from tests.support.tiny import SPEEDY, TEXTING, TRAINING, carried_out, finished, numbers

pytestmark = pytest.mark.slow

RESPONSE = {"steps": 1024, "starts": 2}


def arms_race() -> Path:
    """Four rounds against the equilibrium's mixture, with everything else that there is to ask."""
    return finished(
        name="arms_race",
        personas=[str(SPEEDY), str(TEXTING)],
        training={**TRAINING, "steps": 1024},
        rounds={"count": 4, "against": "equilibrium", "stop_early": False},
        best_response=RESPONSE,
        crossplay={"egos": ["sumo", str(REPOSITORY / "egos/adas.toml")]},
        retraining={"against": ["speedy"]},
        population=[{"name": "town", "shares": {"speedy": 1.0, "texting": 3.0}}],
    )


def at_equilibrium() -> Path:
    """Of players who have learned nothing in a game of two episodes no gain can be told from 0."""
    return finished(
        name="equilibrium",
        training={**TRAINING, "steps": 1024},
        rounds={"count": 4},
        best_response=RESPONSE,
        assessment={"episodes": 2},
    )


def manifest(run: Path) -> dict[str, Any]:
    return json.loads((run / "manifest.json").read_text(encoding="utf-8"))  # type: ignore[no-any-return]


def test_arms_race__everyone_has_met_everyone_and_who_could_still_gain_was_measured() -> None:
    table = pd.read_csv(arms_race() / "crossplay.csv")
    egos = {"naive", "robust", "retrained_town", "sumo", "adas"}
    egos |= {f"retrained_{who}{round_}" for who in ("speedy", "texting") for round_ in ("", "_round4")}
    non_egos = {f"{who}{round_}" for who in ("speedy", "texting") for round_ in ("", "_round3")}
    rejected = rejected_in(arms_race())
    egos |= {each for each in rejected if each.startswith("retrained")}
    non_egos |= rejected - egos
    assert set(zip(table["ego"], table["non_ego"], strict=True)) == {(ego, other) for ego in egos for other in non_egos}
    assert (table["games"] == 4).all()
    table = pd.read_csv(arms_race() / "gaps.csv")
    assert sorted(zip(table["persona"], table["round"], table["role"], strict=True)) == [
        (who, 4, role) for who in ("speedy", "texting") for role in ("ego", "non_ego")
    ]
    assert 'id="game"' in (arms_race() / "report.html").read_text(encoding="utf-8")
    printed = (arms_race().parent / "printed").read_text(encoding="utf-8")
    assert "speedy, Equilibrium:" in printed
    assert "town, RQ1:" in printed


def test_arms_race__a_player_goes_on_with_the_best_of_its_policies() -> None:
    """The copy of the policy is in the folder of its strategy; the games are those of the selection alone."""
    run, table = arms_race(), pd.read_csv(arms_race() / "selections.csv")
    assert list(dict.fromkeys(table["strategy"])) == [
        f"{made}{who}_round{k}" for who in ("speedy", "texting") for made, k in (("", 3), ("retrained_", 4))
    ]
    for strategy, rows in table.groupby("strategy"):
        assert list(rows["candidate"])[-1] == f"{strategy}_answer"
        assert len(rows) == (2 if rows["role"].iloc[0] == "non_ego" else 3)
        chosen = rows[rows["chosen"]].iloc[0]
        assert rows["payoff"].idxmax() == chosen.name  # of equal ones the first
        assert (rows["episodes"] == 4).all()
        assert (rows["alone"] == (2 if rows["role"].iloc[0] == "non_ego" else 1)).all()
        kept, own = (run / "policies" / f"{name}-seed1" for name in (chosen["candidate"], strategy))
        assert (kept / "policy.safetensors").read_bytes() == (own / "policy.safetensors").read_bytes()
        assert json.loads((own / "policy.json").read_text(encoding="utf-8"))["selected"] == kept.name
        assert f"`{kept.name}`, chosen by a selection" in (own / "README.md").read_text(encoding="utf-8")
        is_taken = chosen["candidate"] == f"{strategy}_answer"
        assert f"the new answer is {'taken' if is_taken else 'rejected'}" in page(run)


def test_arms_race__a_rejected_answer_plays_under_that_name_and_a_taken_one_does_not() -> None:
    stages, rejected = manifest(arms_race())["stages"], rejected_in(arms_race())
    for name, entry in stages.items():
        if "rejected" in name:
            strategies = set(entry["name"].split("_vs_"))
            plays = all(each in rejected for each in strategies if each.endswith("_rejected"))
            assert entry["status"] == ("done" if plays else "settled"), name


def rejected_in(run: Path) -> set[str]:
    """The names under which rejected answers of a run play."""
    table = pd.read_csv(run / "selections.csv")
    answers = table.groupby("strategy").last()
    return {f"{strategy}_rejected" for strategy in answers.index[~answers["chosen"]]}


def page(run: Path) -> str:
    return (run / "report.html").read_text(encoding="utf-8")


def test_arms_race__the_best_start_was_chosen_by_games_of_its_own() -> None:
    entry = manifest(arms_race())["stages"]["retrained_speedy_round4_vs_speedy_round3_ego_response-seed1"]
    earned = entry["earned"]
    assert entry["chosen"] == max(earned, key=earned.__getitem__)
    assert len(earned) == 2


def test_arms_race__the_same_bytes_when_some_of_it_is_done_again(tmp_path: Path) -> None:
    run = shutil.copytree(arms_race(), tmp_path / "run", symlinks=True)
    for name in ("speedy_round3_answer", "speedy_round3", "retrained_speedy_round4_vs_speedy_round3_non_ego_response"):
        shutil.rmtree(run / ".stages" / f"{name}-seed1")
    carried_out(arms_race().with_suffix(".toml"), run)
    assert numbers(run) == numbers(arms_race())


def test_arms_race__an_equilibriums_mixture_has_shares_that_add_up() -> None:
    opponent = EquilibriumMixture(
        members=(Trained(stage="naive-seed1"), Trained(stage="retrained_speedy-seed1")),
        arms=(("naive_vs_speedy-seed1",), ("retrained_vs_speedy-seed1",)),
    )
    table = pd.read_csv(arms_race() / "crossplay.csv").set_index(["ego", "non_ego"])
    earned = [table.loc[(ego, "speedy"), "ego_payoff"] for ego in ("naive", "retrained_speedy")]
    shares = equilibrium_of(opponent, RunFolder(arms_race()))
    assert sum(shares) == pytest.approx(1.0)
    if earned[0] != earned[1]:  # against one strategy the equilibrium is the better answer to it
        assert shares[earned.index(max(earned))] == pytest.approx(1.0)


def test_equilibrium__nothing_follows_a_pair_in_which_no_player_gains() -> None:
    stages = manifest(at_equilibrium())["stages"]
    status = {name: entry["status"] for name, entry in stages.items()}
    assert status["retrained_vs_speedy_ego_response-seed1"] == "done"
    after = {name for name in stages if "round" in name}
    assert after
    assert {status[name] for name in after} == {"settled"}
    assert "not needed" in stages["speedy_round3-seed1"]["message"]
    assert not (at_equilibrium() / "policies" / "speedy_round3-seed1").exists()


def test_equilibrium__is_no_failure_and_nothing_to_do_again(tmp_path: Path) -> None:
    run = shutil.copytree(at_equilibrium(), tmp_path / "run", symlinks=True)
    printed = carried_out(at_equilibrium().with_suffix(".toml"), run)
    assert "skipped  " not in printed  # the stages were finished before
    assert "Not finished" not in printed
