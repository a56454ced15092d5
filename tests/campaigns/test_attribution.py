"""A whole campaign with `[attribution]`: which trait makes the ego fail, from the games that were played."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

import harness
from harness.evaluation.comparisons.comparison import mcnemar
from harness.evaluation.tables import read_csv
from tests.support.pages import Page
from tests.support.tiny import BY_SUMO, CAREFUL, TEXTING, finished

pytestmark = pytest.mark.slow

OWN, BASELINE = "naive_vs_texting", "naive_vs_careful"
WITHOUT = {trait: f"{OWN}_with_{trait}_of_careful" for trait in ("payoff", "attention")}
ALONE = {trait: f"{BASELINE}_with_{trait}_of_texting" for trait in ("payoff", "attention")}
EPISODES = 4


def run() -> Path:
    """Both people learn; the ego is SUMO's."""
    return finished(
        **{
            **BY_SUMO,
            "name": "attributed",
            "personas": [str(TEXTING)],
            "attribution": {"baseline": str(CAREFUL)},
            "assessment": {"episodes": EPISODES},
        }
    )


def trace(arm: str, episode: int, player: str = "non_ego") -> pd.DataFrame:
    steps = harness.load(run()).trace(arm, 1, episode)
    return steps[steps["player"] == player].reset_index(drop=True)


def test_table__has_the_counts_of_the_arms() -> None:
    found, episodes = read_csv(run() / "attribution.csv"), read_csv(run() / "episodes.csv")
    assert found["trait"].tolist() == ["all", "payoff", "attention"]
    failed = episodes.pivot(index="episode", columns="arm", values="ego_failed").astype("float64")
    for row in found.to_dict("records"):
        without = WITHOUT.get(row["trait"], BASELINE)
        assert (row["arm"], row["without_arm"], row["baseline_arm"]) == (OWN, without, BASELINE)
        assert (row["failures"], row["failures_without"]) == (failed[OWN].sum(), failed[without].sum())
        assert row["without_pairs"] == EPISODES
        caused = (failed[OWN] - failed[without]).to_numpy()
        assert row["without_p"] == pytest.approx(mcnemar(caused, "two-sided"))
        if row["trait"] in ALONE:
            assert row["alone_arm"] == ALONE[row["trait"]]
            assert (row["failures_baseline"], row["failures_alone"]) == (
                failed[BASELINE].sum(),
                failed[row["alone_arm"]].sum(),
            )


def test_pairs__start_alike_with_the_same_draws() -> None:
    pose = ["x_m", "y_m", "heading_rad", "speed_mps", "friction", "limit_share"]
    for episode in range(EPISODES):
        for player in ("ego", "non_ego"):
            own = trace(OWN, episode, player)[pose].iloc[0].tolist()
            for arm in (BASELINE, *WITHOUT.values(), *ALONE.values()):
                assert trace(arm, episode, player)[pose].iloc[0].tolist() == own


def test_switch__reaches_the_games() -> None:
    """Attention: lapses exist in the arms of who has it, at the same times, and in no other."""
    with_lapses = {OWN, WITHOUT["payoff"], ALONE["attention"]}
    for arm in (OWN, BASELINE, *WITHOUT.values(), *ALONE.values()):
        lapsed = [trace(arm, episode)["lapsed"].any() for episode in range(EPISODES)]
        assert any(lapsed) == (arm in with_lapses), arm
    for episode in range(EPISODES):
        drives = [trace(arm, episode) for arm in (OWN, WITHOUT["payoff"])]
        own, other = (drive.loc[drive["outcome"] == "", "lapsed"].tolist() for drive in drives)
        together = min(len(own), len(other))
        assert own[:together] == other[:together]


def test_switch__of_the_payoff_is_the_policy_of_the_other() -> None:
    """Without lapses both policies drive the same start in another way; each is the same in all arms that have it."""

    def drive(arm: str) -> list[float]:
        return trace(arm, 0)["acceleration_mps2"].tolist()[:20]

    assert drive(BASELINE) != drive(ALONE["payoff"])
    assert drive(ALONE["payoff"]) == drive(WITHOUT["attention"])  # texting's policy without lapses, in both


def test_undecided__has_a_row_for_each_arm_of_the_ego_against_a_person() -> None:
    found = read_csv(run() / "undecided.csv").set_index("arm")
    assert set(found.index) == {OWN, BASELINE, *WITHOUT.values(), *ALONE.values()}
    episodes = read_csv(run() / "episodes.csv").groupby("arm")["ego_failed"].sum()
    assert found["failures"].tolist() == episodes[found.index].tolist()
    assert found.loc[[BASELINE, WITHOUT["attention"]]].filter(like="undecided").sum().sum() == 0


def test_report__has_the_table_first_and_no_card_of_the_baseline() -> None:
    html = (run() / "report.html").read_text(encoding="utf-8")
    page = Page(html)
    sections = [attributes["id"] for tag, attributes in page.tags if tag == "section" and "id" in attributes]
    assert sections.index("attribution") < sections.index("starts") < sections.index("verdicts")
    cards = [attributes for tag, attributes in page.tags if tag == "article"]
    assert len(cards) == 1
    replays = {file.name for file in (run() / "replays").iterdir()}
    assert not any("_of_" in name for name in replays)
