"""Arms without a trained player have the games of the first training seed."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from harness.campaign.execution.run_players import RunPlayers
from harness.campaign.plan.plan import plan
from harness.campaign.plan.stages import AssessmentStage
from harness.campaign.storage.run_folder import RunFolder
from harness.evaluation.tables import read_csv
from harness.evaluation.trace_file import TraceReader
from tests.support.plans import campaign_of
from tests.support.rollouts import assess
from tests.support.shipped import people_seeds
from tests.support.tiny import REPOSITORY, UNTRAINED, finished

FIRST, SECOND = people_seeds("stop_sign")[:2]
ARM = "naive_vs_sumo"


@pytest.fixture(scope="module")
def run() -> Path:
    """Two training seeds of people, whose ego SUMO drives."""
    return finished(
        **UNTRAINED
        | {
            "name": "two_seeds_of_people",
            "scene": str(REPOSITORY / "networks" / "stop_sign"),
            "personas": [str(REPOSITORY / "personas" / "rolling_stop.toml")],
            "seeds": [FIRST, SECOND],
            "policies": str(REPOSITORY / "policies" / "stop_sign"),
        }
    )


def test_plan__only_arms_without_trained_players_have_the_games_of_another_seed() -> None:
    campaign = campaign_of("anna", seeds=[1, 2], ego={"driver": "sumo", "persona": "careful.toml"})
    arms = [each for each in plan(campaign, ["anna"]) if isinstance(each, AssessmentStage)]
    assert {each.id: each.games_of for each in arms if each.games_of} == {
        "naive_alone-seed2": "naive_alone-seed1",
        "naive_vs_sumo-seed2": "naive_vs_sumo-seed1",
    }
    learned = plan(campaign_of("anna", seeds=[1, 2]), ["anna"])
    assert not any(each.games_of for each in learned if isinstance(each, AssessmentStage))


def test_games__of_another_seed_are_those_that_the_arm_would_play(run: Path) -> None:
    players = RunPlayers(RunFolder(run))
    games = list(assess(players.seated(players.arm(ARM, SECOND)), range(2)))
    assert len(games) == 2
    for episode, game in enumerate(games):
        stored = TraceReader().read(RunFolder(run).traces(f"{ARM}-seed{SECOND}"), episode)
        pd.testing.assert_frame_equal(pd.DataFrame(game.trace), stored, check_dtype=False)


def test_tables__name_the_training_seed_of_the_arm(run: Path) -> None:
    episodes = read_csv(run / "episodes.csv")
    of_arm = episodes[episodes["arm"] == ARM]
    first, second = (of_arm[of_arm["seed"] == seed].reset_index(drop=True) for seed in (FIRST, SECOND))
    assert len(first) == 2
    pd.testing.assert_frame_equal(first.drop(columns="seed"), second.drop(columns="seed"))
    attributes = pd.read_parquet(RunFolder(run).traces(f"{ARM}-seed{SECOND}")).attrs
    assert attributes["seed"] == SECOND
