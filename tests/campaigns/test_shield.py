"""A campaign with a shield, by the real command: each arm of an ego once more, with the same policies and starts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from harness.evaluation.trace_columns import SHIELDED
from harness.evaluation.trace_file import SCHEMA
from tests.support import shipped
from tests.support.tiny import SHIPPED, finished

pytestmark = pytest.mark.slow
EPISODES = 6
AGAINST = f"naive_vs_{shipped.SPEEDY}"


@pytest.fixture(scope="module")
def run() -> Path:
    """The shipped policies, with and without the shield."""
    return finished(**SHIPPED, name="shield", ego={"shield": "rss"}, assessment={"episodes": EPISODES})


def test_shield__each_arm_of_an_ego_is_played_with_it_too(run: Path) -> None:
    summary = pd.read_csv(run / "summary.csv").set_index("arm")
    arms = ("naive_alone", "naive_vs_sumo", AGAINST, *(f"retrained_{k}_{shipped.SPEEDY}" for k in ("vs", "alone")))
    assert set(summary.index) == {*arms, *(f"shielded_{arm}" for arm in arms), f"{shipped.SPEEDY}_alone"}
    assert summary.loc[f"shielded_{AGAINST}", "shield_interventions_per_km"] > 0.0
    assert 0.0 < summary.loc[f"shielded_{AGAINST}", "shielded_share"] < 0.5
    assert summary.loc[list(arms), "shield_interventions_per_km"].isna().all()
    shields = pd.read_csv(run / "shields.csv").set_index("arm")
    assert set(shields.index) == set(arms)
    assert shields.loc[AGAINST, "pairs"] == EPISODES
    assert shields.loc[AGAINST, "speed_loss_mps"] > 0.0
    page = (run / "report.html").read_text(encoding="utf-8")
    assert "naive ego with the shield" in page
    assert 'id="shields"' in page


def test_shield__the_episodes_table_counts_what_the_trace_shows(run: Path) -> None:
    arm = f"shielded_{AGAINST}"
    trace = pd.read_parquet(run / "traces" / f"{arm}-seed{shipped.SEED}.parquet")
    episodes = pd.read_csv(run / "episodes.csv")
    for row in episodes[episodes["arm"] == arm].to_dict("records"):
        ego = trace[(trace["episode"] == row["episode"]) & (trace["player"] == "ego") & (trace["step"] > 0)]
        ended = ego.index[ego["outcome"] != ""]
        drove = ego.loc[: ended[0]] if len(ended) else ego
        assert row["ego_shielded_share"] == pytest.approx(drove["shielded"].mean())
        begins = np.flatnonzero(np.diff(drove["shielded"].astype(int), prepend=0) > 0)
        km = drove["speed_mps"].sum() * 0.1 / 1000.0
        assert row["ego_shield_interventions_per_km"] == pytest.approx(len(begins) / km)


def test_shield__only_the_traces_of_arms_with_it_have_its_column(run: Path) -> None:
    for file in (run / "traces").iterdir():
        more = [SHIELDED.name] if file.name.startswith("shielded") else []
        assert list(pd.read_parquet(file).columns) == [*SCHEMA.names, *more]
