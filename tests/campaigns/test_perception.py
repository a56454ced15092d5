"""A campaign with perception errors, by the real command: each arm of an ego once more without them."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd
import pytest

from harness.config.ego_perception import EgoPerception
from harness.config.toml_reading import read_document
from harness.evaluation.tables import read_csv
from harness.evaluation.trace_columns import PERCEIVED
from harness.evaluation.trace_file import SCHEMA
from tests.support import shipped
from tests.support.repository import REPOSITORY
from tests.support.tiny import SHIPPED, finished

pytestmark = pytest.mark.slow
EPISODES = 4
ARMS = ("naive_alone", "naive_vs_sumo", f"naive_vs_{shipped.SPEEDY}")
FOGGY = REPOSITORY / "tests" / "data" / "perception" / "foggy.toml"


@pytest.fixture(scope="module")
def run() -> Path:
    """The shipped policies with perception errors."""
    return finished(**SHIPPED, name="perceived", ego={"perception": str(FOGGY)}, assessment={"episodes": EPISODES})


@pytest.fixture(scope="module")
def unimpaired() -> Path:
    """The same without."""
    return finished(**SHIPPED, name="unimpaired", assessment={"episodes": EPISODES})


def test_perception__each_arm_of_an_ego_is_played_without_errors_too(run: Path) -> None:
    perception = pd.read_csv(run / "perception.csv").set_index("arm")
    assert {*ARMS} <= set(perception.index)
    assert (perception["error_free_arm"] == "error_free_" + perception.index).all()
    assert (perception["pairs"] == EPISODES).all()
    summary = pd.read_csv(run / "summary.csv").set_index("arm")
    against = f"naive_vs_{shipped.SPEEDY}"
    assert 0.0 < summary.loc[against, "lost_share"] < 1.0
    assert 0.0 < summary.loc[against, "ghost_share"] < 1.0
    assert summary.loc[[f"error_free_{each}" for each in ARMS], "lost_share"].isna().all()
    page = (run / "report.html").read_text(encoding="utf-8")
    assert "naive ego without perception errors" in page
    assert 'id="perception"' in page


def test_perception__arms_without_errors_are_those_of_a_campaign_without_them(run: Path, unimpaired: Path) -> None:
    of_run, plain = (read_csv(each / "episodes.csv") for each in (run, unimpaired))
    plain = plain[plain["arm"].isin(ARMS)].drop(columns="arm").reset_index(drop=True)
    free = of_run[of_run["arm"].isin([f"error_free_{each}" for each in ARMS])]
    free = free[plain.columns].reset_index(drop=True)
    pd.testing.assert_frame_equal(free, plain)
    with_errors = of_run[of_run["arm"].isin(ARMS)][plain.columns].reset_index(drop=True)
    assert not with_errors.equals(plain)


def test_perception__the_trace_says_what_the_ego_lost_and_which_ghosts_it_saw(run: Path) -> None:
    arm = f"naive_vs_{shipped.SPEEDY}"
    trace = pd.read_parquet(run / "traces" / f"{arm}-seed{shipped.SEED}.parquet")
    ego = trace[trace["player"] == "ego"]
    assert set(ego["ego_lost"].astype(str)) == {"", "non_ego"}
    ghosts = [each.split() for cell in ego["ego_ghosts"].astype(str) if cell for each in cell.split("; ")]
    assert all(len(each) == 4 for each in ghosts)
    assert len(ghosts) > 0
    assert not (trace.loc[trace["player"] != "ego", ["ego_lost", "ego_ghosts"]].astype(str) != "").any(axis=None)


def test_perception__only_the_traces_of_arms_with_errors_have_its_columns(run: Path) -> None:
    names = [column.name for column in PERCEIVED]
    for file in (run / "traces").iterdir():
        without = file.name.startswith("error_free") or file.name.startswith(f"{shipped.SPEEDY}_alone")
        assert list(pd.read_parquet(file).columns) == [*SCHEMA.names, *([] if without else names)]


def test_perception__the_manifest_has_the_errors(run: Path) -> None:
    manifest = json.loads((run / "manifest.json").read_text(encoding="utf-8"))
    recorded = manifest["campaign"]["ego"]["perception"]
    assert EgoPerception.from_record(recorded) == read_document(FOGGY, EgoPerception)
    assert any(name.endswith("foggy.toml") for name in manifest["hashes"])


def test_perception__the_player_of_the_page_says_it(run: Path) -> None:
    page = (run / "report.html").read_text(encoding="utf-8")
    assert '"perceived":[[' in page
