"""`harness falsify`, on a run with shipped policies."""

from __future__ import annotations

from pathlib import Path

import pytest

from harness.assessment.falsification import Searcher
from harness.drivers.reference_drivers import REFERENCES
from harness.errors import USAGE_ERROR
from harness.evaluation.comparisons.games_to_failure import FAILURE
from harness.evaluation.tables import read_csv
from tests.support import shipped
from tests.support.tiny import PAPER_DISTRACTED, SHIPPED, finished, harness

GAMES, REPEATS = 20, 2
PERSON = f"naive_vs_{shipped.SPEEDY}"


@pytest.fixture(scope="module")
def run() -> Path:
    return finished(**SHIPPED, name="falsified")


def test_falsify__writes_what_learned_people_and_searchers_find(run: Path, tmp_path: Path) -> None:
    done = harness("falsify", run, PERSON, "naive_vs_sumo", "--games", GAMES, "--repeats", REPEATS, "--out", tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "failure, 3 comparisons" in done.stdout
    searches, found = read_csv(tmp_path / "searches.csv"), read_csv(tmp_path / "falsification.csv")
    counts = searches.groupby(["arm", "searcher"]).size().to_dict()
    kinds = [(PERSON, "random"), *(("naive_vs_sumo", each.value) for each in Searcher)]
    assert counts == dict.fromkeys(kinds, REPEATS * (1 + len(REFERENCES)))
    assert set(found["criterion"]) == {FAILURE, *REFERENCES}
    failures = searches[searches["criterion"] == FAILURE].set_index(["arm", "searcher", "repeat"])["found"].sort_index()
    for row in searches.itertuples():
        assert row.found <= failures[row.arm, row.searcher, row.repeat]
        assert (row.found > 0) == (1 <= (row.first_game if row.found else 0) <= GAMES)
    assert failures[PERSON, "random"].sum() > 0


def test_falsify__arms_of_one_kind_are_refused(run: Path) -> None:
    done = harness("falsify", run, PERSON)
    assert done.returncode == USAGE_ERROR
    assert "name arms of both, as naive_vs_sumo is one" in done.stdout + done.stderr


def test_falsify__by_default_people_are_as_their_personas_say(tmp_path: Path) -> None:
    run = finished(**SHIPPED, name="falsified_traits", attribution={"baseline": str(PAPER_DISTRACTED)})
    done = harness("falsify", run, "--games", GAMES, "--repeats", REPEATS, "--out", tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    arms = {PERSON, f"naive_vs_{shipped.DISTRACTED}", "naive_vs_sumo"}
    assert set(read_csv(tmp_path / "searches.csv")["arm"]) == arms
