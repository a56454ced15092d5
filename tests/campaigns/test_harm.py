"""Near misses, harm to others and severity from a whole campaign: its tables, bounds, terminal and page."""

from __future__ import annotations

from typing import Any

import pandas as pd
import pytest

from harness.evaluation.comparisons.summary import summarise
from harness.evaluation.tables import read_csv
from tests.support.pages import Page
from tests.support.tiny import SHIPPED, finished

BOUNDS = {"near_miss_rate": 0.9, "harm_to_others_rate": 0.9}
CAMPAIGN: dict[str, Any] = {**SHIPPED, "name": "harm", "assessment": {"episodes": 8}, "acceptance": BOUNDS}
pytestmark = pytest.mark.slow


def test_tables__have_what_happens_to_others() -> None:
    run = finished(**CAMPAIGN)
    episodes, summary, comparisons = (read_csv(run / f"{name}.csv") for name in ("episodes", "summary", "comparisons"))
    pd.testing.assert_frame_equal(summary, summarise(episodes))
    met = episodes[episodes["arm"].str.contains("_vs_")]
    assert set(met["person_failed"]) <= {0, 1}
    assert met["person_failed"].notna().all()
    assert (met["harm_to_others"] == met["person_failed"]).all()  # the paper's road has no background traffic
    assert met[["bystander_failed", "follower_max_deceleration_mps2"]].isna().all(axis=None)
    harm = comparisons[comparisons["metric"] == "person_failure"]
    assert harm[["question", "pairs"]].to_numpy().tolist() == [["RQ2", 8]]
    assert met.loc[met["ego_outcome"] == "collision", "mais3_risk_high"].notna().all()


def test_bounds__say_criteria_and_what_happens_beside_the_naive_ego() -> None:
    run = finished(**CAMPAIGN)
    printed = " ".join((run.parent / "printed").read_text(encoding="utf-8").split())
    page = Page((run / "report.html").read_text(encoding="utf-8"))
    text = page.text.replace("\N{NO-BREAK SPACE}", " ")
    for shown in (printed, text):
        assert "near misses, paper_speedy: " in shown.replace(" :", ":")
        assert "time to collision of at most 1.5 s" in shown
        assert "of 8 games beside this ego, and in" in shown
    assert "beside the retrained ego, and in" in printed
    assert "Harm to others" in text
